"""Worlds a reader can see, and random ones. ``#`` wall, ``.`` free, ``?`` unknown, ``S`` start, ``G`` goal.

The first line of a drawing is the highest row, as on paper; grids keep row 0 at the lowest y.
"""

from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN, Cell, Cells, OccupancyGrid, Point
from pipeline.simulation.lidar import Lidar, make_lidar

_VALUES = {"#": OCCUPIED, ".": FREE, "?": UNKNOWN, "S": FREE, "G": FREE}

TWO_ROOMS = (
    "#############",
    "#.....#.....#",
    "#.S...#...G.#",
    "#.....#.....#",
    "#.....#.....#",
    "#...........#",
    "#############",
)
# The goal lies behind the wall to the east; the pocket that opens towards it is a dead end.
DEAD_END = (
    "####################",
    "#..................#",
    "#.################.#",
    "#.#..............#.#",
    "#.#.############.#.#",
    "#.#.#..........#.#.#",
    "#...#S.........#..G#",
    "#.#.#..........#.#.#",
    "#.#.#.##########.#.#",
    "#.#..............#.#",
    "#.################.#",
    "#..................#",
    "####################",
)
# Wide frontiers: what lies beyond them differs by metres between their middles and the cells where the way crosses.
WIDE_FRONTIERS = (
    "###############",
    "#.....#......G#",
    "#.........#...#",
    "#.........#...#",
    "#....##...#...#",
    "#......#..#####",
    "#......#......#",
    "#......#......#",
    "#.............#",
    "#S............#",
    "###############",
)
SEALED_GOAL = (
    "###########",
    "#.....#...#",
    "#.S...#.G.#",
    "#.....#...#",
    "###########",
)


class Drawing(NamedTuple):
    """A drawn world with the cells of S and G, where they are drawn."""

    grid: OccupancyGrid
    start: Cell
    goal: Cell


def cells_from(*lines: str) -> Cells:
    """Return the cells of a drawing, row 0 lowest."""
    return np.array([[_VALUES[letter] for letter in line] for line in reversed(lines)], dtype=np.uint8)


def draw(*lines: str, resolution: float = 1.0) -> Drawing:
    """Return the drawn world; S and G default to (0, 0)."""
    marks = {
        letter: Cell(row, col)
        for row, line in enumerate(reversed(lines))
        for col, letter in enumerate(line)
        if letter in "SG"
    }
    grid = OccupancyGrid(cells_from(*lines), resolution, Point(0.0, 0.0))
    return Drawing(grid, marks.get("S", Cell(0, 0)), marks.get("G", Cell(0, 0)))


def small_lidar(max_range_m: float = 30.0, noise_m: float = 0.0) -> Lidar:
    """Return a lidar that is quick to simulate."""
    return make_lidar(beams=256, input_beams=256, max_range_m=max_range_m, noise_m=noise_m)


def scattered(rng: np.random.Generator, rows: int, cols: int, share: float) -> NDArray[np.uint8]:
    """Return cells with a closed ring and walls scattered inside."""
    cells = (rng.random((rows, cols)) < share).astype(np.uint8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    return cells


@st.composite
def cluttered_worlds(draw_from: st.DrawFn, largest: int = 18) -> Drawing:
    """Random walls of any density, with a free start and a free goal somewhere."""
    rng = np.random.default_rng(draw_from(st.integers(0, 2**32 - 1)))
    rows, cols = draw_from(st.integers(5, largest)), draw_from(st.integers(5, largest))
    cells = scattered(rng, rows, cols, draw_from(st.floats(0.0, 0.6)))
    start = Cell(int(rng.integers(1, rows - 1)), int(rng.integers(1, cols - 1)))
    goal = Cell(int(rng.integers(1, rows - 1)), int(rng.integers(1, cols - 1)))
    cells[start], cells[goal] = FREE, FREE
    return Drawing(OccupancyGrid(cells, 0.5, Point(-3.0, 2.0)), start, goal)
