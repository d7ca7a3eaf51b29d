"""Planners and estimators that lie are refused by the loop, each with its own sentence, and nothing is recorded."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from pipeline.errors import PlannerError
from pipeline.grids.partial_map import UNSEEN
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.protocols import Estimates
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings
from pipeline.simulation.trial import Robot, run_trial
from pipeline.simulation.world import make_world
from pipeline.systems.subgoals.planner import SubgoalPlanner
from tests.worlds import draw, small_lidar

# The way from S leads down through the gap in the wall and up again to G; T-shaped, so that no mirror image fits.
WALLED = (
    "################",
    "#......#.......#",
    "#.S....#...G...#",
    "#......#.......#",
    "#......#..###..#",
    "#..............#",
    "#......#.......#",
    "################",
)
Lie = Callable[[np.ndarray, Seen], object]


def _straight_to_the_goal(path: np.ndarray, seen: Seen) -> np.ndarray:
    cols = seen.map.status.shape[1]
    return np.arange(path[0], seen.goal.row * cols + seen.goal.col + 1, dtype=np.int32)  # S and G share a row


def _into_the_unseen(path: np.ndarray, seen: Seen) -> np.ndarray:
    """Keep the rows and columns right, but let the first move lead where nothing was seen."""
    known = seen.map.status
    known.ravel()[path[1]] = UNSEEN  # a planner that spoils the map, so that the robot never dares to move
    return path


PATHS: dict[str, tuple[Lie, str]] = {
    "waypoints": (lambda path, seen: path[[0, len(path) // 2, -1]], "the path jumps from row 5, col 2 to row"),
    "goal alone": (lambda path, seen: path[[0, -1]], "the path jumps from row 5, col 2 to row 5, col 11 at place 1"),
    "through walls": (_straight_to_the_goal, "runs through a seen obstacle.* at row 5, col 7, place 5"),
    "never moves": (lambda path, seen: path[:1], "the path never moves the robot, which is not at the goal"),
    "stays in place": (lambda path, seen: path[[0, 0]], "jumps from row 5, col 2 to row 5, col 2 at place 1"),
    "spoils the map": (_into_the_unseen, "the path never moves the robot"),
    "no cells": (lambda path, seen: path[:0], "the path is empty"),
    "floats": (lambda path, seen: path.astype(float), r"the path is float64 \(\d+,\), expected flat cells as int32"),
    "other whole numbers": (lambda path, seen: path.astype(np.int64), r"the path is int64 \(\d+,\)"),
    "rows and columns": (
        lambda path, seen: np.stack(np.divmod(path, seen.map.status.shape[1]), axis=1),
        r"the path is int32 \(\d+, 2\)",
    ),
    "a list": (lambda path, seen: path.tolist(), "the path is list"),
    "words": (lambda path, seen: "to the goal", "the path is str"),
    "starts at the next cell": (lambda path, seen: path[1:], "the path starts at row .*, expected the robot's cell at"),
    "starts at the goal": (lambda path, seen: path[::-1], "the path starts at row 5, col 11, expected the robot's"),
    "out of the grid": (lambda path, seen: np.append(path, np.int32(10**6)), "has the flat cell 1000000 at place"),
    "before the grid": (lambda path, seen: np.append(path[:1], np.int32(-5)), "has the flat cell -5 at place 1"),
    "gives up": (lambda path, seen: None, "the goal was given up, although free or unseen space leads there"),
}


class Liar(OptimisticPlanner):
    """Plans as the optimist does, then tells something else."""

    def __init__(self, lie: Lie) -> None:
        super().__init__()
        self._lie = lie

    def plan(self, seen: Seen) -> np.ndarray | None:
        path = super().plan(seen)
        assert path is not None
        return self._lie(path, seen)  # type: ignore[return-value]


def drive(planner: OptimisticPlanner | SubgoalPlanner, reach: float = 5.2) -> None:
    drawn = draw(*WALLED)
    world = make_world("walled", drawn.grid, 0.0)
    run_trial(world, drawn.start, drawn.goal, planner, robot=Robot(small_lidar(reach), step_m=1.0),
              rng=np.random.default_rng(0))  # fmt: skip


@pytest.mark.parametrize("name", PATHS)
def test_a_path_that_lies_is_refused(name: str) -> None:
    lie, message = PATHS[name]
    with pytest.raises(PlannerError, match=rf"^Liar on walled, scan \d+: .*{message}.*mend the planner\.$"):
        drive(Liar(lie))


def test_a_corner_is_not_cut() -> None:
    def cut(path: np.ndarray, seen: Seen) -> np.ndarray:
        rows, cols = np.array([5, 4, 3, 3, 3, 2]), np.array([2, 3, 4, 5, 6, 7])  # the wall ends at row 3, column 7
        return np.array(rows * seen.map.status.shape[1] + cols, dtype=np.int32)

    with pytest.raises(PlannerError, match="cuts the corner of a seen obstacle from row 3, col 6 to row 2, col 7 at"):
        drive(Liar(cut), reach=30.0)


class Oracle:
    """Says what it was told to say of each subgoal."""

    lasting = True

    def __init__(self, said: Callable[[int], tuple[object, ...]]) -> None:
        self._said = said

    def estimate(self, seen: Seen, around: Surroundings, subgoals: Sequence[Subgoal]) -> Estimates:
        return Estimates(*self._said(len(subgoals)))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ((np.nan, 0.0, 0.0), "P_S = nan"),
        ((1.01, 0.0, 0.0), r"P_S = 1\.01"),
        ((-1e-9, 0.0, 0.0), "P_S = -1e-09"),
        ((np.inf, 0.0, 0.0), "P_S = inf"),
        ((0.5, np.nan, 0.0), "delta success nan m"),
        ((0.5, -2.0, 0.0), r"delta success -2\.0 m"),
        ((0.5, np.inf, 0.0), "delta success inf m"),
        ((0.5, 0.0, np.nan), "exploration nan m"),
        ((0.5, 0.0, -0.1), r"exploration -0\.1 m"),
        ((0.5, 0.0, np.inf), "exploration inf m"),
    ],
)
def test_an_estimate_that_is_none_is_refused(values: tuple[float, ...], message: str) -> None:
    estimator = Oracle(lambda count: tuple(np.full(count, value) for value in values))
    with pytest.raises(
        PlannerError, match=rf"^Oracle, scan 1: of subgoal 0 it says .*{message}.*mend the estimator\.$"
    ):
        drive(SubgoalPlanner(estimator=estimator))


@pytest.mark.parametrize(
    "said",
    [
        lambda count: (np.zeros(count + 1),) * 3,
        lambda count: (np.zeros(count), np.zeros(count - 1), np.zeros(count)),
        lambda count: (np.zeros((count, 1)),) * 3,
        lambda count: (0.5, 0.0, 0.0),
    ],
)
def test_estimates_of_other_subgoals_are_refused(said: Callable[[int], tuple[object, ...]]) -> None:
    with pytest.raises(
        PlannerError, match=r"^Oracle, scan 1: estimates of shapes .* for \d+ subgoals, expected three of"
    ):
        drive(SubgoalPlanner(estimator=Oracle(said)))
