"""The optimistic planner: unknown space is free until seen otherwise, so take the shortest path through both."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.distances import Indices, Status, descend, workspace_for
from pipeline.grids.fields import MapField
from pipeline.grids.partial_map import UNSEEN
from pipeline.planning.seen import Seen


class OptimisticPlanner:
    """The baseline of LSP (CoRL 2018, section 3): replan the optimistic shortest path whenever the map changes.

    What is seen can only close ways, so a shortest path stays one until something is seen to lie in it. One instance
    serves one trial.
    """

    def __init__(self, ways: MapField | None = None) -> None:
        """Plan with ``ways``, distances to the goal with the unknown taken as free, or else with a field of its own."""
        self._ways = ways
        self._path: Indices = np.empty(0, dtype=np.int32)

    def plan(self, seen: Seen) -> NDArray[np.int32] | None:
        """Return the shortest path to the goal with the unknown taken as free, or None where there is none."""
        status = seen.map.status
        cols = status.shape[1]
        robot, goal = seen.pose.row * cols + seen.pose.col, seen.goal.row * cols + seen.goal.col
        if self._ways is None:
            self._ways = MapField(seen.map, UNSEEN, goal, workspace_for(status.size))
        at = _place_on(self._path, status, robot)
        self._path = self._path[at:] if at >= 0 else descend(self._ways.catch_up(), cols, robot, goal)
        return self._path if self._path.size else None


@njit(cache=True, nogil=True)
def _place_on(path: Indices, status: Status, cell: int) -> int:
    """Return where on ``path`` the flat ``cell`` lies, -1 if nowhere or if the path from there is no longer open."""
    cols, flat = status.shape[1], status.ravel()
    at = 0
    while at < path.size and path[at] != cell:
        at += 1
    if at == path.size:
        return -1
    for k in range(at, path.size):
        if flat[path[k]] > UNSEEN:
            return -1
        here, there = path[max(k - 1, at)], path[k]  # and the two cells beside a diagonal move
        if flat[here // cols * cols + there % cols] > UNSEEN or flat[there // cols * cols + here % cols] > UNSEEN:
            return -1
    return at
