from typing import Any

import pytest

from pipeline.errors import TableError
from pipeline.evaluation.summary import summarise
from pipeline.evaluation.training_spread import training_spread
from tests.evaluation.rows import table_of


def run(train_seed: int | None, *learned: float, optimistic: float = 30.0) -> dict[str, Any]:
    table = table_of({"optimistic": [10.0, 20.0, optimistic], "learned": learned})
    made_with = None if train_seed is None else {"learned": {"train.seed": train_seed}}
    return summarise(table, 0, made_with=made_with, resamples=50)


def test_rows_by_seed_then_mean_spread_and_range() -> None:
    """Ratios 36/60, 48/60 and 54/60: mean 0.767, standard deviation of three runs 0.153."""
    runs = {"a": run(2, 9.0, 18.0, 27.0), "b": run(0, 6.0, 12.0, 18.0), "c": run(11, 8.0, 16.0, 24.0)}
    lines = [line.split() for line in training_spread(runs).splitlines()]
    assert [line[:2] for line in lines if line[0].isdigit()] == [["0", "0.600"], ["2", "0.900"], ["11", "0.800"]]
    assert next(line for line in lines if line[0] == "mean")[:4] == ["mean", "0.767", "-", "0.767"]
    assert next(line for line in lines if line[0] == "std.")[2] == "0.153"
    assert [line[1] for line in lines if line[0] in ("least", "most")] == ["0.600", "0.900"]


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (run(0, 8.0, 16.0, 24.0), "a and b: both have train.seed = 0"),
        (run(None, 8.0, 16.0, 24.0), "b: does not say the train.seed"),
        (run(1, 8.0, 16.0, 24.0, optimistic=31.0), r"b: cost of the baseline \[m\] = 61.0, but a has 60.0"),
        (run(1, 8.0, 16.0, 24.0) | {"seed": 5}, "b: seed = 5, but a has 0: only train.seed may differ"),
    ],
)
def test_runs_that_differ_by_more_are_refused(other: dict[str, Any], message: str) -> None:
    with pytest.raises(TableError, match=message):
        training_spread({"a": run(0, 6.0, 12.0, 18.0), "b": other})


def test_one_run_has_no_spread() -> None:
    with pytest.raises(TableError, match="at least two runs"):
        training_spread({"a": run(0, 6.0, 12.0, 18.0)})
