"""A child process that reads plans from damaged files, so that a crash, a hang or a flood of memory ends only it."""

import multiprocessing
import resource
import shutil
import signal
import tempfile
import time
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers import PLAN, ReadOptions, classify, dxf_entities, ifc_cuts, read_plan_file, read_plans
from pipeline.floorplans.sources import lone_file, open_source
from tests.fuzz.sample import ARCHIVE, MANIFEST, Sample
from tests.fuzz.seeds import known_formats, samples_of

MOST_SECONDS = 5.0  # of processor time, so that a busy machine does not count
MOST_BYTES = 1_500_000_000  # of address space beyond what the imports took
_WALL_SECONDS = 120.0  # for an input that sleeps or waits, as on a pipe
_MOST_UNPACKED = 200_000_000  # instead of 2 GB, which take their time
_MOST_IFC_SECONDS, _MOST_IFC_MEMORY = 20.0, 4_000_000_000  # of the process that cuts a model
_MANIFEST_OF = "c0ffee.json"  # the plan that a fuzzed manifest lies beside
_FAULT = "which is its fault"
_SIZE, _PEAK = "VmSize:", "VmHWM:"


class Verdict(NamedTuple):
    """What became of one input. failure: what should not have happened, or empty. megabytes: growth at its peak."""

    plans: int = 0
    refused: int = 0
    seconds: float = 0.0
    megabytes: float = 0.0
    failure: str = ""


class Worker:
    """Runs one child, and starts another one where it died."""

    def __init__(self) -> None:
        self._folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
        self._count = 0
        self._child: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None

    def __enter__(self) -> Self:
        self._start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop()
        shutil.rmtree(self._folder, ignore_errors=True)

    def read(self, reader: str, sample: Sample) -> Verdict:
        """Write the files, have the child read them, and take them away again."""
        if self._child is None:
            self._start()
        self._count += 1
        folder = self._folder / str(self._count)
        try:
            for name, content in sample.files.items():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).write_bytes(content)
            return self._ask(reader, folder, sample)
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def kill(self) -> None:
        """End the child as a crash would; the next input finds it dead."""
        assert self._child is not None
        self._child.kill()
        self._child.join(10)

    def _ask(self, reader: str, folder: Path, sample: Sample) -> Verdict:
        assert self._pipe is not None and self._child is not None
        try:
            self._pipe.send((reader, folder, sample.main, sample.options, (sample.main, *sample.files)))
            if self._pipe.poll(_WALL_SECONDS):
                answer: Verdict = self._pipe.recv()
                return answer
            self._stop()
            return Verdict(failure=f"no answer after {_WALL_SECONDS:g} s")
        except (EOFError, ConnectionError):
            self._child.join(10)
            code = self._child.exitcode or 0
            self._stop()
            if -code == signal.SIGPROF:
                return Verdict(seconds=MOST_SECONDS, failure=f"took more than {MOST_SECONDS:g} s of processor time")
            return Verdict(failure=f"the process died: {signal.Signals(-code).name if code < 0 else f'exit {code}'}")

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._child = context.Process(target=_serve, args=(theirs,), daemon=True)
        self._child.start()
        theirs.close()
        if not self._pipe.poll(_WALL_SECONDS) or self._pipe.recv() != "ready":
            raise RuntimeError("the worker did not start")

    def _stop(self) -> None:
        if self._child is not None:
            self._child.kill()
            self._child.join(10)
        if self._pipe is not None:
            self._pipe.close()
        self._child = self._pipe = None


