"""A subgoal stands for one frontier: where known free space meets the space that may hold the goal."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.distances import NO_TARGETS, Field, settle
from pipeline.grids.frontiers import flood_beyond, label_frontiers
from pipeline.grids.partial_map import CLEAR
from pipeline.planning.seen import Seen


class Subgoal(NamedTuple):
    """One frontier and the cell that stands for it.

    cells: [k] int32 flat indices of the frontier's cells, ascending; its identity from step to step.
    point: flat index of the frontier cell nearest to the mean of all of them.
    """

    cells: NDArray[np.int32]
    point: int

    @property
    def key(self) -> bytes:
        """The frontier's identity: equal exactly when the cells are."""
        return self.cells.tobytes()


class Surroundings(NamedTuple):
    """What a map says of the ways on.

    reach: [rows, cols] travel distance [cells] from the robot through known free space, inf elsewhere.
    subgoals: the frontiers that may lead to the goal; empty when it is reached or proved unreachable.
    """

    reach: Field
    subgoals: list[Subgoal]


def find_subgoals(seen: Seen) -> Surroundings:
    """Return the robot's reach and its subgoals, ordered by each frontier's first cell.

    Frontiers that lie within twice ``seen.widen`` cells of each other, by way of reached space, count as one.
    """
    cols = seen.map.status.shape[1]
    reach = settle(seen.map.status, CLEAR, seen.pose.row * cols + seen.pose.col, NO_TARGETS)
    beyond = flood_beyond(seen.map.status, reach, seen.goal.row * cols + seen.goal.col)
    cells, groups = label_frontiers(reach, beyond, seen.widen)
    if cells.size == 0:
        return Surroundings(reach, [])
    members = [cells[groups == group] for group in range(int(groups.max()) + 1)]
    return Surroundings(reach, [Subgoal(frontier, int(_middle(frontier, cols))) for frontier in members])


@njit(cache=True, nogil=True)
def _middle(cells: NDArray[np.int32], cols: int) -> int:
    rows, columns = cells // cols, cells % cols
    off = (rows - rows.mean()) ** 2 + (columns - columns.mean()) ** 2
    middle: int = cells[np.argmin(off)]
    return middle
