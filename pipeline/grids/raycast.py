"""Exact range scans on a grid, entered into a partial map on the way."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.beams import BeamTree
from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN, Cells
from pipeline.grids.partial_map import CHANGES, CLEAR, UNSEEN, PartialMap, enter_obstacle

Ranges = NDArray[np.float64]


@njit(cache=True, nogil=True)
def scan(
    cells: Cells, map_: PartialMap, row: int, col: int, tree: BeamTree, disk: NDArray[np.int32]
) -> tuple[Ranges, int]:
    """Look around from the centre of (row, col) and enter what is seen into ``map_``, in place.

    cells: [rows, cols] the true grid; its outermost ring is not FREE.
    disk: [k, 2] int32 offsets that an obstacle blocks for the robot's centre (``disk_offsets``).
    Returns the ranges [beams] float64, the distance to where each beam enters the first cell that is not FREE [cells],
    ``tree.max_range`` where it meets none; and the number of cells not seen before.
    """
    truth, seen, room = cells.ravel(), map_.known.ravel(), map_.status.ravel()
    home = row * cells.shape[1] + col
    ranges = np.full(tree.pace.shape[0], tree.max_range)
    way, end, pace = tree.way, tree.end, tree.pace
    changes, written = map_.changes, map_.written
    fresh, node = 0, -1  # node -1: the robot's own cell
    while node < way.shape[0]:
        cell = home + way[node, 0] if node >= 0 else home
        was = seen[cell]
        if was == FREE:
            node += 1
        elif was == UNKNOWN and truth[cell] == FREE:
            fresh += 1
            seen[cell] = FREE
            if room[cell] == UNSEEN:
                room[cell] = CLEAR
                changes[written[CHANGES]] = cell
                written[CHANGES] += 1
            node += 1
        else:
            if was != OCCUPIED:
                fresh += 1
                enter_obstacle(map_, cell, disk)
            along_x, along_y = end[node, 3] - 0.5, end[node, 2] - 0.5
            for beam in range(end[node, 0], end[node, 1]):
                ranges[beam] = max(along_x * pace[beam, 0], along_y * pace[beam, 1])
            node = way[node, 1]
    return ranges, fresh