def _serve(pipe: Connection) -> None:
    """Answer until the pipe closes. Everything that is loaded late is loaded before the limits are set."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    dxf_entities.MOST_ENTITIES = 30_000  # of 300,000, which take ten times as long
    ifc_cuts.MOST_SECONDS, ifc_cuts.MOST_MEMORY = _MOST_IFC_SECONDS, _MOST_IFC_MEMORY
    with tempfile.TemporaryDirectory() as scratch:
        for reader in sorted(known_formats()):
            for number, sample in enumerate(samples_of(reader)):
                folder = Path(scratch) / reader / str(number)
                for name, content in sample.files.items():
                    (folder / name).parent.mkdir(parents=True, exist_ok=True)
                    (folder / name).write_bytes(content)
                examine(reader, folder / sample.main, sample.options, tuple(sample.files))
    most = _kilobytes(_SIZE) * 1024 + MOST_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    pipe.send("ready")
    while True:
        try:
            reader, folder, main, options, names = pipe.recv()
        except EOFError:
            return
        pipe.send(_measured(reader, folder / main, options, names))


def _measured(reader: str, path: Path, options: ReadOptions, names: tuple[str, ...]) -> Verdict:
    Path("/proc/self/clear_refs").write_text("5")  # starts the peak anew
    before, start = _kilobytes(_PEAK), time.process_time()
    # By default this signal ends the process, and it does so in the middle of a C library too.
    signal.setitimer(signal.ITIMER_PROF, MOST_SECONDS)
    try:
        plans, refused, failure = examine(reader, path, options, names)
    except BaseException as problem:  # whatever it is, it is the finding
        plans, refused, failure = 0, 0, f"{type(problem).__name__}: {str(problem)[:300]}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    growth = max(0, _kilobytes(_PEAK) - before) / 1000
    return Verdict(plans, refused, time.process_time() - start, growth, failure)


def _kilobytes(field: str) -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(field))


def examine(reader: str, path: Path, options: ReadOptions, names: tuple[str, ...] = ()) -> tuple[int, int, str]:
    """Read a file as the pipeline does; return how many plans, how many refusals, and what should not have been."""
    names = (*names, path.name, *((_MANIFEST_OF,) if reader == MANIFEST else ()))
    plans = refused = 0
    try:
        for found in _found(reader, path, options):
            problem = found if isinstance(found, PlanError) else _refusal(found)
            plans, refused = plans + (problem is None), refused + (problem is not None)
            failure = _unclear(problem, names) if problem is not None else _unsound(found)
            if failure:
                return plans, refused, failure
    except PlanError as problem:
        return plans, refused + 1, _unclear(problem, names)
    return plans, refused, ""


def _found(reader: str, path: Path, options: ReadOptions) -> list[FloorPlan | GridPlan | PlanError]:
    if reader == MANIFEST:
        return read_plan_file(path.with_name(_MANIFEST_OF), "houseexpo", options)
    if reader != ARCHIVE:
        classify([lone_file(path)])  # every reader looks into every file, and never raises
        return read_plan_file(path, reader, options)
    found: list[FloorPlan | GridPlan | PlanError] = []
    with open_source(path, most_bytes=_MOST_UNPACKED) as files:
        for entry in classify(files):
            if entry.problem is not None:
                found.append(entry.problem)
            elif entry.role == PLAN and entry.reader is not None:
                try:
                    found += read_plans(entry.file, entry.reader, options)
                except PlanError as problem:
                    found.append(problem)
    return found


def _refusal(plan: FloorPlan | GridPlan | PlanError) -> PlanError | None:
    assert not isinstance(plan, PlanError)
    try:
        inspect(plan)
    except PlanError as problem:
        return problem
    return None


def _unclear(problem: PlanError | None, names: tuple[str, ...]) -> str:
    """Return what is wrong with a message, or nothing."""
    text = str(problem)
    if _FAULT in text:
        return f"an error that is not a PlanError: {text[:500]}"
    if not text.isprintable():
        return f"a message that is not one clean line: {text[:300]!r}"
    if len(text) > 2000:
        return f"a message of {len(text):,} letters: {text[:200]}"
    if not any(Path(name).name in text for name in names):
        return f"a message that does not name the file: {text[:300]}"
    return ""


def _unsound(plan: FloorPlan | GridPlan | PlanError) -> str:
    """Return what is wrong with a plan that passed its checks, or nothing."""
    assert not isinstance(plan, PlanError)
    texts = [plan.plan_id, plan.building, plan.floor, plan.environment, plan.source, *plan.remarks]
    if isinstance(plan, FloorPlan):
        texts += [room.label for room in plan.rooms]
    else:
        texts += [label for layer in plan.layers.values() for label in layer.labels.values()]
        if any(layer.values.shape != plan.cells.shape for layer in plan.layers.values()):
            return "a layer has another shape than the plan"
    bad = next((text for text in texts if not text.isprintable() or len(text) > 2000), None)
    return f"a text of the plan is not one clean line: {bad[:200]!r}" if bad is not None else ""
