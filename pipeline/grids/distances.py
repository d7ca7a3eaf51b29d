"""Exact shortest travel distances on a grid.

Metric: 8-connected, a straight move costs 1 cell, a diagonal one sqrt(2), and a diagonal move needs both cells
beside it, so a path never cuts a corner. The queue is a ring of three buckets of width 1: as no move is shorter
than a bucket is wide, every cell taken from the lowest bucket is final (Dial 1969).

A field is a flat array of float64, one value for each cell: its distance [cells], inf where none was found, SHUT where
the cell is not passable. One array thus answers both questions that the inner loop asks of a neighbour. The outermost
ring of the grid is never passable. ``pipeline.grids.repair`` keeps a field true while the grid changes.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# The square root of 2 to 34 binary places. Sums of such moves are then exact in float64 for paths below 2^18 cells, in
# whatever order they are added: a distance is the same bits from either end, and ties are ties. It is off by 2e-11.
DIAGONAL = round(2.0**34.5) / 2.0**34
SHUT = -1.0

Field = NDArray[np.float64]
Status = NDArray[np.uint8]
Indices = NDArray[np.int32]


class Workspace(NamedTuple):
    """Room for the kernels to work in, made once for a grid: they leave nothing in it for one another.

    ring: [48 x cells] int32, the three buckets. trail: [16 x cells] int32, all cells that the last search gave a
        distance, settled ones first.
    stack: [8 x cells] int32. lost: [3 x cells] int32.
    """

    ring: Indices
    trail: Indices
    stack: Indices
    lost: Indices


def workspace_for(cells: int) -> Workspace:
    """Return room for grids of ``cells`` cells; memory that is never touched costs nothing."""
    ring, trail, stack, lost = (np.empty(times * cells, dtype=np.int32) for times in (48, 16, 8, 3))
    return Workspace(ring, trail, stack, lost)


NOWHERE = np.empty(0, dtype=np.int32)


@njit(cache=True, nogil=True, inline="always")
def wide(cell: int) -> int:
    """Return ``cell`` as int64, so that a kernel is compiled once and not for each kind of whole number."""
    return cell + 0


def travel_field(traversable: NDArray[np.bool_], row: int, col: int) -> Field:
    """Return the travel distance [cells] from (row, col) to every cell: [rows, cols] float64, inf if unreachable.

    Raises:
        ValueError: the outermost ring of ``traversable`` is not closed.
    """
    ring = (traversable[0], traversable[-1], traversable[:, 0], traversable[:, -1])
    if any(bool(edge.any()) for edge in ring):
        raise ValueError("travel_field needs a closed outermost ring: pad the grid with one blocked cell")
    rows, cols = traversable.shape
    field = open_field((~traversable).astype(np.uint8), 0)
    settle(field, cols, row * cols + col, NOWHERE, workspace_for(field.size))
    return np.where(field == SHUT, np.inf, field).reshape(rows, cols)


@njit(cache=True, nogil=True)
def open_field(status: Status, limit: int) -> Field:
    """Return the field of ``status`` [rows, cols] in which nothing is settled: inf where it is at most ``limit``."""
    field = np.empty(status.size)
    flat = status.ravel()
    for cell in range(flat.size):
        field[cell] = np.inf if flat[cell] <= limit else SHUT
    return field


@njit(cache=True, nogil=True)
def reopen(field: Field, status: Status, limit: int, trail: Indices, changed: Indices) -> None:
    """Make ``field`` an open one again: clear the ``trail`` of the last search, take in the status of ``changed``."""
    flat = status.ravel()
    for cell in trail:
        field[cell] = np.inf
    for cell in changed:
        field[cell] = np.inf if flat[cell] <= limit else SHUT


@njit(cache=True, nogil=True)
def settle(field: Field, cols: int, source: int, targets: Indices, work: Workspace) -> int:
    """Settle an open ``field`` from the flat cell ``source``; return the length of the trail.

    With ``targets`` (flat cells) the search ends once all of them are final; cells farther away may then hold an upper
    bound or inf. Without, it runs until everything reachable is final.
    """
    if field[source] != np.inf:
        return 0
    field[source] = 0.0
    return spread(field, cols, np.full(1, source, np.int32), targets, work, np.bool_(False))


@njit(cache=True, nogil=True)
def spread(  # noqa: PLR0915  # one loop: a call per cell would cost more than the work on it
    field: Field, cols: int, seeds: Indices, targets: Indices, work: Workspace, anew: np.bool_
) -> int:
    """Spread the values of ``seeds`` over ``field``, wherever they lessen a distance; return the length of the trail.

    seeds: flat cells whose values are set, in order of the whole number of cells in them (``by_level``).
    targets: as in ``settle``.
    anew: cells besides the seeds already have distances, which may be lessened; the trail may then name cells twice.
    """
    ring, trail = work.ring, work.trail
    room = ring.size // 3
    row, one = np.uintp(cols), np.uintp(1)  # unsigned, or each access would ask whether the index is negative
    counts = np.zeros(3, dtype=np.int64)
    settled, entered, awaited = 0, 0, 0
    level = int(field[seeds[0]]) if seeds.size else 0
    while entered < seeds.size or counts[0] + counts[1] + counts[2] > 0:
        now, soon, late = level % 3, (level + 1) % 3, (level + 2) % 3
        while entered < seeds.size and field[seeds[entered]] < level + 1.0:
            ring[now * room + counts[now]] = seeds[entered]
            counts[now] += 1
            entered += 1
        for k in range(counts[now]):
            cell = np.uintp(ring[now * room + k])
            here = field[cell]
            if here < level:  # it was lessened into an earlier bucket, and is settled
                continue
            trail[settled] = cell
            settled += 1
            north, east = field[cell + row], field[cell + one]
            south, west = field[cell - row], field[cell - one]
            there = here + 1.0
            if there < north:
                field[cell + row] = there
                if anew or north >= level + 2.0:
                    ring[soon * room + counts[soon]] = cell + row
                    counts[soon] += 1
            if there < east:
                field[cell + one] = there
                if anew or east >= level + 2.0:
                    ring[soon * room + counts[soon]] = cell + one
                    counts[soon] += 1
            if there < south:
                field[cell - row] = there
                if anew or south >= level + 2.0:
                    ring[soon * room + counts[soon]] = cell - row
                    counts[soon] += 1
            if there < west:
                field[cell - one] = there
                if anew or west >= level + 2.0:
                    ring[soon * room + counts[soon]] = cell - one
                    counts[soon] += 1
            there = here + DIAGONAL
            bucket = soon if there < level + 2.0 else late
            bound = level + 2.0 if bucket == soon else level + 3.0
            if north >= 0.0 and east >= 0.0:
                old = field[cell + row + one]
                if there < old:
                    field[cell + row + one] = there
                    if anew or old >= bound:
                        ring[bucket * room + counts[bucket]] = cell + row + one
                        counts[bucket] += 1
            if north >= 0.0 and west >= 0.0:
                old = field[cell + row - one]
                if there < old:
                    field[cell + row - one] = there
                    if anew or old >= bound:
                        ring[bucket * room + counts[bucket]] = cell + row - one
                        counts[bucket] += 1
            if south >= 0.0 and east >= 0.0:
                old = field[cell - row + one]
                if there < old:
                    field[cell - row + one] = there
                    if anew or old >= bound:
                        ring[bucket * room + counts[bucket]] = cell - row + one
                        counts[bucket] += 1
            if south >= 0.0 and west >= 0.0:
                old = field[cell - row - one]
                if there < old:
                    field[cell - row - one] = there
                    if anew or old >= bound:
                        ring[bucket * room + counts[bucket]] = cell - row - one
                        counts[bucket] += 1
        counts[now] = 0
        while awaited < targets.size and 0.0 <= field[targets[awaited]] < level + 1.0:
            awaited += 1
        if targets.size and awaited == targets.size:
            for bucket in range(3):
                for k in range(counts[bucket]):
                    trail[settled] = ring[bucket * room + k]
                    settled += 1
            break
        level += 1
    return settled


@njit(cache=True, nogil=True)
def by_level(field: Field, cells: Indices) -> Indices:
    """Return ``cells`` in order of the whole number of cells in their distance: what ``spread`` wants of its seeds."""
    if cells.size == 0:
        return cells
    low, high = np.inf, 0.0
    for cell in cells:
        low, high = min(low, field[cell]), max(high, field[cell])
    first = int(low)
    places = np.zeros(int(high) - first + 2, dtype=np.int64)
    for cell in cells:
        places[int(field[cell]) - first + 1] += 1
    for level in range(1, places.size):
        places[level] += places[level - 1]
    ordered = np.empty_like(cells)
    for cell in cells:
        level = int(field[cell]) - first
        ordered[places[level]] = cell
        places[level] += 1
    return ordered


@njit(cache=True, nogil=True)
def descend(field: Field, cols: int, start: int, source: int) -> Indices:
    """Return the flat cells of a shortest path from ``start`` down to the ``source`` of ``field``: [k] int32.

    Among equal moves the first in a fixed order is taken, straight ones before diagonal ones. Empty if ``start`` was
    not reached.
    """
    path = np.empty(field.size, dtype=np.int32)
    if not 0.0 <= field[start] < np.inf:
        return path[:0].copy()
    steps = np.array([cols, -cols, 1, -1, cols + 1, cols - 1, -cols + 1, -cols - 1], dtype=np.int64)
    cell = start
    count = 1
    path[0] = start
    while cell != source:
        best, best_cost = cell, np.inf
        for move in range(8):
            other = cell + steps[move]
            if field[other] < 0.0:
                continue
            if move >= 4:
                vertical = cols if steps[move] > 0 else -cols
                if field[cell + vertical] < 0.0 or field[other - vertical] < 0.0:
                    continue
            cost = field[other] + (1.0 if move < 4 else DIAGONAL)
            if cost < best_cost:
                best, best_cost = other, cost
        cell = best
        path[count] = cell
        count += 1
    return path[:count].copy()
