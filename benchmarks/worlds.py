"""The worlds that the benchmarks run on, drawn anew at each run."""

from typing import NamedTuple

import numpy as np

from pipeline.floorplans.generators.guided_maze import MazeShape, draw_guided_maze
from pipeline.grids.inflate import disk_offsets
from pipeline.grids.occupancy import Cell, Point, cell_at
from pipeline.grids.partial_map import PartialMap, unseen_map
from pipeline.grids.rasterize import rasterize
from pipeline.grids.beams import beam_tree
from pipeline.grids.raycast import scan
from pipeline.randomness import stream
from pipeline.simulation.world import World, make_world

RESOLUTION = 0.3  # [m/cell]
RADIUS = 0.3  # [m]


class Trial(NamedTuple):
    """A maze with a start and a goal."""

    world: World
    start: Cell
    goal: Cell


def draw_trial(index: int) -> Trial:
    """Return the guided maze of this number: 6 x 8 nodes, 144 x 188 cells of 0.3 m."""
    name = f"bench-{index}"
    plan = draw_guided_maze(MazeShape(), stream(0, "benchmarks", name), plan_id=name, split="test")
    grid = rasterize(plan, RESOLUTION)
    assert plan.endpoints is not None
    start, goal = (cell_at(grid, Point(*end)) for end in plan.endpoints)
    return Trial(make_world(name, grid, RADIUS), start, goal)


def explored(trial: Trial, max_range_m: float, *, scans: int = 40) -> PartialMap:
    """Return the map of a robot that scanned from ``scans`` places of the maze."""
    world = trial.world
    rows, cols = world.grid.cells.shape
    map_ = unseen_map(rows, cols)
    tree = beam_tree(1024, max_range_m / RESOLUTION, cols)
    free = np.argwhere(world.blocked == 0)
    for row, col in [trial.start, *free[np.random.default_rng(0).choice(len(free), scans)]]:
        scan(world.grid.cells, map_, row, col, tree, disk_offsets(RADIUS / RESOLUTION))
    return map_
