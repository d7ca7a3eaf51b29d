"""Independent tasks over worker processes, in order, with a progress bar; bad ones stop the run or are set aside."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

from joblib import Parallel, delayed

from pipeline.errors import HinterlandError
from pipeline.stages.progress import track

Task = TypeVar("Task")
Result = TypeVar("Result")

ON_ERROR = ("stop", "skip")


class Refused(NamedTuple):
    """A task that could not be done, and the sentence that says why."""

    name: str
    reason: str


@dataclass(frozen=True)
class _Outcome(Generic[Result]):
    name: str
    result: Result | None
    error: HinterlandError | None


def make_all(
    make: Callable[[Task], Result],
    tasks: Sequence[tuple[str, Task]],
    *,
    on_error: str,
    workers: int,
    label: str,
    progress: bool = True,
) -> tuple[list[Result], list[Refused]]:
    """Return ``make(task)`` of the named ``tasks`` in their order, and the refused ones.

    on_error: "stop" raises the first HinterlandError in task order, "skip" sets such tasks aside.
    The results do not depend on the number of workers.
    """
    jobs = Parallel(n_jobs=max(1, min(workers, len(tasks))), return_as="generator")
    outcomes = jobs(delayed(_attempt)(make, name, task) for name, task in tasks)
    made: list[Result] = []
    refused: list[Refused] = []
    for outcome in track(outcomes, len(tasks), label, shown=progress):
        if outcome.error is None:
            made.append(outcome.result)
        elif on_error == "stop":
            outcomes.close()
            raise outcome.error
        else:
            refused.append(Refused(outcome.name, str(outcome.error)))
    return made, refused


def _attempt(make: Callable[[Task], Result], name: str, task: Task) -> _Outcome[Result]:
    try:
        return _Outcome(name, make(task), None)
    except HinterlandError as error:
        return _Outcome(name, None, error)
