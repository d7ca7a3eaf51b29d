"""The optimistic planner: unknown space is free until seen otherwise, so take the shortest path through both."""

import numpy as np
from numpy.typing import NDArray

from pipeline.grids.distances import descend, settle
from pipeline.grids.partial_map import UNSEEN
from pipeline.planning.seen import Seen


class OptimisticPlanner:
    """The baseline of LSP (CoRL 2018, section 3): replan the optimistic shortest path whenever the map changes."""

    def plan(self, seen: Seen) -> NDArray[np.int32] | None:
        """Return the shortest path to the goal with the unknown taken as free, or None where there is none."""
        status = seen.map.status
        cols = status.shape[1]
        robot = seen.pose.row * cols + seen.pose.col
        goal = seen.goal.row * cols + seen.goal.col
        field = settle(status, UNSEEN, goal, np.array([robot], dtype=np.int32))
        path = descend(field, status, UNSEEN, robot)
        return path if path.size else None
