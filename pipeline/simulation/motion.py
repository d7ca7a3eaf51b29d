"""A disc that follows a path through space it has seen to be free."""

from typing import NamedTuple

import numpy as np
from numba import njit

from pipeline.grids.distances import DIAGONAL, NOWHERE, Indices, Status, wide
from pipeline.grids.occupancy import FREE, OCCUPIED, Cells
from pipeline.grids.partial_map import CLEAR, PartialMap
from pipeline.planning.seen import Pose
from pipeline.simulation.protocols import Move
from pipeline.simulation.world import World


class Walk(NamedTuple):
    """Goes from cell centre to cell centre, 8-connected, and turns on the spot.

    turn_m: cost of turning once round where it stands, to look [m]; turns along its way cost nothing.
    """

    turn_m: float = 0.0

    @property
    def undercut(self) -> float:
        """No walk is shorter than the shortest one."""
        return 1.0

    def follow(self, path: Indices, map_: PartialMap, pose: Pose, world: World, length: float) -> Move:
        """Walk to the cell nearest to ``length`` [cells] along ``path``, see `walk`."""
        moves, travelled, touched = walk(path, map_, world.grid.cells, world.blocked, world.disk, length)
        there = pose_after(path, moves, pose, map_.status.shape[1])
        return Move(there, travelled, path[1 : moves + 1], path[moves:], touched)

    def turn(self, pose: Pose, heading: float, resolution: float) -> Move:
        """Turn on the spot."""
        angle = abs((heading - pose.heading + np.pi) % (2.0 * np.pi) - np.pi)
        cost = angle / (2.0 * np.pi) * self.turn_m / resolution
        return Move(pose._replace(heading=heading % (2.0 * np.pi)), cost, NOWHERE, NOWHERE, NOWHERE)


def pose_after(path: Indices, moves: int, pose: Pose, cols: int) -> Pose:
    """Return the pose after the first ``moves`` of ``path``: facing along the last of them."""
    if moves == 0:
        return pose
    (row, col), (before_row, before_col) = divmod(int(path[moves]), cols), divmod(int(path[moves - 1]), cols)
    return Pose(row, col, float(np.arctan2(row - before_row, col - before_col) % (2.0 * np.pi)))


@njit(cache=True, nogil=True)
def walk(
    path: Indices, map_: PartialMap, cells: Cells, blocked: Status, disk: Indices, length: float
) -> tuple[int, float, Indices]:
    """Follow ``path`` through space seen to be free for the move nearest to ``length`` [cells], at least one.

    An obstacle that hid from the scan, such as the far side of a corner, stops the robot when its body would touch
    it.

    cells, blocked, disk: as in `World`.
    Returns how many moves were made, their length [cells], and the flat cells of the obstacles that were touched.
    """
    cols, status, shut = map_.status.shape[1], map_.status.ravel(), blocked.ravel()
    travelled, moves = 0.0, 0
    while moves + 1 < path.size:
        here, there = wide(path[moves]), wide(path[moves + 1])
        # The two cells beside a diagonal move; of a straight one they are its ends.
        aside, astride = here // cols * cols + there % cols, there // cols * cols + here % cols
        # A corner that was not yet seen may be a wall: the robot scans before it passes one.
        if status[there] != CLEAR or status[aside] != CLEAR or status[astride] != CLEAR:
            break
        if shut[there] or shut[aside] or shut[astride]:
            return moves, travelled, touched_at(map_, cells, disk, np.array([there, aside, astride], dtype=np.int32))
        move = DIAGONAL if aside != here and aside != there else 1.0
        if moves > 0 and travelled + move - length > length - travelled + 1e-9:  # the nearer of the two ends
            break
        travelled += move
        moves += 1
    return moves, travelled, path[:0].copy()


@njit(cache=True, nogil=True)
def touched_at(map_: PartialMap, cells: Cells, disk: Indices, places: Indices) -> Indices:
    """Return every obstacle not yet in the map that a robot at one of the flat ``places`` would touch."""
    rows, cols = cells.shape
    found = np.empty(places.size * disk.shape[0], dtype=np.int32)
    count = 0
    for place in places:
        for k in range(disk.shape[0]):
            row, col = place // cols + disk[k, 0], place % cols + disk[k, 1]
            if 0 <= row < rows and 0 <= col < cols and cells[row, col] != FREE and map_.known[row, col] != OCCUPIED:
                found[count] = row * cols + col
                count += 1
    return found[:count].copy()
