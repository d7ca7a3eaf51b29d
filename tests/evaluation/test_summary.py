import json

import numpy as np
import pytest

from pipeline.evaluation.cost_table import format_cost_table
from pipeline.evaluation.summary import flat_metrics, summarise
from pipeline.evaluation.trials import trial_rows, trials_table
from tests.evaluation.rows import table_of, trial

COSTS = {
    "optimistic": [10.0, 20.0, 30.0, 40.0],
    "learned": [5.0, 20.0, 31.5, 48.0],
    "perfect": [5.0, 15.0, 25.0, 35.0],
    "known_map": [4.0, 10.0, 20.0, 30.0],
}


def test_the_numbers_of_each_planner() -> None:
    learned = summarise(table_of(COSTS), 1, resamples=200)["competitors"]["learned"]
    assert learned["total_ratio"] == pytest.approx(1.045)
    assert (learned["total_cost_m"], learned["baseline_cost_m"]) == pytest.approx((104.5, 100.0))
    assert learned["total_ratio_interval"][0] < 1.045 < learned["total_ratio_interval"][1]
    assert (learned["pairs"], learned["trimmed_slope_inliers"], learned["lost_share"]) == (4, 4, 0.5)
    assert learned["ms_per_step"] == pytest.approx(50.0)
    assert learned["endings"] == {"reached": 4, "covered": 0, "unreachable": 0, "cut_off": 0}
    assert learned["finished"] == 4


def test_bounds_are_marked_and_the_baseline_is_one() -> None:
    competitors = summarise(table_of(COSTS), 1, resamples=200)["competitors"]
    assert {name: found["bound"] for name, found in competitors.items()} == {
        "optimistic": False, "learned": False, "perfect": True, "known_map": True,
    }  # fmt: skip
    assert competitors["optimistic"]["total_ratio"] == competitors["optimistic"]["trimmed_slope"] == 1.0
    assert competitors["optimistic"]["total_ratio_interval"] == pytest.approx([1.0, 1.0])


def test_another_planner_moves_no_number() -> None:
    few = summarise(table_of({key: COSTS[key] for key in ("optimistic", "learned")}), 1, resamples=200)
    assert summarise(table_of(COSTS), 1, resamples=200)["competitors"]["learned"] == few["competitors"]["learned"]


def test_a_summary_is_plain_json_and_repeats() -> None:
    text = [json.dumps(summarise(table_of(COSTS), 3, resamples=100), allow_nan=False) for _ in range(2)]
    assert text[0] == text[1]


def test_buildings_are_told_apart() -> None:
    buildings = summarise(table_of(COSTS), 1, resamples=100)["buildings"]
    assert list(buildings) == ["plan0", "plan1", "plan2", "plan3"]
    assert buildings["plan0"] == {
        "trials": 1,
        "competitors": {
            "learned": {"pairs": 1, "total_ratio": 0.5, "lost_share": 0.0},
            "perfect": {"pairs": 1, "total_ratio": 0.5, "lost_share": 0.0},
            "known_map": {"pairs": 1, "total_ratio": 0.4, "lost_share": 0.0},
        },
    }


def test_without_a_pair_there_is_no_number_and_the_table_says_why() -> None:
    rows = [trial("a/0", "optimistic", 4.0), trial("a/0", "learned", 9.0, ending="cut_off")]
    summary = summarise(trials_table(rows), 1, resamples=100)
    learned = summary["competitors"]["learned"]
    assert (learned["pairs"], learned["total_ratio"], learned["trimmed_slope_interval"]) == (0, None, None)
    text = format_cost_table(summary)
    assert "0/1" in text
    assert "learned: 1 of 1 trials give no ratio (1 x learned ended cut_off)." in " ".join(text.split())
    assert "learned/total_ratio" not in flat_metrics(summary)
    json.dumps(summary, allow_nan=False)


def test_pairs_of_one_building_give_no_interval_over_buildings_and_the_table_says_why() -> None:
    costs = {"optimistic": (10.0, 20.0), "learned": (5.0, 18.0)}
    rows = [trial(f"hall/{i}", name, cost) for name, both in costs.items() for i, cost in enumerate(both)]
    summary = summarise(trials_table(rows), 1, resamples=100)
    learned = summary["competitors"]["learned"]
    assert learned["total_ratio_interval"] is None
    assert learned["total_ratio_interval_trials"] == pytest.approx([0.5, 0.9])
    assert (learned["pairs"], learned["pair_buildings"]) == (2, 1)
    text = " ".join(format_cost_table(summary).split())
    assert "learned: no interval over buildings, because all pairs lie in one building (hall)" in text
    assert "as if trials were independent: learned 0.500 - 0.900" in text
    metrics = flat_metrics(summary)
    assert "learned/total_ratio_low" not in metrics
    assert (metrics["learned/total_ratio_low_trials"], metrics["learned/total_ratio_high_trials"]) == (0.5, 0.9)


