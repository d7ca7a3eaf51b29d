"""The occupancy grid, and the one doorway where metres and cells meet.

Row 0 is the lowest y; ``origin`` is the outer corner of ``cells[0, 0]``; row grows with y, col with x.
"""

from math import floor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FREE = 0
OCCUPIED = 1
UNKNOWN = 2

Cells = NDArray[np.uint8]


class Point(NamedTuple):
    """A position in the world frame [m]; x to the right, y up."""

    x: float
    y: float


class Cell(NamedTuple):
    """Indices of a grid cell."""

    row: int
    col: int


class OccupancyGrid(NamedTuple):
    """A map of square cells.

    cells: [rows, cols] uint8 of FREE, OCCUPIED, UNKNOWN; row 0 is the lowest y.
    resolution: side of a cell [m].
    origin: outer corner of ``cells[0, 0]`` in the world frame [m].
    """

    cells: Cells
    resolution: float
    origin: Point


def cell_at(grid: OccupancyGrid, point: Point) -> Cell:
    """Return the cell that holds ``point`` [m]; it may lie outside the array."""
    return Cell(
        row=floor((point.y - grid.origin.y) / grid.resolution),
        col=floor((point.x - grid.origin.x) / grid.resolution),
    )


def center_of(grid: OccupancyGrid, cell: Cell) -> Point:
    """Return the centre of ``cell`` [m]."""
    return Point(
        x=grid.origin.x + (cell.col + 0.5) * grid.resolution,
        y=grid.origin.y + (cell.row + 0.5) * grid.resolution,
    )


def contains(grid: OccupancyGrid, cell: Cell) -> bool:
    """Return whether ``cell`` lies inside the array."""
    rows, cols = grid.cells.shape
    return bool(0 <= cell.row < rows and 0 <= cell.col < cols)
