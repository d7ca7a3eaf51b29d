"""Curves of what has been seen: what they keep, and what is measured of them, counted by hand."""

import numpy as np
import pyarrow as pa
import pytest

from pipeline.simulation.world import make_world
from pipeline.systems.exploration.curves import Curve, curves_in, measure_growth
from pipeline.systems.exploration.growth import GrowthRow, Survey, growth_table
from tests.systems.exploration.explorations import explore, robot_of
from tests.worlds import DEAD_END, draw

ROWS = [
    *(GrowthRow("t", "near", d, 4 * s, s) for d, s in [(0.0, 0.25), (10.0, 0.5), (30.0, 1.0)]),
    *(GrowthRow("t", "far", d, 4 * s, s) for d, s in [(0.0, 0.25), (20.0, 0.75), (25.0, 0.8), (60.0, 1.0)]),
]


def test_a_curve_is_a_staircase() -> None:
    near, far = curves_in(growth_table(ROWS))
    assert near.at(np.array([0.0, 9.9, 10.0, 29.0, 99.0])).tolist() == [0.25, 0.25, 0.5, 0.5, 1.0]
    assert (near.distance_to(0.5), far.distance_to(0.8), far.distance_to(0.95)) == (10.0, 25.0, 60.0)
    assert near.mean_until(30.0) == pytest.approx((10 * 0.25 + 20 * 0.5) / 30)
    assert near.mean_until(40.0) == pytest.approx((10 * 0.25 + 20 * 0.5 + 10 * 1.0) / 40)
    assert Curve("t", "x", np.array([0.0]), np.array([0.4])).distance_to(0.5) is None


def test_measures_are_counted_against_the_baseline() -> None:
    trials = pa.table({"competitor": ["near", "far"], "role": ["baseline", "candidate"]})
    found = measure_growth({"growth": growth_table(ROWS), "trials": trials})
    assert found["far"]["distance_to"] == {"share_50": 20.0, "share_80": 25.0, "share_95": 60.0, "all": 60.0}
    assert found["near"]["share_at"] == {"10_m": 0.5, "25_m": 0.5}
    assert found["far"]["share_at"] == {"10_m": 0.25, "25_m": 0.8}
    assert found["far"]["area_under_curve"] == pytest.approx((20 * 0.25 + 5 * 0.75 + 5 * 0.8) / 30)


def test_a_survey_counts_what_can_be_reached_and_thins_its_curve() -> None:
    drawn = draw(*DEAD_END)
    episode, survey, world = explore("nearest", drawn, robot_of(2.0))
    rows = survey.rows("a/1", "nearest")
    assert survey.reachable == int((world.blocked == 0).sum()) == survey.seen
    assert 2 < len(rows) <= 202
    assert [row.share for row in rows] == sorted(row.share for row in rows) and rows[-1].share == 1.0
    assert rows[-1].travelled_m == pytest.approx(episode.travelled) and rows[-1].seen_m2 == survey.reachable
    (curve,) = curves_in(growth_table(rows))
    assert all(curve.distance_to(share) == survey.cost_m(share) for share in (0.5, 0.8, 0.95, 1.0))
    assert 0.0 < survey.cost_m(0.5) < survey.cost_m(0.95) <= episode.travelled


def test_a_room_without_a_door_is_not_in_reach() -> None:
    drawn = draw("########", "#S.#...#", "#..#...#", "########")
    assert Survey(make_world("two", drawn.grid, 0.0), drawn.start).reachable == 4
