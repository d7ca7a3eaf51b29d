"""A small world in which a planner meets all that a large one has: for a first drive that nobody times."""

import numpy as np

from pipeline.grids.occupancy import FREE, OCCUPIED, Cell, OccupancyGrid, Point
from pipeline.simulation.world import World, make_world

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


def practice_world(resolution: float) -> tuple[World, Cell, Cell]:
    """Return the world on cells of ``resolution`` [m], a start and a goal, for a robot that is a point."""
    cells = np.array([[OCCUPIED if letter == "#" else FREE for letter in line] for line in reversed(_PLAN)], np.uint8)
    return make_world("practice", OccupancyGrid(cells, resolution, Point(0.0, 0.0)), 0.0), _START, _GOAL
