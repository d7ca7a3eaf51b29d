"""A map that a robot made itself, as the belief that planners read: with unseen space around it and a ring at the rim.

The map of a robot ends where it has not been. What lies beyond must count as unseen, or no frontier would be at its
rim, and the way to a goal outside of it would seem closed.
"""

from math import ceil

import numpy as np

from pipeline.errors import ConfigError
from pipeline.grids.inflate import inflate
from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, Point, cell_at
from pipeline.grids.partial_map import BLOCKED, CLEAR, UNSEEN, PartialMap, map_of

MOST_CELLS = 50_000_000


def with_unseen_rim(grid: OccupancyGrid, points: list[Point], margin_m: float) -> OccupancyGrid:
    """Return ``grid`` with UNKNOWN cells around it, ``margin_m`` [m] wide, that reach as far beyond all ``points``.

    Raises:
        ConfigError: a point lies so far off that the grid would have more than 50 million cells.
    """
    rows, cols = grid.cells.shape
    cells = [cell_at(grid, point) for point in points]
    margin = max(1, ceil(margin_m / grid.resolution - 1e-9))
    low = (margin - min([0, *(cell.row for cell in cells)]), margin - min([0, *(cell.col for cell in cells)]))
    high = (
        margin + max([0, *(cell.row - rows + 1 for cell in cells)]),
        margin + max([0, *(cell.col - cols + 1 for cell in cells)]),
    )
    if (rows + low[0] + high[0]) * (cols + low[1] + high[1]) > MOST_CELLS:
        raise ConfigError(
            f"the map of {rows} x {cols} cells would have more than {MOST_CELLS:,} with the robot and its goal inside: "
            "expected both in the frame of the map, in metres"
        )
    widened = np.pad(grid.cells, ((low[0], high[0]), (low[1], high[1])), constant_values=UNKNOWN)
    corner = Point(grid.origin.x - low[1] * grid.resolution, grid.origin.y - low[0] * grid.resolution)
    return OccupancyGrid(widened, grid.resolution, corner)


def coarsened(grid: OccupancyGrid, resolution: float) -> OccupancyGrid:
    """Return ``grid`` on cells of ``resolution`` [m], a whole multiple of its own.

    A cell is OCCUPIED where any part is, FREE where at least half of it is and the rest was not seen, else UNKNOWN.

    Raises:
        ConfigError: the resolution is no such multiple.
    """
    factor = round(resolution / grid.resolution)
    if factor < 1 or abs(factor * grid.resolution - resolution) > 1e-6 * resolution:
        raise ConfigError(
            f"resolution_m = {resolution:g}: the map has cells of {grid.resolution:g} m, expected a whole multiple"
        )
    rows, cols = grid.cells.shape
    padded = np.pad(grid.cells, ((0, -rows % factor), (0, -cols % factor)), constant_values=UNKNOWN)
    blocks = padded.reshape(padded.shape[0] // factor, factor, padded.shape[1] // factor, factor)
    free = 2 * (blocks == FREE).sum(axis=(1, 3)) >= factor * factor
    cells = np.where((blocks == OCCUPIED).any(axis=(1, 3)), OCCUPIED, np.where(free, FREE, UNKNOWN))
    return OccupancyGrid(cells.astype(np.uint8), factor * grid.resolution, grid.origin)


def belief_of(grid: OccupancyGrid, radius_m: float) -> PartialMap:
    """Return what a robot of ``radius_m`` [m] that holds this map knows; the outermost cells are BLOCKED to it."""
    known = np.ascontiguousarray(grid.cells, dtype=np.uint8)
    status = np.where(known == FREE, CLEAR, UNSEEN).astype(np.uint8)
    status[inflate(known == OCCUPIED, radius_m / grid.resolution)] = BLOCKED
    status[0], status[-1], status[:, 0], status[:, -1] = BLOCKED, BLOCKED, BLOCKED, BLOCKED
    return map_of(known, status)
