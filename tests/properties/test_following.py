"""What a trial keeps up to date equals what is worked out anew at each step: in random worlds, and on real floors.

HINTERLAND_WORLDS=5000 tries as many random worlds instead of a few hundred.
"""

import os

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.grids.occupancy import FREE, Cell, OccupancyGrid, Point
from pipeline.grids.rasterize import rasterize
from pipeline.grids.sampling import sample_ends
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.protocols import Planner
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import Ending, Robot, run_trial
from pipeline.simulation.world import World, make_world
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner
from tests.floorplans.real_data import plan_files, read_entry
from tests.properties.following import Follower
from tests.properties.test_completeness import Liar, clear_start
from tests.worlds import Drawing, scattered, small_lidar

WORLDS = int(os.environ.get("HINTERLAND_WORLDS", "300"))


def planner_of(name: str, world: World, seed: int) -> Planner:
    if name == "optimistic":
        return OptimisticPlanner()
    return SubgoalPlanner(estimator=Liar(seed) if name == "liar" else PerfectEstimator(world))


def wide_world(rng: np.random.Generator) -> Drawing:
    """Scattered walls, a start and a goal in opposite corners: a longer way than hypothesis would draw by itself."""
    rows, cols = rng.integers(14, 40, 2)
    cells = scattered(rng, rows, cols, rng.uniform(0.0, 0.35))
    start = Cell(int(rng.integers(1, 5)), int(rng.integers(1, 5)))
    goal = Cell(int(rows - 1 - rng.integers(1, 5)), int(cols - 1 - rng.integers(1, 5)))
    cells[start], cells[goal] = FREE, FREE
    return Drawing(OccupancyGrid(cells, 0.5, Point(-3.0, 2.0)), start, goal)


def test_in_random_worlds() -> None:
    compared = 0

    @settings(deadline=None, max_examples=WORLDS)
    @given(
        seed=st.integers(0, 2**31),
        name=st.sampled_from(["optimistic", "liar", "perfect"]),
        radius=st.sampled_from([0.0, 0.5, 0.8]),
        reach=st.sampled_from([1.3, 2.5, 6.0, 30.0]),
        merge=st.sampled_from([0.0, 1.0, 3.0]),
    )
    def drive(seed: int, name: str, radius: float, reach: float, merge: float) -> None:
        nonlocal compared
        drawn = wide_world(np.random.default_rng(seed))
        world = clear_start(drawn, radius)
        if world is None:
            return
        follower = Follower(world, planner_of(name, world, seed))
        run_trial(
            world,
            drawn.start,
            drawn.goal,
            follower,
            robot=Robot(small_lidar(reach), step_m=0.9, merge_m=merge),
            rng=np.random.default_rng(0),
        )
        compared += follower.compared

    drive()
    assert compared > 3 * WORLDS, "hardly any world was driven"


@pytest.mark.parametrize("name", ["optimistic", "liar"])
def test_on_real_floors(name: str) -> None:
    with plan_files("mit_campus_grids") as files:
        plans = [plan for entry in files[:: len(files) // 4] for plan in read_entry(entry)]
    lidar = make_lidar(beams=256, input_beams=256, max_range_m=12.0)
    for plan in plans:
        grid = rasterize(plan, 0.3)
        (ends,) = sample_ends(grid, plan_id=plan.plan_id, count=1, min_distance=15.0, robot_radius=0.15, seed=0)
        world = make_world(plan.plan_id, grid, 0.15)
        follower = Follower(world, planner_of(name, world, 1))
        episode = run_trial(
            world,
            ends.start,
            ends.goal,
            follower,
            robot=Robot(lidar, step_m=0.9, merge_m=1.2),
            rng=np.random.default_rng(0),
            max_steps=150,
        )
        assert episode.ending is not Ending.UNREACHABLE
        assert follower.compared > 10
