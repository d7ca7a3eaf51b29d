"""Every planner keeps the contract. What it answers the loop checks by itself, see ``test_liars``."""

from collections.abc import Callable

import numpy as np
import pytest

from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.protocols import Planner
from pipeline.planning.seen import Seen
from pipeline.simulation.trial import Ending, Robot, run_trial
from pipeline.simulation.world import World, make_world
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner
from tests.systems.contestants import NAMES, contestant, ground_of
from tests.systems.networks import untrained
from tests.worlds import DEAD_END, TWO_ROOMS, draw, small_lidar

PLANNERS: dict[str, Callable[[World], Planner]] = {
    "optimistic": lambda world: OptimisticPlanner(),
    "perfect": lambda world: SubgoalPlanner(estimator=PerfectEstimator(world)),
    "learned, subgoal frame": lambda world: SubgoalPlanner(estimator=untrained("subgoal")),
    "learned, robot frame": lambda world: SubgoalPlanner(estimator=untrained("robot")),
    "learned, map": lambda world: SubgoalPlanner(estimator=untrained("map")),
}


class Checked:
    """Passes every question on and checks that it was left alone."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner

    def plan(self, seen: Seen) -> np.ndarray | None:
        known, status = seen.map.known.copy(), seen.map.status.copy()
        path = self._planner.plan(seen)
        assert np.array_equal(known, seen.map.known) and np.array_equal(status, seen.map.status), "wrote into the map"
        return path


def check_planner(make: Callable[[World], Planner], lines: tuple[str, ...]) -> None:
    drawn = draw(*lines)
    world = make_world("contract", drawn.grid, 0.0)
    runs = [
        run_trial(world, drawn.start, drawn.goal, Checked(make(world)), robot=Robot(small_lidar(3.0), step_m=1.0),
                  rng=np.random.default_rng(0), max_steps=500)
        for _ in range(2)
    ]  # fmt: skip
    assert runs[0].ending is Ending.REACHED, f"ended: {runs[0].ending}"
    assert np.array_equal(runs[0].path, runs[1].path), "the same trial twice took two ways"


@pytest.mark.parametrize("lines", [TWO_ROOMS, DEAD_END])
@pytest.mark.parametrize("name", sorted(PLANNERS))
def test_planner_keeps_the_contract(name: str, lines: tuple[str, ...]) -> None:
    check_planner(PLANNERS[name], lines)


@pytest.mark.parametrize("lines", [TWO_ROOMS, DEAD_END])
@pytest.mark.parametrize("name", NAMES)
def test_each_competitor_drives_alike_twice(name: str, lines: tuple[str, ...]) -> None:
    entrant, place = contestant(name), ground_of(draw(*lines))
    found = [entrant.drive(*place, np.random.default_rng(0)) for _ in range(2)]
    assert found[0].ending == "reached"
    assert np.array_equal(found[0].replay.path, found[1].replay.path)
    assert found[0].side == found[1].side


class _Scribbler(OptimisticPlanner):
    def plan(self, seen: Seen) -> np.ndarray | None:
        path = super().plan(seen)
        seen.map.known[0, 0] = 2 - seen.map.known[0, 0]
        return path


def test_the_checker_catches_a_planner_that_writes_into_the_map() -> None:
    with pytest.raises(AssertionError, match="wrote into the map"):
        check_planner(lambda world: _Scribbler(), TWO_ROOMS)
