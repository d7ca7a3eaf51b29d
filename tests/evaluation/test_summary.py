import json

import numpy as np
import pytest

from pipeline.evaluation.cost_table import format_cost_table
from pipeline.evaluation.summary import flat_metrics, summarise, summarise_estimates
from pipeline.evaluation.trials import EstimateRow, empty_estimates, estimates_table, trial_rows, trials_table
from tests.evaluation.rows import table_of, trial

COSTS = {
    "optimistic": [10.0, 20.0, 30.0, 40.0],
    "learned": [5.0, 20.0, 31.5, 48.0],
    "perfect": [5.0, 15.0, 25.0, 35.0],
    "known_map": [4.0, 10.0, 20.0, 30.0],
}


def test_the_numbers_of_each_planner() -> None:
    learned = summarise(table_of(COSTS), None, 1, resamples=200)["planners"]["learned"]
    assert learned["total_ratio"] == pytest.approx(1.045)
    assert (learned["total_cost_m"], learned["baseline_cost_m"]) == pytest.approx((104.5, 100.0))
    assert learned["total_ratio_interval"][0] < 1.045 < learned["total_ratio_interval"][1]
    assert (learned["pairs"], learned["slope_inliers"], learned["lost_share"]) == (4, 4, 0.5)
    assert learned["ms_per_step"] == pytest.approx(50.0)
    assert learned["endings"] == {"reached": 4, "unreachable": 0, "cut_off": 0}


def test_bounds_are_marked_and_the_baseline_is_one() -> None:
    planners = summarise(table_of(COSTS), None, 1, resamples=200)["planners"]
    assert {name: planner["bound"] for name, planner in planners.items()} == {
        "optimistic": False, "learned": False, "perfect": True, "known_map": True,
    }  # fmt: skip
    assert planners["optimistic"]["total_ratio"] == planners["optimistic"]["slope"] == 1.0
    assert planners["optimistic"]["total_ratio_interval"] == pytest.approx([1.0, 1.0])


def test_another_planner_moves_no_number() -> None:
    few = summarise(table_of({key: COSTS[key] for key in ("optimistic", "learned")}), None, 1, resamples=200)
    assert summarise(table_of(COSTS), None, 1, resamples=200)["planners"]["learned"] == few["planners"]["learned"]


def test_a_summary_is_plain_json_and_repeats() -> None:
    text = [json.dumps(summarise(table_of(COSTS), None, 3, resamples=100), allow_nan=False) for _ in range(2)]
    assert text[0] == text[1]


def test_buildings_are_told_apart() -> None:
    buildings = summarise(table_of(COSTS), None, 1, resamples=100)["buildings"]
    assert list(buildings) == ["plan0", "plan1", "plan2", "plan3"]
    assert buildings["plan0"] == {
        "trials": 1,
        "planners": {
            "learned": {"pairs": 1, "total_ratio": 0.5, "lost_share": 0.0},
            "perfect": {"pairs": 1, "total_ratio": 0.5, "lost_share": 0.0},
            "known_map": {"pairs": 1, "total_ratio": 0.4, "lost_share": 0.0},
        },
    }


def test_without_a_pair_there_is_no_number_and_the_table_says_why() -> None:
    rows = [trial("a/0", "optimistic", 4.0), trial("a/0", "learned", 9.0, ending="cut_off")]
    summary = summarise(trials_table(rows), empty_estimates(), 1, resamples=100)
    learned = summary["planners"]["learned"]
    assert (learned["pairs"], learned["total_ratio"], learned["slope_interval"]) == (0, None, None)
    text = format_cost_table(summary)
    assert "0/1" in text
    assert "learned: 1 of 1 trials give no ratio (1 x learned ended cut_off)." in " ".join(text.split())
    assert "learned/total_ratio" not in flat_metrics(summary)
    json.dumps(summary, allow_nan=False)


def test_an_empty_table_has_a_summary_too() -> None:
    summary = summarise(trials_table([]), None, 1)
    assert (summary["trials"], summary["planners"], summary["estimates"]) == (0, {}, None)
    format_cost_table(summary)


def test_costs_are_compared_only_where_known() -> None:
    rows = [
        EstimateRow("a/0", 0, 0.9, 3.0, 1.0, True, 2.0, None, 4.0),
        EstimateRow("a/0", 0, 0.2, 9.0, 6.0, False, None, 8.0, 4.0),
        EstimateRow("a/0", 1, 0.2, 9.0, float("nan"), False, None, None, 4.0),
    ]
    found = summarise_estimates(estimates_table(rows))
    assert found is not None
    assert (found["count"], found["positives"], found["auc"]) == (3, 1, 1.0)
    assert (found["delta_success"]["count"], found["delta_success"]["bias"]) == (1, 1.0)
    assert (found["exploration"]["count"], found["exploration"]["mae"]) == (1, 2.0)
    json.dumps(found, allow_nan=False)


def test_a_prediction_that_is_no_number_does_not_break_the_summary() -> None:
    rows = [EstimateRow("a/0", 0, 0.9, float("inf"), 1.0, True, 2.0, None, 4.0)]
    found = summarise_estimates(estimates_table(rows))
    assert found is not None
    assert found["delta_success"]["bias"] is None
    json.dumps(found, allow_nan=False)


def test_flat_metrics_are_numbers() -> None:
    metrics = flat_metrics(summarise(table_of(COSTS), None, 1, resamples=100))
    assert metrics["learned/total_ratio"] == pytest.approx(1.045)
    assert metrics["learned/total_ratio_low"] < metrics["learned/total_ratio_high"]
    assert "known_map/ms_per_step" in metrics
    assert all(isinstance(value, float) and np.isfinite(value) for value in metrics.values())


TABLE = """\
planner            reached  cost [m]  ratio  95 % interval  slope  median   mean    lost  lost > 10 %  ms/step
--------------------------------------------------------------------------------------------------------------
optimistic             4/4       100  1.000  1.000 - 1.000  1.000   1.000  1.000   0.0 %        0.0 %    50.00
learned                4/4       104  1.045  0.760 - 1.170  1.105   1.025  0.938  50.0 %       25.0 %    50.00
-- bounds: they use the true map -----------------------------------------------------------------------------
perfect estimates      4/4        80  0.800  0.650 - 0.863  0.833   0.792  0.740   0.0 %        0.0 %    50.00
known map              4/4        64  0.640  0.472 - 0.727  0.680   0.583  0.579   0.0 %        0.0 %        -
--------------------------------------------------------------------------------------------------------------
"""


def test_the_cost_table_is_aligned_with_the_bounds_beneath_a_rule() -> None:
    rows = [
        row._replace(seconds=0.0, steps=0) if row.planner == "known_map" else row for row in trial_rows(table_of(COSTS))
    ]
    lines = format_cost_table(summarise(trials_table(rows), None, 1)).splitlines()
    wanted = TABLE.splitlines()
    assert [line[:44] for line in lines[:8]] == [line[:44] for line in wanted]
    assert [line[58:] for line in lines[:8]] == [line[58:] for line in wanted]
    assert max(len(line) for line in lines) == len(wanted[1])
