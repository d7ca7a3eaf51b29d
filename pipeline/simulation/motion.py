"""A disc that follows a path through space it has seen to be free."""

import numpy as np
from numba import njit

from pipeline.grids.distances import DIAGONAL, Indices, Status, wide
from pipeline.grids.occupancy import FREE, OCCUPIED, Cells
from pipeline.grids.partial_map import CLEAR, PartialMap, enter_obstacle
from pipeline.planning.seen import Pose


def pose_after(path: Indices, moves: int, pose: Pose, cols: int) -> Pose:
    """Return the pose after the first ``moves`` of ``path``: facing along the last of them."""
    if moves == 0:
        return pose
    (row, col), (before_row, before_col) = divmod(int(path[moves]), cols), divmod(int(path[moves - 1]), cols)
    return Pose(row, col, float(np.arctan2(row - before_row, col - before_col) % (2.0 * np.pi)))


@njit(cache=True, nogil=True)
def walk(
    path: Indices, map_: PartialMap, cells: Cells, blocked: Status, disk: Indices, length: float
) -> tuple[int, float, bool]:
    """Follow ``path`` through space seen to be free for the move nearest to ``length`` [cells], at least one.

    An obstacle that hid from the scan, such as the far side of a corner, stops the robot when its body would touch
    it; it then enters the map.

    cells, blocked, disk: as in `World`.
    Returns how many moves were made, their length [cells], and whether something was touched.
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
            _touch(map_, cells, disk, there)
            _touch(map_, cells, disk, aside)
            _touch(map_, cells, disk, astride)
            return moves, travelled, True
        move = DIAGONAL if aside != here and aside != there else 1.0
        if moves > 0 and travelled + move - length > length - travelled + 1e-9:  # the nearer of the two ends
            break
        travelled += move
        moves += 1
    return moves, travelled, False


@njit(cache=True, nogil=True)
def _touch(map_: PartialMap, cells: Cells, disk: Indices, cell: int) -> None:
    """Enter into the map every obstacle that a robot at the flat ``cell`` would touch."""
    rows, cols = cells.shape
    for k in range(disk.shape[0]):
        row, col = cell // cols + disk[k, 0], cell % cols + disk[k, 1]
        if 0 <= row < rows and 0 <= col < cols and cells[row, col] != FREE and map_.known[row, col] != OCCUPIED:
            enter_obstacle(map_, row * cols + col, disk)
