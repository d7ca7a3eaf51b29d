"""Exact range scans on a grid: what each beam meets, and which cells are seen on the way."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.beams import BeamTree
from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN, Cells
from pipeline.grids.partial_map import CHANGES, CLEAR, UNSEEN, PartialMap, enter_obstacle

Ranges = NDArray[np.float64]


@njit(cache=True, nogil=True)
def scan(
    cells: Cells, row: int, col: int, tree: BeamTree, first: int, count: int
) -> tuple[Ranges, NDArray[np.int32], Cells]:
    """Look from the centre of (row, col) along ``count`` beams of ``tree``, counter-clockwise from beam ``first``.

    cells: [rows, cols] the true grid; its outermost ring is not FREE.
    Returns the ranges [all beams] float64, the distance to where each beam enters the first cell that is not FREE
    [cells], ``tree.max_range`` where it meets none and where it is not among those asked for; then the flat cells seen,
    parents before children, a cell that several branches of the tree cross once for each; and FREE or OCCUPIED of each.
    """
    truth = cells.ravel()
    home = row * cells.shape[1] + col
    way, end, pace = tree.way, tree.end, tree.pace
    beams = pace.shape[0]
    ranges = np.full(beams, tree.max_range)
    found, met = np.empty(way.shape[0] + 1, dtype=np.int32), np.empty(way.shape[0] + 1, dtype=np.uint8)
    found[0], met[0] = home, FREE
    seen, node, whole = 1, 0, count >= beams
    while node < way.shape[0]:
        begin, stop = end[node, 0], end[node, 1]
        if not whole and (begin - first) % beams >= count and (first - begin) % beams >= stop - begin:
            node = way[node, 1]  # none of the beams asked for runs through it
            continue
        cell = home + way[node, 0]
        found[seen] = cell
        if truth[cell] == FREE:
            met[seen] = FREE
            node += 1
        else:
            met[seen] = OCCUPIED
            along_x, along_y = end[node, 3] - 0.5, end[node, 2] - 0.5
            for beam in range(begin, stop):
                if whole or (beam - first) % beams < count:
                    ranges[beam] = max(along_x * pace[beam, 0], along_y * pace[beam, 1])
            node = way[node, 1]
        seen += 1
    return ranges, found[:seen], met[:seen]


@njit(cache=True, nogil=True)
def scan_into(
    cells: Cells, map_: PartialMap, row: int, col: int, tree: BeamTree, disk: NDArray[np.int32]
) -> tuple[Ranges, int]:
    """Look all around as `scan` does and `enter` what is seen into ``map_`` on the way; the fast twin of the two.

    disk: as in ``enter``. Returns the ranges as `scan` and the number of cells not seen before.
    """
    truth, seen, room = cells.ravel(), map_.known.ravel(), map_.status.ravel()
    home = row * cells.shape[1] + col
    ranges = np.full(tree.pace.shape[0], tree.max_range)
    way, end, pace = tree.way, tree.end, tree.pace
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
                map_.changes[map_.written[CHANGES]] = cell
                map_.written[CHANGES] += 1
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
