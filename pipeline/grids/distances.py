"""Exact shortest travel distances on a grid.

Metric: 8-connected, a straight move costs 1 cell, a diagonal one sqrt(2), and a diagonal move needs both cells
beside it, so a path never cuts a corner. The queue is a ring of three buckets of width 1: as no move is shorter
than a bucket is wide, every cell taken from the lowest bucket is final (Dial 1969).

Kernels take a ``status`` array [rows, cols] uint8 whose outermost ring is not passable; a cell is passable where
``status <= limit``. See ``pipeline.grids.partial_map`` for the values.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

# The square root of 2 to 34 binary places. Sums of such moves are then exact in float64 for paths below 2^18 cells, in
# whatever order they are added: a distance is the same bits from either end, and ties are ties. It is off by 2e-11.
DIAGONAL = round(2.0**34.5) / 2.0**34
Field = NDArray[np.float64]
Status = NDArray[np.uint8]


def travel_field(traversable: NDArray[np.bool_], row: int, col: int) -> Field:
    """Return the travel distance [cells] from (row, col) to every cell: [rows, cols] float64, inf if unreachable.

    Raises:
        ValueError: the outermost ring of ``traversable`` is not closed.
    """
    ring = (traversable[0], traversable[-1], traversable[:, 0], traversable[:, -1])
    if any(bool(edge.any()) for edge in ring):
        raise ValueError("travel_field needs a closed outermost ring: pad the grid with one blocked cell")
    status = (~traversable).astype(np.uint8)
    return settle(status, 0, row * status.shape[1] + col, NO_TARGETS)


NO_TARGETS = np.empty(0, dtype=np.int32)


@njit(cache=True, nogil=True)
def settle(status: Status, limit: int, source: int, targets: NDArray[np.int32]) -> Field:
    """Return distances [cells] from the flat index ``source`` over cells with ``status <= limit``.

    With ``targets`` (flat indices) the search ends once all of them are final; cells farther away may then hold
    an upper bound or inf. Without, it runs until everything reachable is final.
    """
    return settle_from(status, limit, np.full(1, source, np.int32), np.zeros(1), targets)


@njit(cache=True, nogil=True)
def settle_from(  # noqa: PLR0915  # one loop: a call per cell would cost more than the work on it
    status: Status,
    limit: int,
    sources: NDArray[np.int32],
    offsets: NDArray[np.float64],
    targets: NDArray[np.int32],
) -> Field:
    """Return distances as ``settle`` does, from several flat ``sources``.

    offsets: [sources] distances [cells] at which they start, ascending.
    """
    rows, cols = status.shape
    size = rows * cols
    flat = status.ravel()
    dist = np.full(size, np.inf)
    buckets = np.empty(3 * size, dtype=np.int32)  # three stacks in a row; flat indexing keeps the loop fast
    counts = np.zeros(3, dtype=np.int64)
    straight = np.array([cols, 1, -cols, -1], dtype=np.int64)
    diagonal = np.array([cols + 1, 1 - cols, -cols - 1, cols - 1], dtype=np.int64)  # k lies between straight k, k + 1
    waiting = np.zeros(size if targets.size else 1, dtype=np.uint8)
    missing = 0
    for target in targets:
        if waiting[target] == 0:
            waiting[target] = 1
            missing += 1
    entered, pending, level = 0, 0, 0
    while pending > 0 or entered < sources.size:
        ring = level % 3
        following = (level + 1) % 3
        while entered < sources.size and int(offsets[entered]) <= level:
            source, start = sources[entered], offsets[entered]
            entered += 1
            if flat[source] <= limit and start < dist[source]:
                if dist[source] == np.inf or int(dist[source]) != level:
                    buckets[ring * size + counts[ring]] = source
                    counts[ring] += 1
                    pending += 1
                dist[source] = start
        for k in range(counts[ring]):
            cell = buckets[ring * size + k]
            here = dist[cell]
            if int(here) != level:  # it was improved into an earlier bucket and is final already
                continue
            if missing > 0 and waiting[cell] == 1:
                waiting[cell] = 0
                missing -= 1
            clear = 0  # bit m: the straight move m is possible; bit 4 repeats bit 0
            there = here + 1.0
            for move in range(4):
                other = cell + straight[move]
                if flat[other] <= limit:
                    clear |= 1 << move
                    old = dist[other]
                    if there < old:
                        dist[other] = there
                        if old == np.inf or int(old) != level + 1:
                            buckets[following * size + counts[following]] = other
                            counts[following] += 1
                            pending += 1
            clear |= (clear & 1) << 4
            there = here + DIAGONAL
            for move in range(4):
                if (clear >> move) & 3 != 3:
                    continue
                other = cell + diagonal[move]
                if flat[other] <= limit and there < dist[other]:
                    old = dist[other]
                    dist[other] = there
                    bucket = int(there)
                    if old == np.inf or int(old) != bucket:
                        slot = bucket % 3
                        buckets[slot * size + counts[slot]] = other
                        counts[slot] += 1
                        pending += 1
        pending -= counts[ring]
        counts[ring] = 0
        if targets.size > 0 and missing == 0:
            break
        level += 1
    return dist.reshape(rows, cols)


@njit(cache=True, nogil=True)
def descend(field: Field, status: Status, limit: int, start: int) -> NDArray[np.int32]:
    """Return the flat cells of a shortest path from ``start`` down to the source of ``field``: [k] int32.

    ``field`` comes from ``settle`` with the same ``status`` and ``limit``. Among equal moves the first in a fixed
    order is taken, straight ones before diagonal ones. Empty if ``start`` was not reached.
    """
    rows, cols = status.shape
    flat = status.ravel()
    dist = field.ravel()
    path = np.empty(rows * cols, dtype=np.int32)
    if dist[start] == np.inf:
        return path[:0]
    steps = np.array([cols, -cols, 1, -1, cols + 1, cols - 1, -cols + 1, -cols - 1], dtype=np.int64)
    cell = start
    count = 1
    path[0] = start
    while dist[cell] > 0.0:
        best = cell
        best_cost = np.inf
        for move in range(8):
            other = cell + steps[move]
            if flat[other] > limit:
                continue
            if move >= 4:
                vertical = cols if steps[move] > 0 else -cols
                if flat[cell + vertical] > limit or flat[other - vertical] > limit:
                    continue
            cost = dist[other] + (1.0 if move < 4 else DIAGONAL)
            if cost < best_cost - 1e-9:
                best, best_cost = other, cost
        cell = best
        path[count] = cell
        count += 1
    return path[:count].copy()


@njit(cache=True, nogil=True)
def pair_distances(status: Status, limit: int, cells: NDArray[np.int32]) -> Field:
    """Return the symmetric travel distances [cells] between the flat ``cells``: [n, n] float64."""
    count = cells.size
    pairs = np.zeros((count, count))
    for i in range(count - 1):
        dist = settle(status, limit, cells[i], cells[i + 1 :]).ravel()
        for j in range(i + 1, count):
            pairs[i, j] = dist[cells[j]]
            pairs[j, i] = dist[cells[j]]
    return pairs
