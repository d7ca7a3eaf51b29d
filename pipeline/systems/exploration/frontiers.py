"""The frontiers in a robot's map: where space that it can drive to borders space that it has not seen.

A frontier is a maximal 8-connected set of reached cells that each have an unseen 4-neighbour where the robot might
stand (Yamauchi 1997). Without a goal, all unseen space counts.
"""

import numpy as np
from numba import njit

from pipeline.grids.distances import Field, Indices, Status, workspace_for
from pipeline.grids.fields import RobotField
from pipeline.grids.frontiers import find_border, group_border
from pipeline.grids.partial_map import CLEAR, UNSEEN
from pipeline.grids.zones import CLOSED, GOALWARD, REACHED, Zones
from pipeline.planning.seen import Seen


class Frontiers:
    """All frontiers of one trial's map, as it is now.

    cells [k] int32, starts [n + 1] int32: frontier by frontier, in order of their first cells, each ascending.
    middles: [n] int32, the cell of each that is nearest to the mean of its cells.
    reach: distances [cells] from the robot through space seen to be free.
    home: the robot's flat cell.
    """

    cells: Indices
    starts: Indices
    middles: Indices
    home: int

    def __init__(self, seen: Seen) -> None:
        """Look at the map of ``seen``."""
        size, self._cols = seen.map.status.size, seen.map.status.shape[1]
        self._zones, self._order = np.empty(size, dtype=np.uint8), np.zeros(size, dtype=np.int32)
        self.home = self._home(seen)
        self.reach = RobotField(seen.map, CLEAR, self.home, workspace_for(size))
        self.update(seen)

    def update(self, seen: Seen) -> None:
        """Take in what was seen since, and where the robot is now."""
        self.home = self._home(seen)
        self.reach.move(self.home)
        _divide(seen.map.status, self.reach.values, self._zones)
        border = find_border(self._zones, self._cols)
        self.cells, self.starts, self.middles = group_border(self._zones, self._cols, border, seen.widen, self._order)

    def sizes(self) -> Indices:
        """Return the number of cells of each frontier [n]."""
        return np.diff(self.starts)

    def hold(self, cell: int) -> bool:
        """Whether the flat ``cell`` is one of a frontier."""
        return bool((self.cells == cell).any())

    def viewpoints(self, spacing: float) -> Indices:
        """Return cells of the frontiers at least ``spacing`` [cells] apart within each, its middle the first of it."""
        return _thin(self.cells, self.starts, self.middles, self._cols, spacing)

    def _home(self, seen: Seen) -> int:
        return int(seen.pose.row * self._cols + seen.pose.col)


@njit(cache=True, nogil=True)
def _divide(status: Status, reach: Field, zones: Zones) -> None:
    """Fill ``zones`` [cells]: what ``reach`` reaches, what is beyond, and the rest."""
    flat = status.ravel()
    for cell in range(flat.size):
        if 0.0 <= reach[cell] < np.inf:
            zones[cell] = REACHED
        else:
            zones[cell] = GOALWARD if flat[cell] == UNSEEN else CLOSED


@njit(cache=True, nogil=True)
def _thin(cells: Indices, starts: Indices, middles: Indices, cols: int, spacing: float) -> Indices:
    """Return of each frontier its middle and then, in order, each cell at least ``spacing`` from all that were kept."""
    kept = np.empty(cells.size, dtype=np.int32)
    count = 0
    for frontier in range(middles.size):
        first = count
        kept[count] = middles[frontier]
        count += 1
        for place in range(starts[frontier], starts[frontier + 1]):
            row, col = cells[place] // cols, cells[place] % cols
            apart = True
            for k in range(first, count):
                rows, columns = kept[k] // cols - row, kept[k] % cols - col
                if rows * rows + columns * columns < spacing * spacing:
                    apart = False
                    break
            if apart:
                kept[count] = cells[place]
                count += 1
    return kept[:count].copy()
