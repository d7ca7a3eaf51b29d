"""What a robot knows of a building, as arrays that scans update in place.

``known`` holds what was seen of each cell; ``status`` holds whether the robot's centre may be there:

- CLEAR: seen free, and no seen obstacle within the robot's radius;
- UNSEEN: not seen, and no seen obstacle within the robot's radius;
- BLOCKED: a seen obstacle lies within the robot's radius (or the cell is on the outermost ring).

Travel through known space is ``status <= CLEAR``; with the unknown taken as free it is ``status <= UNSEEN``.

What a scan changes is written down, so that whoever derives something from the map need only look at what is new: two
journals grow with it, and each reader remembers how far it has read.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN, Cells

CLEAR = 0
UNSEEN = 1
BLOCKED = 2

CHANGES = 0  # places in PartialMap.written
OBSTACLES = 1


class PartialMap(NamedTuple):
    """A partly seen map.

    known: [rows, cols] uint8 of FREE, OCCUPIED, UNKNOWN; row 0 is the lowest y.
    status: [rows, cols] uint8 of CLEAR, UNSEEN, BLOCKED for the robot's centre.
    changes: [2 x cells] int32, the flat cells whose status changed, in order. A cell changes twice at most, since
        what was seen stays as it was seen.
    obstacles: [cells] int32, the flat cells that were seen to be OCCUPIED, in order.
    written: [2] int64, how much of ``changes`` and ``obstacles`` is filled.
    """

    known: Cells
    status: Cells
    changes: NDArray[np.int32]
    obstacles: NDArray[np.int32]
    written: NDArray[np.int64]


def unseen_map(rows: int, cols: int) -> PartialMap:
    """Return the map of a robot that has not yet sensed anything."""
    status = np.full((rows, cols), UNSEEN, dtype=np.uint8)
    status[0], status[-1], status[:, 0], status[:, -1] = BLOCKED, BLOCKED, BLOCKED, BLOCKED
    return map_of(np.full((rows, cols), UNKNOWN, dtype=np.uint8), status)


def map_of(known: Cells, status: Cells) -> PartialMap:
    """Return the map with these arrays; its journals begin with the obstacles that are known already."""
    changes, obstacles = np.empty(2 * known.size, dtype=np.int32), np.empty(known.size, dtype=np.int32)
    found = np.flatnonzero(known == OCCUPIED)
    obstacles[: found.size] = found
    return PartialMap(known, status, changes, obstacles, np.array([0, found.size], dtype=np.int64))


@njit(cache=True, nogil=True)
def enter_obstacle(map_: PartialMap, cell: int, disk: NDArray[np.int32]) -> None:
    """Write into the map that the flat ``cell`` is OCCUPIED, and where that keeps the robot's centre away.

    disk: [k, 2] int32 offsets (row, col) within the robot's radius (``disk_offsets``).
    """
    rows, cols = map_.status.shape
    map_.known.ravel()[cell] = OCCUPIED
    map_.obstacles[map_.written[OBSTACLES]] = cell
    map_.written[OBSTACLES] += 1
    row, col = cell // cols, cell % cols
    for k in range(disk.shape[0]):
        r, c = row + disk[k, 0], col + disk[k, 1]
        if 0 <= r < rows and 0 <= c < cols and map_.status[r, c] != BLOCKED:
            map_.status[r, c] = BLOCKED
            map_.changes[map_.written[CHANGES]] = r * cols + c
            map_.written[CHANGES] += 1


@njit(cache=True, nogil=True)
def enter(map_: PartialMap, cells: NDArray[np.int32], occupancy: Cells, disk: NDArray[np.int32]) -> int:
    """Write into the map what was seen of the flat ``cells`` [k], FREE or OCCUPIED; return how many are new to it.

    disk: as in ``enter_obstacle``. What is known already stays as it was seen.
    """
    seen, room = map_.known.ravel(), map_.status.ravel()
    fresh = 0
    for k in range(cells.size):
        cell = cells[k]
        was = seen[cell]
        if occupancy[k] != FREE:
            if was != OCCUPIED:
                fresh += 1
                enter_obstacle(map_, cell, disk)
        elif was == UNKNOWN:
            fresh += 1
            seen[cell] = FREE
            if room[cell] == UNSEEN:
                room[cell] = CLEAR
                map_.changes[map_.written[CHANGES]] = cell
                map_.written[CHANGES] += 1
    return fresh
