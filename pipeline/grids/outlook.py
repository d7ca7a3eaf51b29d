"""What a map shows around one of its cells: how far each direction is open, and how much of it was never seen."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.occupancy import OCCUPIED, UNKNOWN, Cells


@njit(cache=True, nogil=True)
def look_around(
    known: Cells, row: int, col: int, directions: NDArray[np.float64], max_range: float
) -> NDArray[np.float64]:
    """Return what lines from the centre of (row, col) pass through in the map ``known``: [3, lines] in cells.

    The first row holds the distance to the first OCCUPIED cell, unknown cells taken as transparent, at most
    ``max_range``; the second the length within UNKNOWN cells up to there; the third the distance at which the first
    UNKNOWN cell begins, ``max_range`` where there is none. directions: [lines, 2] unit vectors (x, y). A line ends at
    the edge of the map.
    """
    rows, cols = known.shape
    seen = np.empty((3, directions.shape[0]))
    for line in range(directions.shape[0]):
        dx, dy = directions[line, 0], directions[line, 1]
        step_x = 1 if dx > 0 else -1
        step_y = 1 if dy > 0 else -1
        delta_x = 1.0 / abs(dx) if dx != 0.0 else np.inf
        delta_y = 1.0 / abs(dy) if dy != 0.0 else np.inf
        next_x, next_y = 0.5 * delta_x, 0.5 * delta_y
        r, c = row, col
        here, unseen, first = 0.0, 0.0, max_range
        while here < max_range:
            if r < 0 or c < 0 or r >= rows or c >= cols or known[r, c] == OCCUPIED:
                break
            there = min(next_x, next_y, max_range)
            if known[r, c] == UNKNOWN:
                unseen += there - here
                first = min(first, here)
            here = there
            if next_x <= next_y:
                next_x += delta_x
                c += step_x
            else:
                next_y += delta_y
                r += step_y
        seen[0, line], seen[1, line], seen[2, line] = here, unseen, first
    return seen
