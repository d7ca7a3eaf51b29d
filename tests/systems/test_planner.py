"""The planner prices a frontier from the very point that its estimates are measured from."""

from typing import Any

import numpy as np
import pytest

from pipeline.planning.expected_cost import Ordering
from pipeline.simulation.world import known_map_distance, make_world
from pipeline.systems.subgoals import planner as module
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner
from tests.planning.test_subgoals import seen_of
from tests.worlds import draw

# Two frontiers: the column right of S, five cells high, and the gap in the wall to the left, four rows up.
KNOWN = (
    "##############",
    "#????????????#",
    "#??####??????#",
    "#??#...??????#",
    "#??....??????#",
    "#??#...??????#",
    "#??#...??????#",
    "#??#S..???G??#",
    "##############",
)
TRUTH = (
    "##############",
    "#............#",
    "#..####......#",
    "#..#.........#",
    "#.......#....#",
    "#..#....#....#",
    "#..#....#....#",
    "#..#S...#.G..#",
    "##############",
)


def test_both_ways_are_priced_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[Any, ...]] = []

    def order(*costs: Any, failure_penalty: float) -> Ordering:
        asked.append(costs)
        return Ordering([0, 1], 0.0)

    monkeypatch.setattr(module, "order_subgoals", order)
    drawn = draw(*KNOWN)
    world = make_world("drawn", draw(*TRUTH).grid, 0.0)
    path = SubgoalPlanner(estimator=PerfectEstimator(world)).plan(seen_of(drawn.grid.cells, drawn.start, drawn.goal))
    ((robot, pairs, p_success, success, exploration),) = asked
    diagonal = np.sqrt(2.0)
    # Right: two cells to the lowest cell of the frontier, then over the end of the wall: up, two across, down.
    # Left: three up and one across; beyond the gap one left, three up, five right, three diagonal and three down.
    assert robot == pytest.approx([2.0, 4.0])
    assert success == pytest.approx([2.0 * (diagonal + 3.0) + 2.0, 12.0 + 3.0 * diagonal])
    assert pairs == pytest.approx(np.array([[0.0, 2.0 * diagonal + 2.0], [2.0 * diagonal + 2.0, 0.0]]))
    assert p_success.tolist() == [1.0, 1.0] and exploration.tolist() == [0.0, 0.0]
    assert min(robot + success) >= known_map_distance(world, drawn.start, drawn.goal), "no way is shorter than the best"
    assert path is not None and divmod(int(path[-1]), 14) == (1, 6), "it walks to where it counted from"
