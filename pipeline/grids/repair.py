"""Distance fields that are repaired, not recomputed, when cells of the grid open or close.

First everything whose shortest way ran through a closed cell is found and cleared; then what borders on the cleared and
the opened cells spreads into them. The batch form of Ramalingam and Reps (1996); D* Lite and LPA* do the same with a
goal in mind. The repaired field equals the recomputed one to the last bit, since both solve
``field[n] = min over neighbours m of field[m] + move(m, n)``, and that has one solution.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.distances import (
    DIAGONAL,
    SHUT,
    Field,
    Indices,
    Status,
    Workspace,
    by_level,
    spread,
    wide,
)

GAVE_UP = -1


@njit(cache=True, nogil=True)
def repair(
    field: Field, status: Status, limit: int, source: int, origin: float, changed: Indices, most: int, work: Workspace
) -> int:
    """Make ``field`` true again after the flat cells ``changed`` got another ``status``; return how many it cleared.

    source, origin: the flat cell that distances are counted from, and its own value.
    Gives up with -1, the field half done, once more than ``most`` cells were cleared.
    """
    cols = status.shape[1]
    touched = _shut_and_open(field, status.ravel(), limit, source, origin, changed, work.lost)
    cleared = _clear_unsupported(field, cols, source, touched, most, work)
    if cleared == GAVE_UP:
        return GAVE_UP
    seeds = _border(field, cols, source, touched, cleared, work)
    spread(field, cols, by_level(field, seeds), changed[:0], work, np.bool_(True))
    return cleared


@njit(cache=True, nogil=True)
def _shut_and_open(
    field: Field, flat: NDArray[np.uint8], limit: int, source: int, origin: float, changed: Indices, lost: Indices
) -> int:
    """Enter in ``field`` which of ``changed`` are passable now; return how many changed (the head of ``lost``)."""
    touched = 0
    for cell in changed:
        passable = flat[cell] <= limit
        if passable == (field[cell] >= 0.0):
            continue
        field[cell] = SHUT if not passable else origin if cell == source else np.inf
        lost[touched] = cell
        touched += 1
    return touched


@njit(cache=True, nogil=True)
def _clear_unsupported(field: Field, cols: int, source: int, touched: int, most: int, work: Workspace) -> int:
    """Set to inf every distance that no neighbour bears out any longer; return the new length of ``work.lost``."""
    lost, stack = work.lost, work.stack
    steps = _steps(cols)
    count = touched
    for k in range(touched):
        if field[lost[k]] != SHUT:
            continue
        depth = 0
        for step in steps:
            other = lost[k] + step
            if 0 <= other < field.size and 0.0 <= field[other] < np.inf and other != source:
                stack[depth] = other
                depth += 1
        while depth > 0:
            depth -= 1
            cell = wide(stack[depth])
            here = field[cell]
            # A neighbour that offers less may be about to be cleared itself: only equality bears `here` out.
            if here == np.inf or best_way(field, cols, cell) == here:
                continue
            field[cell] = np.inf
            lost[count] = cell
            count += 1
            if count - touched > most:
                return GAVE_UP
            for move in range(8):  # whom it may have supported
                other = cell + steps[move]
                if field[other] == here + (1.0 if move < 4 else DIAGONAL):
                    stack[depth] = other
                    depth += 1
    return count


@njit(cache=True, nogil=True)
def _border(field: Field, cols: int, source: int, touched: int, cleared: int, work: Workspace) -> Indices:
    """Give the cleared and opened cells what their neighbours offer; return the cells that got something."""
    lost, seeds = work.lost, work.stack
    steps = _steps(cols)
    count = 0
    for k in range(cleared):
        cell = wide(lost[k])
        if field[cell] == SHUT:
            continue
        if cell != source:
            field[cell] = min(field[cell], best_way(field, cols, cell))
        if field[cell] < np.inf:
            seeds[count] = cell
            count += 1
        if k < touched:  # an opened cell lets its neighbours pass it diagonally
            for step in steps[:4]:
                other = cell + step
                if 0 <= other < field.size and field[other] >= 0.0:
                    way = best_way(field, cols, other)
                    if way < field[other]:
                        field[other] = way
                        seeds[count] = other
                        count += 1
    return seeds[:count].copy()


@njit(cache=True, nogil=True)
def best_way(field: Field, cols: int, cell: int) -> float:
    """Return the least distance that the neighbours of the passable flat ``cell`` offer it, inf if none does."""
    at, row, one = np.uintp(cell), np.uintp(cols), np.uintp(1)  # unsigned: see `spread`
    north, east = field[at + row], field[at + one]
    south, west = field[at - row], field[at - one]
    straight, diagonal = np.inf, np.inf
    if north >= 0.0:
        straight = min(straight, north)
        if east >= 0.0 and field[at + row + one] >= 0.0:
            diagonal = min(diagonal, field[at + row + one])
        if west >= 0.0 and field[at + row - one] >= 0.0:
            diagonal = min(diagonal, field[at + row - one])
    if south >= 0.0:
        straight = min(straight, south)
        if east >= 0.0 and field[at - row + one] >= 0.0:
            diagonal = min(diagonal, field[at - row + one])
        if west >= 0.0 and field[at - row - one] >= 0.0:
            diagonal = min(diagonal, field[at - row - one])
    if east >= 0.0:
        straight = min(straight, east)
    if west >= 0.0:
        straight = min(straight, west)
    return float(min(straight + 1.0, diagonal + DIAGONAL))


@njit(cache=True, nogil=True)
def _steps(cols: int) -> NDArray[np.int64]:
    return np.array([cols, -cols, 1, -1, cols + 1, cols - 1, -cols + 1, -cols - 1], dtype=np.int64)
