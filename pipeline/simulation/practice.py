"""A small world in which a planner meets all that a large one has: for a first drive that nobody times."""

from collections.abc import Sequence

import numpy as np

from pipeline.grids.occupancy import FREE, OCCUPIED, Cell, OccupancyGrid, Point
from pipeline.grids.store import GridRecord, Pair
from pipeline.simulation.ground import Ground
from pipeline.simulation.world import known_map_distance

# Rooms with doors, a loop around them, a pocket without a way on, a corner that hides a wall. "#" is wall.
_PLAN = (
    "####################################",
    "#..................................#",
    "#.######.########.######.#########.#",
    "#.#....#.#......#.#....#.#.......#.#",
    "#.#......#......#......#.........#.#",
    "#.#....#.....#..#.#....#.#.......#.#",
    "#.######.#...#..#.####.#.###.#####.#",
    "#........#####.........#...........#",
    "#.######.......#.#####.#.#########.#",
    "#.#....#.#######.#...#.#.#.......#.#",
    "#.#..............#.#.#...#.......#.#",
    "#.#....#.#######...#.#.#.......#.#.#",
    "#.######.#.....#.###.#.###########.#",
    "#..............#.......#...........#",
    "####################################",
)
_START, _GOAL = Cell(10, 4), Cell(4, 31)  # rows from below


def practice_ground(resolution: float, layers: Sequence[str] = ()) -> tuple[Ground, Pair]:
    """Return the world on cells of ``resolution`` [m], a start and a goal, for a robot that is a point.

    layers: names of layers that a sensor will read; they hold nothing.
    """
    cells = np.array([[OCCUPIED if letter == "#" else FREE for letter in line] for line in reversed(_PLAN)], np.uint8)
    identity = ("practice", "practice", "practice", "train")
    grid, blank = OccupancyGrid(cells, resolution, Point(0.0, 0.0)), np.full(cells.shape, -1, dtype=np.int32)
    ground = Ground(GridRecord(*identity, grid, 0.0, layers=dict.fromkeys(layers, blank)))
    return ground, Pair("practice/0", *identity, _START, _GOAL, known_map_distance(ground.world, _START, _GOAL))
