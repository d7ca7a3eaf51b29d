"""Ways to the goal through space that was never seen, at several distances from what was seen to stand in the way."""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.distances import Field, Indices, Status
from pipeline.grids.fields import LiveField
from pipeline.grids.inflate import disk_offsets
from pipeline.grids.partial_map import CHANGES, OBSTACLES, UNSEEN, PartialMap
from pipeline.grids.zones import REACHED, Zones
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Surroundings

Marks = NDArray[np.uint8]


class UnseenWays:
    """Distances to the goal over cells that are neither reached nor known to be blocked. Serves one trial.

    Narrow gaps between seen obstacles are seldom real ways on: for each clearance, cells within it of a seen obstacle
    are closed, except around the goal. Frontier cells are open.
    """

    def __init__(self, seen: Seen, around: Surroundings, clearances_m: Sequence[float]) -> None:
        """Look at the map of ``seen`` as it is. ``around`` is kept and read at each question."""
        self._map, self._around = seen.map, around
        self._edge: Marks = np.zeros(seen.map.status.size, dtype=np.uint8)
        self._border = around.cells[:0]
        goal = seen.goal.row * seen.map.status.shape[1] + seen.goal.col
        self._ways = [_Way(self._map, around, goal, clearance / seen.resolution) for clearance in clearances_m]
        self._divisions, self._read = -1, (0, 0, 0)

    def lengths(self) -> Field:
        """Return the shortest way from each frontier to the goal at each clearance [cells]: [frontiers, clearances]."""
        around, map_ = self._around, self._map
        self._edge[self._border] = 0
        self._edge[around.cells] = 1
        if around.divisions != self._divisions:
            changed = np.arange(map_.status.size, dtype=np.int32)
            obstacles = map_.obstacles[: map_.written[OBSTACLES]]
        else:
            seen = map_.changes[self._read[0] : map_.written[CHANGES]]
            changed = np.concatenate((seen, around.entered[self._read[2] :], self._border, around.cells))
            obstacles = map_.obstacles[self._read[1] : map_.written[OBSTACLES]]
        self._border, self._divisions = around.cells, around.divisions
        self._read = (int(map_.written[CHANGES]), int(map_.written[OBSTACLES]), around.entered.size)
        found = [_least(way.follow(changed, obstacles, self._edge), around.cells, around.starts) for way in self._ways]
        return np.stack(found, axis=1)


class _Way:
    """The way at one clearance [cells]."""

    def __init__(self, map_: PartialMap, around: Surroundings, goal: int, clearance: float) -> None:
        self._map, self._around, self._goal = map_, around, goal
        self._disk = disk_offsets(clearance)
        self._near = _around_cell(map_.status, goal, clearance + 1.5)
        self._tight: Marks = np.zeros(map_.status.size, dtype=np.uint8)
        self._shut: Status = np.ones_like(map_.status)
        self._field: LiveField | None = None

    def follow(self, changed: Indices, obstacles: Indices, edge: Marks) -> Field:
        """Take in the cells that changed and the obstacles that were seen, and return the distances to the goal."""
        status = self._map.status
        tightened = _tighten(self._tight, status.shape[1], obstacles, self._disk)
        cells = np.concatenate((changed, tightened))
        _shut(self._shut.ravel(), cells, status.ravel(), self._around.zones, edge, self._tight, self._near)
        if self._field is None:
            self._field = LiveField(self._shut, 0, self._goal, self._around.work)
        else:
            self._field.update(cells)
        return self._field.values


def _around_cell(status: Status, cell: int, distance: float) -> Marks:
    """Return 1 for the cells within ``distance`` [cells] of ``cell``, else 0: [cells] uint8."""
    rows, cols = status.shape
    away = np.hypot(np.arange(rows)[:, None] - cell // cols, np.arange(cols)[None, :] - cell % cols)
    near: Marks = (away <= distance + 1e-9).astype(np.uint8).ravel()
    return near


@njit(cache=True, nogil=True)
def _tighten(tight: Marks, cols: int, obstacles: Indices, disk: Indices) -> Indices:
    """Mark the cells within the clearance of ``obstacles`` in ``tight``; return those that were not marked before."""
    rows = tight.size // cols
    added = np.empty(min(tight.size, obstacles.size * disk.shape[0]), dtype=np.int32)
    count = 0
    for obstacle in obstacles:
        for k in range(disk.shape[0]):
            row, col = obstacle // cols + disk[k, 0], obstacle % cols + disk[k, 1]
            if 0 <= row < rows and 0 <= col < cols and tight[row * cols + col] == 0:
                tight[row * cols + col] = 1
                added[count] = row * cols + col
                count += 1
    return added[:count].copy()


@njit(cache=True, nogil=True)
def _shut(shut: Marks, cells: Indices, status: Marks, zones: Zones, edge: Marks, tight: Marks, near: Marks) -> None:
    """Write into ``shut`` whether a way leads through each of ``cells``: 0 if one does."""
    for cell in cells:
        unseen = zones[cell] != REACHED and status[cell] <= UNSEEN
        shut[cell] = 0 if edge[cell] or (unseen and (near[cell] or not tight[cell])) else 1


@njit(cache=True, nogil=True)
def _least(field: Field, cells: Indices, starts: Indices) -> Field:
    """Return the least value of ``field`` over the cells of each frontier."""
    least = np.full(starts.size - 1, np.inf)
    for group in range(least.size):
        for k in range(starts[group], starts[group + 1]):
            least[group] = min(least[group], field[cells[k]])
    return least
