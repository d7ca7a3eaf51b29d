"""The side table of estimates, and what it says of each competitor that estimates."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from pipeline.errors import TableError
from pipeline.evaluation.summary import plain
from pipeline.files import write_table
from pipeline.systems.subgoals.estimates import EstimateRow, estimates_table, measure_estimates

ROWS = [
    EstimateRow("a/0", "mine", 0, 0.9, 3.0, 1.0, True, 2.0, None, 4.0),
    EstimateRow("a/0", "mine", 0, 0.2, 9.0, 6.0, False, None, 8.0, 4.0),
    EstimateRow("a/0", "mine", 1, 0.2, 9.0, float("nan"), False, None, None, 4.0),
    EstimateRow("a/0", "other", 0, 0.1, 5.0, 1.0, True, 2.0, None, 4.0),
]


def test_what_is_unknown_stays_null(tmp_path: Path) -> None:
    write_table(tmp_path / "estimates.parquet", estimates_table(ROWS[:1]))
    assert pq.read_table(tmp_path / "estimates.parquet").to_pylist()[0]["true_exploration_m"] is None


def test_costs_are_compared_only_where_known_and_each_competitor_by_itself() -> None:
    found = measure_estimates({"estimates": estimates_table(ROWS)})
    assert list(found) == ["mine", "other"]
    quality = found["mine"]["p_success"]
    assert (quality["count"], quality["positives"], quality["auc"]) == (3, 1, 1.0)
    assert (found["mine"]["delta_success"]["count"], found["mine"]["delta_success"]["bias"]) == (1, 1.0)
    assert (found["mine"]["exploration"]["count"], found["mine"]["exploration"]["mae"]) == (1, 2.0)
    assert (found["other"]["p_success"]["count"], found["other"]["exploration"]) == (1, None)
    json.dumps(plain(found), allow_nan=False)


def test_nobody_who_estimates_gives_no_measure() -> None:
    assert measure_estimates({"estimates": estimates_table([])}) == {}


@pytest.mark.parametrize("chance", [-0.1, 1.1, float("nan")])
def test_a_probability_must_be_one(chance: float) -> None:
    with pytest.raises(TableError, match="expected 0 to 1"):
        estimates_table([ROWS[0]._replace(p_success=chance)])
