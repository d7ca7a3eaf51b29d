"""A* on a grid whose cells cost differently, over the whole of it or within some of its regions.

Metric: 8-connected; a step costs its length (1, or sqrt(2) diagonally) times the mean weight of its two cells. Weights
are at least 1, so the octile distance never overestimates. A diagonal step needs both cells beside it, and never passes
between two regions that touch in a corner only. With weights in sixteenths sums are exact in float64, as in
`pipeline.grids.distances`: equal costs are equal bits, whichever way they were added up.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.distances import DIAGONAL, Indices

Weights = NDArray[np.float32]  # [cells] flat: at least 1, or 0 where a cell is not passable
Regions = NDArray[np.int32]


class SearchRoom(NamedTuple):
    """Room for one search after another on grids of one size; a search costs what it touches, not the whole grid.

    cost: [cells] of the best way found. came: [cells] the cell before. state: [cells] twice the number of the search,
    plus one once the cell is final. keys, costs, cells: the heap, ordered by keys. number: [1] of the last search.
    """

    cost: NDArray[np.float64]
    came: Indices
    state: Indices
    keys: NDArray[np.float64]
    costs: NDArray[np.float64]
    cells: Indices
    number: Indices


def search_room(cells: int) -> SearchRoom:
    """Return room for grids of ``cells`` cells."""
    heap = 4 * cells + 16  # a cell enters once for each time its cost falls, on average far less than twice
    return SearchRoom(
        np.empty(cells),
        np.empty(cells, np.int32),
        np.zeros(cells, np.int32),
        np.empty(heap),
        np.empty(heap),
        np.empty(heap, np.int32),
        np.zeros(1, np.int32),
    )


@njit(cache=True, nogil=True)
def _before(keys: NDArray[np.float64], costs: NDArray[np.float64], one: int, other: int) -> bool:
    """Return whether entry ``one`` of the heap comes first: the lesser key, then the one farther along."""
    return bool(keys[one] < keys[other] or (keys[one] == keys[other] and costs[one] > costs[other]))


@njit(cache=True, nogil=True)
def _swap(room: SearchRoom, one: int, other: int) -> None:
    keys, costs, cells = room.keys, room.costs, room.cells
    keys[one], keys[other] = keys[other], keys[one]
    costs[one], costs[other] = costs[other], costs[one]
    cells[one], cells[other] = cells[other], cells[one]


@njit(cache=True, nogil=True)
def _push(room: SearchRoom, size: int, key: float, cost: float, cell: int) -> int:
    room.keys[size], room.costs[size], room.cells[size] = key, cost, cell
    at = size
    while at > 0:
        above = (at - 1) >> 1
        if not _before(room.keys, room.costs, at, above):
            break
        _swap(room, at, above)
        at = above
    return size + 1


@njit(cache=True, nogil=True)
def _pop(room: SearchRoom, size: int) -> int:
    """Move the first entry behind the heap, at ``size - 1``, and return the size left."""
    size -= 1
    _swap(room, 0, size)
    at = 0
    while True:
        below = 2 * at + 1
        if below >= size:
            return size
        if below + 1 < size and _before(room.keys, room.costs, below + 1, below):
            below += 1
        if not _before(room.keys, room.costs, below, at):
            return size
        _swap(room, at, below)
        at = below


@njit(cache=True, nogil=True)
def _octile(row: int, col: int, goal_row: int, goal_col: int) -> float:
    down, along = abs(row - goal_row), abs(col - goal_col)
    return float(max(down, along) - min(down, along) + DIAGONAL * min(down, along))


@njit(cache=True, nogil=True)
def least_cost(
    weights: Weights, regions: Regions, allowed: NDArray[np.bool_], cols: int, start: int, goal: int, room: SearchRoom
) -> tuple[float, int]:
    """Return the least cost of a way from ``start`` to ``goal`` (flat cells) and how many cells were expanded.

    weights, regions: [cells] flat, the outermost ring not passable. allowed: [regions] where the way may lead.
    The cost is inf where there is no way. `way_back` then reads the way from ``room``.
    """
    room.number[0] += 1
    opened = 2 * room.number[0]
    closed = opened + 1
    state, cost, came = room.state, room.cost, room.came
    goal_row, goal_col = goal // cols, goal % cols
    steps = (cols, -cols, 1, -1, cols + 1, cols - 1, -cols + 1, -cols - 1)
    expanded, size = 0, 0
    if weights[start] == 0.0 or weights[goal] == 0.0 or not (allowed[regions[start]] and allowed[regions[goal]]):
        return np.inf, 0
    cost[start], came[start], state[start] = 0.0, start, opened
    size = _push(room, size, _octile(start // cols, start % cols, goal_row, goal_col), 0.0, start)
    while size > 0:
        size = _pop(room, size)
        cell = room.cells[size]
        if state[cell] == closed:
            continue
        state[cell] = closed
        expanded += 1
        if cell == goal:
            return cost[goal], expanded
        here, weight = cost[cell], weights[cell]
        for move in range(8):
            there = cell + steps[move]
            if weights[there] == 0.0 or not allowed[regions[there]] or state[there] == closed:
                continue
            length = 1.0
            if move >= 4:
                down = cell + (cols if move < 6 else -cols)
                along = cell + (1 if move % 2 == 0 else -1)
                if weights[down] == 0.0 or weights[along] == 0.0:
                    continue
                if regions[there] != regions[down] and regions[there] != regions[along]:
                    continue
                length = DIAGONAL
            found = here + length * 0.5 * (weight + weights[there])
            if state[there] != opened or found < cost[there]:
                cost[there], came[there], state[there] = found, cell, opened
                key = found + _octile(there // cols, there % cols, goal_row, goal_col)
                size = _push(room, size, key, found, there)
    return np.inf, expanded


@njit(cache=True, nogil=True)
def way_back(room: SearchRoom, start: int, goal: int) -> Indices:
    """Return the way that the last search found, from ``start`` to ``goal``: [k] flat cells."""
    count, cell = 1, goal
    while cell != start:
        cell = room.came[cell]
        count += 1
    way = np.empty(count, np.int32)
    cell = goal
    for place in range(count - 1, -1, -1):
        way[place] = cell
        cell = room.came[cell]
    return way


@njit(cache=True, nogil=True)
def step_costs(weights: Weights, cols: int, way: Indices) -> NDArray[np.float64]:
    """Return the cost of each step of ``way``: [k - 1]."""
    costs = np.empty(max(0, way.size - 1))
    for step in range(costs.size):
        apart = abs(way[step + 1] - way[step])
        length = 1.0 if apart in (1, cols) else DIAGONAL
        costs[step] = length * 0.5 * (weights[way[step]] + weights[way[step + 1]])
    return costs