def test_the_interval_of_the_table_is_the_one_over_buildings() -> None:
    """Building a: 0.2 over two trials, b: 1.5; one drawn twice gives the ends, trial by trial the ends lie further."""
    costs = {"optimistic": (10.0, 10.0, 20.0), "learned": (1.0, 3.0, 30.0)}
    places = ("a/0", "a/1", "b/0")
    rows = [trial(at, name, cost) for name, listed in costs.items() for at, cost in zip(places, listed, strict=True)]
    summary = summarise(trials_table(rows), 1, resamples=2000)
    learned = summary["competitors"]["learned"]
    assert learned["total_ratio_interval"] == pytest.approx([0.2, 1.5])
    assert learned["total_ratio_interval_trials"] == pytest.approx([0.1, 1.5])
    text = " ".join(format_cost_table(summary).split())
    assert "0.200 - 1.500" in text.split("learned", 1)[1].split("trials (")[0]
    assert "over buildings (2 buildings, each drawn with all its trials)" in text
    assert flat_metrics(summary)["learned/total_ratio_low"] == pytest.approx(0.2)


def test_both_slopes_are_named_with_their_intercept() -> None:
    """Costs on 0.5 x + 3 m: the line with an intercept is that one, the one through the origin is steeper."""
    base = np.linspace(10.0, 60.0, 30)
    summary = summarise(
        table_of({"optimistic": base.tolist(), "learned": (0.5 * base + 3.0).tolist()}), 1, resamples=50
    )
    learned = summary["competitors"]["learned"]
    assert (learned["ransac_slope"], learned["ransac_intercept_m"]) == pytest.approx((0.5, 3.0))
    assert learned["ransac_inliers"] == 30
    assert 0.55 < learned["trimmed_slope"] < 0.65
    assert "0.500 x + 3.0 m" in format_cost_table(summary)
    assert "slope" not in learned


def test_remarks_stand_in_the_summary_and_beneath_the_table() -> None:
    summary = summarise(table_of(COSTS), 1, remarks=["the network was made with another sensor"], resamples=50)
    assert summary["remarks"] == ["the network was made with another sensor"]
    assert "the network was made with another sensor" in " ".join(format_cost_table(summary).split())


def test_an_empty_table_has_a_summary_too() -> None:
    summary = summarise(trials_table([]), 1)
    assert (summary["trials"], summary["competitors"]) == (0, {})
    format_cost_table(summary)


def test_measures_of_a_system_are_kept_by_competitor_and_their_numbers_are_metrics() -> None:
    measures = {"learned": {"p_success": {"auc": 0.9, "bins": [1, 2], "spread": float("nan")}, "count": 3}}
    summary = summarise(table_of(COSTS), 1, measures=measures, resamples=50)
    assert summary["competitors"]["learned"]["measures"]["p_success"] == {"auc": 0.9, "bins": [1, 2], "spread": None}
    assert summary["competitors"]["perfect"]["measures"] == {}
    metrics = flat_metrics(summary)
    assert (metrics["learned/p_success.auc"], metrics["learned/count"]) == (0.9, 3.0)
    assert "learned/p_success.bins" not in metrics


def test_flat_metrics_are_numbers() -> None:
    metrics = flat_metrics(summarise(table_of(COSTS), 1, resamples=100))
    assert metrics["learned/total_ratio"] == pytest.approx(1.045)
    assert metrics["learned/total_ratio_low"] < metrics["learned/total_ratio_high"]
    assert "known_map/ms_per_step" in metrics
    assert all(isinstance(value, float) and np.isfinite(value) for value in metrics.values())


# All trials lie within 20 m of the RANSAC line, which is then one of total least squares.
# ruff: noqa: E501 - the table is as wide as it is printed
TABLE = """\
competitor         finished  cost [m]  ratio  95 % interval  trimmed      RANSAC line  median   mean    lost  lost > 10 %
-------------------------------------------------------------------------------------------------------------------------
optimistic              4/4       100  1.000  1.000 - 1.000    1.000  1.000 x + 0.0 m   1.000  1.000   0.0 %        0.0 %
learned                 4/4       104  1.045  0.760 - 1.170    1.105  1.409 x - 9.1 m   1.025  0.938  50.0 %       25.0 %
-- bounds: they use the true map ----------------------------------------------------------------------------------------
perfect estimates       4/4        80  0.800  0.650 - 0.863    0.833  1.000 x - 5.0 m   0.792  0.740   0.0 %        0.0 %
known map               4/4        64  0.640  0.472 - 0.727    0.680  0.885 x - 6.1 m   0.583  0.579   0.0 %        0.0 %
-------------------------------------------------------------------------------------------------------------------------
"""
TIMES = ["ms/step", "---------", "50.00", "50.00", "---------", "50.00", "-", "---------"]


def test_the_cost_table_is_aligned_with_the_bounds_beneath_a_rule() -> None:
    rows = [
        row._replace(seconds=0.0, steps=0) if row.competitor == "known_map" else row
        for row in trial_rows(table_of(COSTS))
    ]
    lines = format_cost_table(summarise(trials_table(rows), 1)).splitlines()
    wanted = TABLE.splitlines()
    assert [line[:45] for line in lines[:8]] == [line[:45] for line in wanted]
    assert [line[59:121] for line in lines[:8]] == [line[59:] for line in wanted]
    assert [line[121:].strip() for line in lines[:8]] == TIMES
    assert max(len(line) for line in lines) == len(wanted[1]) + 9
