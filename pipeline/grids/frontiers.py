"""Frontiers: connected boundaries between the space a robot can reach and the space beyond that may hold the goal.

A frontier is a maximal 8-connected set of reached cells that each have a 4-neighbour beyond (``pipeline.grids.zones``).
"""

import numpy as np
from numba import njit

from pipeline.grids.distances import Field, Indices
from pipeline.grids.zones import GOALWARD, REACHED, Zones


@njit(cache=True, nogil=True)
def find_border(zones: Zones, cols: int) -> Indices:
    """Return all reached cells with a goalward 4-neighbour, ascending: [k] int32."""
    found = np.empty(zones.size, dtype=np.int32)
    count = 0
    for cell in range(cols + 1, zones.size - cols - 1):
        if zones[cell] == REACHED and _faces(zones, cols, cell):
            found[count] = cell
            count += 1
    return found[:count].copy()


@njit(cache=True, nogil=True)
def renew_border(zones: Zones, cols: int, border: Indices, fresh: Indices) -> Indices:
    """Return what ``find_border`` would, given the ``border`` before and the cells reached since, ``fresh``."""
    added = np.empty(fresh.size, dtype=np.int32)
    count = 0
    for cell in fresh:
        if _faces(zones, cols, cell):
            added[count] = cell
            count += 1
    _sort(added, count)
    merged = np.empty(border.size + count, dtype=np.int32)
    k, total = 0, 0
    for cell in border:
        if zones[cell] != REACHED or not _faces(zones, cols, cell):
            continue
        while k < count and added[k] < cell:
            merged[total] = added[k]
            k += 1
            total += 1
        merged[total] = cell
        total += 1
    while k < count:
        merged[total] = added[k]
        k += 1
        total += 1
    return merged[:total].copy()


@njit(cache=True, nogil=True)
def _sort(cells: Indices, count: int) -> None:
    """Sort the first ``count`` of ``cells``, in place: few, for which a library's sort takes seconds to compile."""
    gap = count // 2
    while gap > 0:
        for k in range(gap, count):
            cell, place = cells[k], k
            while place >= gap and cells[place - gap] > cell:
                cells[place] = cells[place - gap]
                place -= gap
            cells[place] = cell
        gap //= 2


@njit(cache=True, nogil=True, inline="always")
def _faces(zones: Zones, cols: int, cell: int) -> bool:
    return bool(
        zones[cell + cols] == GOALWARD
        or zones[cell - cols] == GOALWARD
        or zones[cell + 1] == GOALWARD
        or zones[cell - 1] == GOALWARD
    )


@njit(cache=True, nogil=True)
def group_border(
    zones: Zones, cols: int, border: Indices, widen: int, order: Indices
) -> tuple[Indices, Indices, Indices]:
    """Return the border cells frontier by frontier, where each frontier starts, and the cell nearest to its middle.

    Frontiers are 8-connected once they are widened by ``widen`` cells within reached space, so that a boundary broken
    up by furniture is one, while a wall keeps two apart. They come in order of their first cell, each ascending.
    order: [cells] int32 of zeros, left as it was.
    Returns cells [k] int32, starts [frontiers + 1] int32, middles [frontiers] int32.
    """
    near = _widened(zones, cols, border, widen, order)
    groups, count = _connect(near, cols, border.size, order)
    for cell in near:
        order[cell] = 0
    starts = np.zeros(count + 1, dtype=np.int32)
    for k in range(border.size):
        starts[groups[k] + 1] += 1
    for group in range(count):
        starts[group + 1] += starts[group]
    cells, places = np.empty_like(border), starts.copy()
    for k in range(border.size):
        cells[places[groups[k]]] = border[k]
        places[groups[k]] += 1
    middles = np.empty(count, dtype=np.int32)
    for group in range(count):
        middles[group] = _middle(cells[starts[group] : starts[group + 1]], cols)
    return cells, starts, middles


@njit(cache=True, nogil=True)
def _widened(zones: Zones, cols: int, border: Indices, widen: int, order: Indices) -> Indices:
    """Return the border and behind it the cells that widening adds; ``order`` gets 1 + the place of each."""
    near = border
    for k in range(border.size):
        order[border[k]] = k + 1
    for _ in range(widen):
        added = near.size
        wider = np.empty(9 * near.size, dtype=np.int32)
        for k in range(added):
            wider[k] = near[k]
        for cell in near:
            for drow in range(-1, 2):
                for dcol in range(-1, 2):
                    other = cell + drow * cols + dcol
                    if order[other] == 0 and zones[other] == REACHED:
                        wider[added] = other
                        added += 1
                        order[other] = added
        near = wider[:added]
    return near


@njit(cache=True, nogil=True)
def _connect(near: Indices, cols: int, border: int, order: Indices) -> tuple[Indices, int]:
    """Return the group of each cell of ``near`` and the number of groups, numbered by their first border cell."""
    groups = np.full(near.size, -1, dtype=np.int32)
    stack = np.empty(near.size, dtype=np.int32)
    count = 0
    for first in range(border):
        if groups[first] >= 0:
            continue
        groups[first] = count
        stack[0] = first
        depth = 1
        while depth > 0:
            depth -= 1
            cell = near[stack[depth]]
            for drow in range(-1, 2):
                for dcol in range(-1, 2):
                    place = order[cell + drow * cols + dcol] - 1
                    if place >= 0 and groups[place] < 0:
                        groups[place] = count
                        stack[depth] = place
                        depth += 1
        count += 1
    return groups, count


@njit(cache=True, nogil=True)
def _middle(cells: Indices, cols: int) -> int:
    row, col = 0, 0
    for cell in cells:
        row += cell // cols
        col += cell % cols
    mean_row, mean_col = row / cells.size, col / cells.size
    middle, least = -1, np.inf
    for cell in cells:
        off = (cell // cols - mean_row) ** 2 + (cell % cols - mean_col) ** 2
        if off < least:
            middle, least = cell, off
    return middle


@njit(cache=True, nogil=True)
def find_gates(cells: Indices, starts: Indices, reach: Field, base: float, onward: Field) -> tuple[Indices, Field]:
    """Return each frontier's gate, its cell on the shortest way robot -> frontier -> goal, and that way's length.

    cells, starts: frontiers as from ``group_border``.
    reach, onward: distances [cells] from the robot, plus ``base``, and to the goal.
    Of equal ways the one through the first cell counts. Returns gates [frontiers] int32, through [frontiers] float64.
    """
    count = starts.size - 1
    gates, through = np.empty(count, dtype=np.int32), np.full(count, np.inf)
    for group in range(count):
        gates[group] = cells[starts[group]]
        for k in range(starts[group], starts[group + 1]):
            way = reach[cells[k]] - base + onward[cells[k]]
            if way < through[group]:
                gates[group], through[group] = cells[k], way
    return gates, through
