"""Whatever moves the robot and however little of the world it sees at once: a goal in reach is reached, others are not.

HINTERLAND_WORLDS says how many random worlds; the long run takes 2000.
"""

import os

import numpy as np
import pytest

from pipeline.grids.occupancy import FREE, Cell, OccupancyGrid, Point
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.protocols import Course, Planner
from pipeline.planning.seen import Seen
from pipeline.simulation.car import Car
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.motion import Walk
from pipeline.simulation.protocols import Motion
from pipeline.simulation.trial import Ending, Robot, run_trial
from pipeline.simulation.world import World, known_map_distance, make_world
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner
from tests.worlds import scattered

WORLDS = int(os.environ.get("HINTERLAND_WORLDS", "60"))


class VouchedCar(Car):
    """Not known to the loop, which therefore checks each of its moves against the truth."""


class VouchedWalk(Walk):
    """The same."""


class Attentive:
    """Plans as another does, and is told of every observation."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self.steps: list[int] = []
        self.decided: list[int] = []

    def notice(self, seen: Seen) -> None:
        self.steps.append(seen.step)
        assert seen.observation is not None and seen.observation.pose == seen.pose

    def plan(self, seen: Seen) -> np.ndarray | Course | None:
        self.decided.append(seen.step)
        return self._planner.plan(seen)


def random_world(rng: np.random.Generator) -> tuple[World, Cell, Cell]:
    """Walls scattered or in corridors, a start where the robot can stand, a goal anywhere free."""
    rows, cols = (int(side) for side in rng.integers(6, 26, 2))
    cells = scattered(rng, rows, cols, float(rng.uniform(0.0, 0.45)))
    if rng.random() < 0.4:
        cells[:, :: int(rng.integers(3, 7))] = 1
        for row in rng.integers(1, rows - 1, 3):
            cells[row : row + int(rng.integers(1, 3)), 1:-1] = FREE
        cells[-1] = 1
    world = make_world("random", OccupancyGrid(cells, 0.5, Point(0.0, 0.0)), float(rng.choice([0.0, 0.5, 0.75])))
    stands = np.argwhere(world.blocked == 0)
    if not len(stands):
        return random_world(rng)
    start, goal = (Cell(*(int(place) for place in stands[rng.integers(len(stands))])) for _ in range(2))
    return world, start, goal


def motion_of(kind: str, rng: np.random.Generator) -> Motion:
    if kind == "walk":
        return VouchedWalk(float(rng.choice([0.0, 2.0])))
    return VouchedCar(float(rng.choice([0.1, 0.4, 1.0, 3.0])), int(rng.choice([3, 17, 65])))


@pytest.mark.parametrize("view", [360.0, 90.0, 40.0])
@pytest.mark.parametrize("kind", ["walk", "car"])
def test_a_goal_in_reach_is_reached(kind: str, view: float) -> None:
    reached = 0
    for seed in range(WORLDS):
        rng = np.random.default_rng([seed, int(view), len(kind)])
        world, start, goal = random_world(rng)
        lidar = make_lidar(beams=256, input_beams=256, max_range_m=float(rng.choice([1.5, 4.0, 20.0])),
                           field_of_view_deg=view)  # fmt: skip
        robot = Robot(lidar, float(rng.choice([0.1, 0.9, 3.0])), motion=motion_of(kind, rng))
        planner: Planner = OptimisticPlanner() if seed % 2 else SubgoalPlanner(estimator=PerfectEstimator(world))
        attentive = Attentive(planner)
        episode = run_trial(world, start, goal, attentive, robot=robot, rng=rng)
        shortest = known_map_distance(world, start, goal)
        expected = Ending.REACHED if np.isfinite(shortest) else Ending.UNREACHABLE
        assert episode.ending is expected, (seed, episode.ending)
        assert attentive.steps == list(range(episode.steps))
        assert len(attentive.decided) == episode.decisions
        if expected is Ending.REACHED:
            reached += 1
            assert episode.travelled >= shortest * robot.motion.undercut - 1e-6
            assert divmod(int(episode.path[-1]), world.blocked.shape[1]) == goal
        assert not world.blocked.ravel()[episode.path].any()
    assert reached > 0.4 * WORLDS, "hardly any goal was in reach"
