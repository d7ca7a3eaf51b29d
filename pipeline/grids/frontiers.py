"""Frontiers: connected boundaries between the space a robot can reach and the space it has not seen.

*Reached* are the cells with a finite travel distance from the robot through known free space. *Beyond* are all
other cells that no seen obstacle blocks. A frontier is a maximal 8-connected set of reached cells that each have a
4-neighbour beyond. Only the part of the beyond that may still hold the goal matters: a pocket that the map already
proves to be closed cannot lead to it, so it gets no frontier.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.distances import Field, Status
from pipeline.grids.partial_map import UNSEEN

Mask = NDArray[np.bool_]


@njit(cache=True, nogil=True)
def flood_beyond(status: Status, reach: Field, goal: int) -> Mask:
    """Return the cells beyond that are 4-connected to the flat index ``goal`` without entering reached space.

    status: [rows, cols] uint8 of CLEAR, UNSEEN, BLOCKED; reach: [rows, cols] distances from the robot, inf beyond.
    """
    rows, cols = status.shape
    flat = status.ravel()
    dist = reach.ravel()
    mask = np.zeros(rows * cols, dtype=np.bool_)
    if flat[goal] > UNSEEN or dist[goal] != np.inf:
        return mask.reshape(rows, cols)
    stack = np.empty(rows * cols, dtype=np.int32)
    stack[0] = goal
    mask[goal] = True
    count = 1
    while count > 0:
        count -= 1
        cell = stack[count]
        for move in range(4):
            other = cell + (cols if move == 0 else -cols if move == 1 else 1 if move == 2 else -1)
            if not mask[other] and flat[other] <= UNSEEN and dist[other] == np.inf:
                mask[other] = True
                stack[count] = other
                count += 1
    return mask.reshape(rows, cols)


@njit(cache=True, nogil=True)
def label_frontiers(  # noqa: PLR0915  # one pass; a call per cell would cost more than the work on it
    reach: Field, beyond: Mask, widen: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the frontier cells in row-major order and their group numbers: flat [k] int32, group [k] int32.

    Groups are 8-connected once the frontiers are widened by ``widen`` cells within reached space, so that a boundary
    broken up by furniture is one, while a wall keeps two apart; they are numbered by their first cell.
    """
    rows, cols = reach.shape
    dist = reach.ravel()
    goalward = beyond.ravel()
    found = np.empty(rows * cols, dtype=np.int32)
    order = np.zeros(rows * cols, dtype=np.int32)  # 1 + place in `found`, 0 elsewhere
    count = 0
    for row in range(1, rows - 1):
        for col in range(1, cols - 1):
            cell = row * cols + col
            if dist[cell] == np.inf:
                continue
            if goalward[cell + cols] or goalward[cell - cols] or goalward[cell + 1] or goalward[cell - 1]:
                found[count] = cell
                count += 1
                order[cell] = count
    near = found[:count].copy()  # widening adds cells of no frontier behind the `count` that are
    for _ in range(widen):
        added = near.size
        wider = np.empty(9 * near.size, dtype=np.int32)
        wider[:added] = near
        for k in range(near.size):
            for drow in range(-1, 2):
                for dcol in range(-1, 2):
                    cell = near[k] + drow * cols + dcol
                    if order[cell] == 0 and dist[cell] != np.inf:
                        wider[added] = cell
                        added += 1
                        order[cell] = added
        near = wider[:added].copy()
    groups = np.full(near.size, -1, dtype=np.int32)
    stack = np.empty(near.size, dtype=np.int32)
    group = 0
    for first in range(count):
        if groups[first] >= 0:
            continue
        groups[first] = group
        stack[0] = first
        depth = 1
        while depth > 0:
            depth -= 1
            cell = near[stack[depth]]
            for drow in range(-1, 2):
                for dcol in range(-1, 2):
                    place = order[cell + drow * cols + dcol] - 1
                    if place >= 0 and groups[place] < 0:
                        groups[place] = group
                        stack[depth] = place
                        depth += 1
        group += 1
    return found[:count].copy(), groups[:count].copy()
