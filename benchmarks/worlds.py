"""The worlds that the benchmarks run on, drawn anew at each run, and how robots drive through them."""

import os
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.floorplans.generators import GENERATORS
from pipeline.floorplans.generators.clutter import ClutterShape, add_clutter
from pipeline.floorplans.generators.guided_maze import MazeShape, draw_guided_maze
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers import PLAN, ReadOptions, classify, read_plans
from pipeline.floorplans.sources import open_source
from pipeline.grids.occupancy import OCCUPIED, Cell, OccupancyGrid, Point, cell_at
from pipeline.grids.rasterize import rasterize
from pipeline.grids.sampling import sample_ends
from pipeline.randomness import stream
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import Robot
from pipeline.simulation.world import World, make_world

DATA = Path(os.environ.get("HINTERLAND_DATA", Path(__file__).parents[2] / "shared" / "data"))
MIT = DATA / "mit_campus_grids" / "dev"


class Trial(NamedTuple):
    """A world with a start and a goal."""

    world: World
    start: Cell
    goal: Cell


class Setting(NamedTuple):
    """How robots drive in one environment.

    draw: returns the trial of a number. robot: see ``run_trial``. max_subgoals, optimism: see
    ``SubgoalPlanner``. map_views: what the network reads.
    """

    about: str
    draw: Callable[[int], Trial]
    robot: Robot
    max_subgoals: int = 12
    optimism: float = 0.0
    map_views: bool = False


def draw_maze(index: int, shape: MazeShape | None = None) -> Trial:
    """Return the guided maze of this number: 6 x 8 nodes, 144 x 188 cells of 0.3 m, unless ``shape`` says otherwise."""
    name = f"bench-{index}"
    plan = draw_guided_maze(shape or MazeShape(), stream(0, "benchmarks", name), plan_id=name, split="test")
    grid = rasterize(plan, 0.3)
    assert plan.endpoints is not None
    start, goal = (cell_at(grid, Point(*end)) for end in plan.endpoints)
    return Trial(make_world(name, grid, 0.3), start, goal)


def draw_generated(source: str, index: int, *, clutter_per_m2: float = 0.0) -> Trial:
    """Return a generated floor of this number on cells of 0.3 m, with two random ends at least 20 m apart."""
    name, generator = f"{source}-{index}", GENERATORS[source]
    plan: FloorPlan | GridPlan = generator.draw(
        generator.shape(), stream(0, "benchmarks", name), plan_id=name, split="test"
    )
    if clutter_per_m2:
        plan = add_clutter(plan, ClutterShape(per_m2=clutter_per_m2), stream(0, "clutter", name))
    return _between_random_ends(plan, 0.3, 0.15, index)


def draw_floor(index: int, resolution: float, radius: float) -> Trial:
    """Return a trial on one of the real MIT floors, on cells of ``resolution`` [m], for a robot of ``radius`` [m]."""
    plans = _floors()
    return _between_random_ends(plans[index % len(plans)], resolution, radius, index)


def _between_random_ends(plan: FloorPlan | GridPlan, resolution: float, radius: float, seed: int) -> Trial:
    grid = rasterize(plan, resolution)
    (ends,) = sample_ends(grid, plan_id=plan.plan_id, count=1, min_distance=20.0, robot_radius=radius, seed=seed)
    return Trial(make_world(plan.plan_id, grid, radius), ends.start, ends.goal)


@lru_cache(maxsize=1)
def _floors() -> list[GridPlan | FloorPlan]:
    """One furniture variant of each floor, every third of those large enough for a trial."""
    found: dict[tuple[str, str], GridPlan | FloorPlan] = {}
    with open_source(MIT) as files:
        for entry in classify(files):
            if entry.role == PLAN and entry.reader is not None:
                plan = next(iter(read_plans(entry.file, entry.reader, ReadOptions())))
                if isinstance(plan, GridPlan) and min(plan.cells.shape) > 250:
                    found.setdefault((plan.building, plan.floor), plan)
    return list(found.values())[::3]


def rooms(rows: int, cols: int, *, size: int = 25, seed: int = 0) -> World:
    """Return a world of square rooms, each with a door of three cells in two of its walls."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((rows, cols), dtype=np.uint8)
    cells[::size], cells[:, ::size] = OCCUPIED, OCCUPIED
    for row in range(0, rows, size):
        for col in range(0, cols, size):
            along, up = rng.integers(3, size - 5, 2)
            cells[row : row + 1, col + along : col + along + 3] = 0
            cells[row + up : row + up + 3, col : col + 1] = 0
    return _closed(cells, f"rooms {rows} x {cols}")


def hall(rows: int, cols: int) -> World:
    """Return an empty world."""
    return _closed(np.zeros((rows, cols), dtype=np.uint8), f"hall {rows} x {cols}")


def _closed(cells: NDArray[np.uint8], name: str) -> World:
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    return make_world(name, OccupancyGrid(cells, 0.3, Point(0.0, 0.0)), 0.0)


def across(world: World) -> Trial:
    """Return the trial from the first free cell of ``world`` to the last."""
    free = np.argwhere(world.blocked == 0)
    return Trial(world, Cell(*map(int, free[0])), Cell(*map(int, free[-1])))


def _robot(reach: float, step_m: float = 0.54, merge_m: float = 0.0) -> Robot:
    return Robot(make_lidar(beams=1024, input_beams=256, max_range_m=reach), step_m, merge_m)


SETTINGS = {
    "maze": Setting("guided mazes, 144 x 188 cells of 0.3 m, lidar 18 m", draw_maze, _robot(18.0)),
    "office": Setting(
        "generated offices, cells of 0.3 m, lidar 12 m, network reads the map",
        lambda index: draw_generated("office", index),
        _robot(12.0, merge_m=1.2),
        map_views=True,
    ),
    "campus": Setting(
        "generated campus floors with furniture, cells of 0.3 m, lidar 12 m, network reads the map",
        lambda index: draw_generated("campus", index, clutter_per_m2=0.08),
        _robot(12.0, merge_m=1.2),
        max_subgoals=8,
        optimism=1.0,
        map_views=True,
    ),
    "floors": Setting(
        "real MIT floors, cells of 0.3 m, lidar 12 m, network reads the map",
        lambda index: draw_floor(index, 0.3, 0.15),
        _robot(12.0, merge_m=1.2),
        max_subgoals=8,
        optimism=1.0,
        map_views=True,
    ),
    "fine floors": Setting(
        "real MIT floors as the reference drives them: cells of 0.1 m, lidar of 120 cells, a radius of 2.5 cells",
        lambda index: draw_floor(index, 0.1, 0.25),
        _robot(12.0, step_m=0.18),
    ),
}
