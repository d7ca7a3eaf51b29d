"""Which space the robot can reach, and which space beyond may hold the goal: kept up to date scan by scan.

*Reached* are the cells that are connected to the robot by known free space. *Beyond* are all other cells that no seen
obstacle blocks. Only the part of the beyond that is connected to the goal matters: a pocket that the map already
proves to be closed cannot lead to it. Paths that cut no corner connect what is 4-connected, so 4 neighbours suffice.

A scan adds to the reached and takes from the beyond. Where a cell that is taken away holds its set together, as far as
its eight neighbours tell, the set may have come apart, and is flooded anew; elsewhere nothing but the changed cells is
looked at.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.distances import Indices, Status, wide
from pipeline.grids.partial_map import BLOCKED, CLEAR

# Values of a zone. Beyond, connected to the goal: the present mark, from FIRST_MARK on; any other mark is an old one.
REACHED = 0
APART = 1  # beyond, and not connected to the goal
FIRST_MARK = 2
LAST_MARK = 254
CLOSED = 255

MARK = 0  # places in the counts
FRESH = 1
REBUILT = 2

Zones = NDArray[np.uint8]


@njit(cache=True, nogil=True)
def divide(status: Status, home: int, goal: int, zones: Zones, counts: NDArray[np.int64], stack: Indices) -> None:
    """Fill ``zones`` [cells] from nothing but the map; see ``advance``."""
    flat = status.ravel()
    for cell in range(flat.size):
        zones[cell] = CLOSED if flat[cell] == BLOCKED else APART
    counts[MARK], counts[REBUILT] = FIRST_MARK, 1
    if flat[home] == CLEAR:
        zones[home] = REACHED
        stack[0] = home
        _reach(flat, status.shape[1], zones, stack, 1)
    if zones[goal] == APART:
        _flood(zones, status.shape[1], goal, wide(zones[goal]), counts[MARK], stack)


@njit(cache=True, nogil=True)
def advance(
    status: Status,
    home: int,
    goal: int,
    changed: Indices,
    zones: Zones,
    counts: NDArray[np.int64],
    fresh: Indices,
    stack: Indices,
) -> None:
    """Bring ``zones`` up to date after the flat cells ``changed`` got another status.

    home, goal: flat cells of the robot and the goal.
    counts: [3] int64: the mark of what is beyond and connected to the goal, the number of cells in ``fresh``, and 1
        where everything was divided anew because reached space came apart.
    fresh: [cells] int32, filled with the cells that were reached by this change; of no meaning after a division.
    """
    flat, cols = status.ravel(), status.shape[1]
    mark = counts[MARK]
    counts[FRESH], counts[REBUILT] = 0, 0
    split = False
    for k in range(changed.size):
        cell, was = wide(changed[k]), wide(zones[changed[k]])
        if flat[cell] == BLOCKED and was != CLOSED:
            zones[cell] = CLOSED
            if was == REACHED and _holds_together(zones, cols, cell, was):
                divide(status, home, goal, zones, counts, stack)
                return
            split |= was == mark and _holds_together(zones, cols, cell, was)
    reached = 0
    for k in range(changed.size):
        cell = wide(changed[k])
        if flat[cell] != CLEAR or zones[cell] == REACHED:
            continue
        if not (
            zones[cell + cols] == REACHED
            or zones[cell - cols] == REACHED
            or zones[cell + 1] == REACHED
            or zones[cell - 1] == REACHED
        ):
            continue
        fresh[reached] = cell
        depth = reached
        reached += 1
        split |= _take(zones, cols, cell, mark)
        while depth < reached:  # the tail of `fresh` is the queue
            here = wide(fresh[depth])
            depth += 1
            for move in range(4):
                other = here + (cols if move == 0 else -cols if move == 1 else 1 if move == 2 else -1)
                if flat[other] == CLEAR and zones[other] != REACHED:
                    fresh[reached] = other
                    reached += 1
                    split |= _take(zones, cols, other, mark)
    counts[FRESH] = reached
    if split and zones[goal] == mark:
        counts[MARK] = _remark(zones, cols, goal, mark, stack)


@njit(cache=True, nogil=True)
def _take(zones: Zones, cols: int, cell: int, mark: int) -> bool:
    """Make ``cell`` a reached one; return whether that may cut what is beyond in two."""
    was = wide(zones[cell])
    zones[cell] = REACHED
    return was == mark and _holds_together(zones, cols, cell, was)


@njit(cache=True, nogil=True)
def _holds_together(zones: Zones, cols: int, cell: int, kind: int) -> bool:
    """Whether the 4-neighbours of ``cell`` that are of ``kind`` are not connected through its eight neighbours."""
    north, south = zones[cell + cols] == kind, zones[cell - cols] == kind
    east, west = zones[cell + 1] == kind, zones[cell - 1] == kind
    sides = int(north) + int(east) + int(south) + int(west)
    joints = int(north and east and zones[cell + cols + 1] == kind)
    joints += int(south and east and zones[cell - cols + 1] == kind)
    joints += int(south and west and zones[cell - cols - 1] == kind)
    joints += int(north and west and zones[cell + cols - 1] == kind)
    return sides - joints > 1  # a ring of four sides and four joints counts 0


@njit(cache=True, nogil=True)
def _remark(zones: Zones, cols: int, goal: int, mark: int, stack: Indices) -> int:
    """Give what is still connected to the goal a new mark, and return it; what is not keeps the old one."""
    new = mark + 1
    if new > LAST_MARK:
        for cell in range(zones.size):
            if FIRST_MARK <= zones[cell] < CLOSED:
                zones[cell] = FIRST_MARK + 1 if zones[cell] == mark else APART
        mark, new = FIRST_MARK + 1, FIRST_MARK
    _flood(zones, cols, goal, mark, new, stack)
    return new


@njit(cache=True, nogil=True)
def _reach(flat: NDArray[np.uint8], cols: int, zones: Zones, stack: Indices, depth: int) -> None:
    while depth > 0:
        depth -= 1
        cell = stack[depth]
        for move in range(4):
            other = cell + (cols if move == 0 else -cols if move == 1 else 1 if move == 2 else -1)
            if flat[other] == CLEAR and zones[other] != REACHED:
                zones[other] = REACHED
                stack[depth] = other
                depth += 1


@njit(cache=True, nogil=True)
def _flood(zones: Zones, cols: int, start: int, old: int, new: int, stack: Indices) -> None:
    """Mark ``new`` what is ``old`` and 4-connected to ``start``, run by run along the rows."""
    stack[0] = start
    depth = 1
    while depth > 0:
        depth -= 1
        cell = stack[depth]
        if zones[cell] != old:
            continue
        first = cell
        while zones[first - 1] == old:
            first -= 1
        above, below = False, False  # whether the cell before, in the row beside, was `old`
        here = first
        while zones[here] == old:
            zones[here] = new
            if zones[here + cols] == old:
                if not above:
                    stack[depth] = here + cols
                    depth += 1
                above = True
            else:
                above = False
            if zones[here - cols] == old:
                if not below:
                    stack[depth] = here - cols
                    depth += 1
                below = True
            else:
                below = False
            here += 1
