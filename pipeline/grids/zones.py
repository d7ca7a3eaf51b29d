"""Which space the robot can reach, and which space beyond may hold the goal: kept up to date scan by scan.

*Reached* are the cells that are connected to the robot by known free space. *Beyond* are all other cells that no seen
obstacle blocks. Only the part of the beyond that is connected to the goal matters: a pocket that the map already
proves to be closed cannot lead to it. Paths that cut no corner connect what is 4-connected, so 4 neighbours suffice.

What is goalward only shrinks, cell by cell, and now and then a part is cut off. Taking a cell away does that exactly
where the cell closes a ring of cells that are not goalward, 8-connected ones, around the part (a curve divides the
plane in two). So the cells that are not goalward are kept in sets that are joined whenever they come to touch, and a
cell that would join two sides of one set closes a ring. Then both sides are flooded in turn until the smaller one ends.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.distances import Indices, Status, wide
from pipeline.grids.partial_map import BLOCKED, CLEAR

REACHED = 0
APART = 1  # beyond, and not connected to the goal
GOALWARD = 2  # beyond, and connected to the goal
CLOSED = 3
_SIDE = 4  # and on: found from one side of a cut, while it is decided which side is goalward

FRESH = 0  # places in the counts
REBUILT = 1

Zones = NDArray[np.uint8]
_TURN = 16  # cells by which a side is flooded before the next one has its turn


@njit(cache=True, nogil=True)
def divide(
    status: Status, home: int, goal: int, zones: Zones, sets: Indices, counts: NDArray[np.int64], stack: Indices
) -> None:
    """Fill ``zones`` and ``sets`` from nothing but the map; see ``advance``."""
    flat, cols = status.ravel(), status.shape[1]
    for cell in range(flat.size):
        zones[cell] = CLOSED if flat[cell] == BLOCKED else APART
        sets[cell] = cell
    counts[FRESH], counts[REBUILT] = 0, 1
    if flat[home] == CLEAR:
        _flood(flat, cols, home, CLEAR, zones, REACHED, stack)
    if zones[goal] == APART:
        _flood(zones, cols, goal, APART, zones, GOALWARD, stack)
    for cell in range(flat.size):
        row, col = cell // cols, cell % cols
        if row == 0 or col == 0 or row == status.shape[0] - 1 or col == cols - 1:
            sets[cell] = 0  # the outermost ring is one
    for cell in range(cols + 1, flat.size - cols - 1):
        if zones[cell] != GOALWARD and 0 < cell % cols < cols - 1:
            _join_around(zones, cols, wide(cell), sets)


@njit(cache=True, nogil=True)
def advance(
    status: Status,
    home: int,
    goal: int,
    changed: Indices,
    zones: Zones,
    sets: Indices,
    counts: NDArray[np.int64],
    fresh: Indices,
    stack: Indices,
) -> None:
    """Bring ``zones`` [cells] up to date after the flat cells ``changed`` got another status.

    home, goal: flat cells of the robot and the goal.
    sets: [cells] int32, the sets of cells that are not goalward, as trees of parents.
    counts: [2] int64: the number of cells in ``fresh``, and 1 where everything was divided anew because reached space
        came apart.
    fresh: [cells] int32, filled with the cells that were reached by this change; of no meaning after a division.
    stack: [8 x cells] int32, room.
    """
    flat, cols = status.ravel(), status.shape[1]
    counts[FRESH], counts[REBUILT] = 0, 0
    lost, loose = 0, False  # reached cells that are closed now, noted in `fresh`; whether one held the rest together
    for k in range(changed.size):
        cell, was = wide(changed[k]), wide(zones[changed[k]])
        if flat[cell] != BLOCKED or was == CLOSED:
            continue
        zones[cell] = CLOSED
        if was == GOALWARD:
            _take_away(zones, cols, cell, goal, sets, stack)
        elif was == REACHED:
            fresh[lost] = cell
            lost += 1
            loose |= _held_together(zones, cols, cell, REACHED)
    if loose and _came_apart(zones, cols, fresh[:lost], stack):
        divide(status, home, goal, zones, sets, counts, stack)
        return
    reached = 0
    for k in range(changed.size):
        cell = wide(changed[k])
        if flat[cell] != CLEAR or zones[cell] == REACHED or not _touches(zones, cols, cell, REACHED):
            continue
        first = reached
        fresh[reached] = cell
        reached += 1
        zones[cell], was = REACHED, wide(zones[cell])
        if was == GOALWARD:
            _take_away(zones, cols, cell, goal, sets, stack)
        while first < reached:  # the tail of `fresh` is the queue
            here = wide(fresh[first])
            first += 1
            for move in range(4):
                other = here + (cols if move == 0 else -cols if move == 1 else 1 if move == 2 else -1)
                if flat[other] == CLEAR and zones[other] != REACHED:
                    fresh[reached] = other
                    reached += 1
                    zones[other], was = REACHED, wide(zones[other])
                    if was == GOALWARD:
                        _take_away(zones, cols, other, goal, sets, stack)
    counts[FRESH] = reached


@njit(cache=True, nogil=True)
def _touches(zones: Zones, cols: int, cell: int, kind: int) -> bool:
    return bool(
        zones[cell + cols] == kind or zones[cell - cols] == kind or zones[cell + 1] == kind or zones[cell - 1] == kind
    )


@njit(cache=True, nogil=True)
def _held_together(zones: Zones, cols: int, cell: int, kind: int) -> bool:
    """Whether the 4-neighbours of ``cell`` that are of ``kind`` are not connected through its eight neighbours."""
    north, south = zones[cell + cols] == kind, zones[cell - cols] == kind
    east, west = zones[cell + 1] == kind, zones[cell - 1] == kind
    sides = int(north) + int(east) + int(south) + int(west)
    joints = int(north and east and zones[cell + cols + 1] == kind)
    joints += int(south and east and zones[cell - cols + 1] == kind)
    joints += int(south and west and zones[cell - cols - 1] == kind)
    joints += int(north and west and zones[cell + cols - 1] == kind)
    return sides - joints > 1  # a ring of four sides and four joints counts 0


@njit(cache=True, nogil=True)
def _came_apart(zones: Zones, cols: int, closed: Indices, queue: Indices) -> bool:
    """Whether the reached cells around the ``closed`` ones are no longer connected with each other.

    Floods from all of them at once; where two floods meet, they are one. If all are one before any ends, reached space
    holds. It mostly does: the way around what was seen to stand there is short.
    """
    groups = np.arange(256)  # of each flood the one it is part of
    waiting = np.zeros(256, dtype=np.int64)  # cells in the queue, of each group
    floods, tail = 0, 0
    for cell in closed:
        for move in range(4):
            other = wide(cell) + (cols if move == 0 else -cols if move == 1 else 1 if move == 2 else -1)
            if zones[other] != REACHED:
                continue
            beside = max(zones[other + cols], zones[other - cols], zones[other + 1], zones[other - 1])
            if beside < _SIDE:
                beside = _SIDE + floods
                floods += 1
                if floods > 250:
                    return True  # more than can be told apart: let all be divided anew
            zones[other] = beside
            waiting[beside - _SIDE] += 1
            queue[tail] = other
            tail += 1
    head, left, ended = 0, floods, False
    while left > 1 and not ended:
        cell = wide(queue[head])
        head += 1
        flood = _group(groups, wide(zones[cell]) - _SIDE)
        waiting[flood] -= 1
        for move in range(4):
            other = cell + (cols if move == 0 else -cols if move == 1 else 1 if move == 2 else -1)
            if zones[other] == REACHED:
                zones[other] = _SIDE + flood
                waiting[flood] += 1
                queue[tail] = other
                tail += 1
            elif zones[other] >= _SIDE:
                met = _group(groups, wide(zones[other]) - _SIDE)
                if met != flood:
                    groups[met] = flood
                    waiting[flood] += waiting[met]
                    left -= 1
        ended = waiting[flood] == 0 and left > 1
    for k in range(tail):
        zones[queue[k]] = REACHED
    return ended


@njit(cache=True, nogil=True)
def _group(groups: NDArray[np.int64], flood: int) -> int:
    while groups[flood] != flood:
        flood = groups[flood]
    return flood


@njit(cache=True, nogil=True)
def _take_away(zones: Zones, cols: int, cell: int, goal: int, sets: Indices, stack: Indices) -> None:
    """See to it that ``cell``, no longer goalward, is joined to its set, and that what it cuts off is APART."""
    if zones[goal] != GOALWARD:
        return
    if _held_together(zones, cols, cell, GOALWARD):
        seeds, count = _sides_of_cut(zones, cols, cell, sets)
        if count > 1:
            _cut_off(zones, cols, goal, seeds, count, sets, stack)
    _join_around(zones, cols, cell, sets)


@njit(cache=True, nogil=True)
def _sides_of_cut(zones: Zones, cols: int, cell: int, sets: Indices) -> tuple[NDArray[np.int64], int]:
    """Return a goalward neighbour of ``cell`` for each part into which taking it away divides what is goalward.

    Around the cell goalward stretches and gaps take turns. Two gaps of one set are joined outside, too: together with
    the cell they close a ring, and what lies between them on the one side is cut off from the other.
    """
    around = np.array([1, cols + 1, cols, cols - 1, -1, -cols - 1, -cols, -cols + 1])
    ends, gaps = np.empty(4, dtype=np.int64), np.empty(4, dtype=np.int64)  # of each stretch its end, the set behind it
    count = 0
    for side in range(0, 8, 2):
        if zones[cell + around[side]] != GOALWARD:
            continue
        corner, following = cell + around[side + 1], cell + around[(side + 2) % 8]
        goes_on = zones[following] == GOALWARD
        if not (goes_on and zones[corner] == GOALWARD):
            ends[count] = cell + around[side]
            gaps[count] = _root(sets, corner if goes_on else following)
            count += 1
    seeds, found = np.empty(4, dtype=np.int64), np.empty(4, dtype=np.int64)
    parts = 0
    for stretch in range(count):
        apart = True
        for k in range(parts):
            apart = apart and _between_gaps_of_one_set(gaps, found[k], stretch, count)
        if apart:
            seeds[parts], found[parts] = ends[stretch], stretch
            parts += 1
    return seeds, parts


@njit(cache=True, nogil=True)
def _between_gaps_of_one_set(gaps: NDArray[np.int64], one: int, other: int, count: int) -> bool:
    """Whether two gaps of one set have the stretches ``one`` and ``other`` on different sides."""
    for p in range(count):
        for q in range(p + 1, count):
            if gaps[p] == gaps[q] and (p < one <= q) != (p < other <= q):
                return True
    return False


@njit(cache=True, nogil=True)
def _cut_off(
    zones: Zones, cols: int, goal: int, seeds: NDArray[np.int64], parts: int, sets: Indices, stack: Indices
) -> None:
    """Decide which of the ``parts`` that begin at ``seeds`` is goalward; the others become APART."""
    room = stack.size // 4
    heads, tails, left = np.zeros(4, dtype=np.int64), np.zeros(4, dtype=np.int64), parts
    for part in range(parts):
        heads[part] = part * room
        stack[part * room] = seeds[part]
        tails[part] = part * room + 1
        zones[seeds[part]] = _SIDE + part
    while left > 1:  # in turns, so that the search ends with the second largest part
        for part in range(parts):
            if heads[part] < tails[part] and left > 1:
                _spread_side(zones, cols, part, heads, tails, stack, _TURN)
                left -= int(heads[part] == tails[part])
    home = -1  # the part with the goal: where none that ended has it, the one that did not
    for part in range(parts):
        if zones[goal] == _SIDE + part or (home < 0 and heads[part] < tails[part]):
            home = part
    for part in range(parts):
        if part != home and heads[part] < tails[part]:
            _spread_side(zones, cols, part, heads, tails, stack, zones.size)
    for part in range(parts):
        for k in range(part * room, tails[part]):
            zones[stack[k]] = GOALWARD if part == home else APART
    for part in range(parts):
        if part != home:
            for k in range(part * room, tails[part]):
                _join_around(zones, cols, wide(stack[k]), sets)


@njit(cache=True, nogil=True)
def _spread_side(
    zones: Zones, cols: int, part: int, heads: NDArray[np.int64], tails: NDArray[np.int64], stack: Indices, most: int
) -> None:
    """Flood one side of a cut by up to ``most`` cells."""
    head, tail = heads[part], tails[part]
    while head < tail and most > 0:
        cell = wide(stack[head])
        head += 1
        most -= 1
        for move in range(4):
            other = cell + (cols if move == 0 else -cols if move == 1 else 1 if move == 2 else -1)
            if zones[other] == GOALWARD:
                zones[other] = _SIDE + part
                stack[tail] = other
                tail += 1
    heads[part], tails[part] = head, tail


@njit(cache=True, nogil=True)
def _join_around(zones: Zones, cols: int, cell: int, sets: Indices) -> None:
    """Join ``cell`` with those of its eight neighbours that are not goalward."""
    root = _root(sets, cell)
    for drow in range(-1, 2):
        for dcol in range(-1, 2):
            other = cell + drow * cols + dcol
            if zones[other] != GOALWARD:
                beside = _root(sets, other)
                if beside != root:
                    root, beside = min(root, beside), max(root, beside)
                    sets[beside] = root


@njit(cache=True, nogil=True)
def _root(sets: Indices, cell: int) -> int:
    """Return the cell that stands for the set of ``cell``."""
    while sets[cell] != cell:
        sets[cell] = sets[sets[cell]]  # halve the way for the next who asks
        cell = wide(sets[cell])
    return cell


@njit(cache=True, nogil=True)
def _flood(kinds: Status, cols: int, start: int, kind: int, zones: Zones, mark: int, stack: Indices) -> None:
    """Write ``mark`` into ``zones`` where ``kinds`` is ``kind`` and 4-connected to ``start``, run by run."""
    stack[0] = start
    depth = 1
    while depth > 0:
        depth -= 1
        here = wide(stack[depth])
        if kinds[here] != kind or zones[here] == mark:
            continue
        while kinds[here - 1] == kind and zones[here - 1] != mark:
            here -= 1
        above, below = False, False  # whether the cell before, in the row beside, was to be marked
        while kinds[here] == kind and zones[here] != mark:
            zones[here] = mark
            up = kinds[here + cols] == kind and zones[here + cols] != mark
            down = kinds[here - cols] == kind and zones[here - cols] != mark
            if up and not above:
                stack[depth] = here + cols
                depth += 1
            if down and not below:
                stack[depth] = here - cols
                depth += 1
            above, below = up, down
            here += 1
