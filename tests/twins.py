"""Slow, obvious twins of the kernels, written from their definitions."""

import heapq
from collections.abc import Iterable, Sequence
from itertools import pairwise, permutations

import numpy as np
from numpy.typing import NDArray

from pipeline.grids.occupancy import FREE
from pipeline.grids.partial_map import UNSEEN

MOVES = [(dr, dc) for dr in (-1, 0, 1) for dc in (-1, 0, 1) if (dr, dc) != (0, 0)]


def slow_field(
    passable: NDArray[np.bool_], row: int, col: int, others: Sequence[tuple[float, int, int]] = ()
) -> NDArray[np.float64]:
    """Dijkstra with a heap; a diagonal needs both cells beside it. ``others`` are more sources (offset, row, col)."""
    dist = np.full(passable.shape, np.inf)
    queue = []
    for offset, r, c in [(0.0, row, col), *others]:
        if passable[r, c] and offset < dist[r, c]:
            dist[r, c] = offset
            heapq.heappush(queue, (offset, r, c))
    while queue:
        here, r, c = heapq.heappop(queue)
        if here > dist[r, c]:
            continue
        for dr, dc in MOVES:
            if not passable[r + dr, c + dc]:
                continue
            if dr and dc and not (passable[r + dr, c] and passable[r, c + dc]):
                continue
            there = here + np.hypot(dr, dc)
            if there < dist[r + dr, c + dc] - 1e-12:
                dist[r + dr, c + dc] = there
                heapq.heappush(queue, (there, r + dr, c + dc))
    return dist


def slow_range(cells: NDArray[np.uint8], row: int, col: int, direction: Sequence[float], max_range: float) -> float:
    """Nearest entry of the ray into any cell that is not free: every cell of the grid is tried as a box."""
    best = max_range
    origin = np.array([col + 0.5, row + 0.5])
    for r, c in np.argwhere(cells != FREE):
        with np.errstate(divide="ignore", invalid="ignore"):
            near = (np.array([c, r]) - origin) / np.array(direction)
            far = (np.array([c + 1, r + 1]) - origin) / np.array(direction)
        low, high = np.fmin(near, far), np.fmax(near, far)
        for axis in range(2):
            if direction[axis] == 0.0:
                inside = (c, r)[axis] < origin[axis] < (c, r)[axis] + 1
                low[axis], high[axis] = (-np.inf, np.inf) if inside else (np.inf, -np.inf)
        enter, leave = low.max(), high.min()
        if enter < leave and leave > 0.0:
            best = min(best, max(enter, 0.0))
    return float(best)


def slow_components(cells: Iterable[tuple[int, int]], moves: Sequence[tuple[int, int]]) -> list[set[tuple[int, int]]]:
    """Connected components of a set of cells under ``moves``."""
    left = set(cells)
    found = []
    while left:
        todo = [left.pop()]
        component = set(todo)
        while todo:
            r, c = todo.pop()
            for dr, dc in moves:
                if (r + dr, c + dc) in left:
                    left.remove((r + dr, c + dc))
                    component.add((r + dr, c + dc))
                    todo.append((r + dr, c + dc))
        found.append(component)
    return found


def slow_expected_cost(
    order: Sequence[int],
    robot: NDArray[np.float64],
    pairs: NDArray[np.float64],
    p: NDArray[np.float64],
    success: NDArray[np.float64],
    exploration: NDArray[np.float64],
    penalty: float,
) -> float:
    """Equation (4) along one ordering."""
    if not order:
        return penalty
    first, rest = order[0], order[1:]
    onward = slow_expected_cost(rest, pairs[first], pairs, p, success, exploration, penalty)
    return float(robot[first] + p[first] * success[first] + (1 - p[first]) * (exploration[first] + onward))


def slow_best_order(
    robot: NDArray[np.float64],
    pairs: NDArray[np.float64],
    p: NDArray[np.float64],
    success: NDArray[np.float64],
    exploration: NDArray[np.float64],
    penalty: float,
) -> tuple[tuple[int, ...], float]:
    """Try every ordering."""
    costs = {
        order: slow_expected_cost(order, robot, pairs, p, success, exploration, penalty)
        for order in permutations(range(robot.size))
    }
    best = min(costs, key=costs.__getitem__)
    return best, costs[best]


def slow_path_is_sound(path: Sequence[int], status: NDArray[np.uint8], robot: int) -> bool:
    """Whether a robot may set out on ``path``: by rows and columns, one rule after the other."""
    rows, cols = status.shape
    if len(path) == 0 or path[0] != robot or any(not 0 <= cell < rows * cols for cell in path):
        return False
    places = [divmod(int(cell), cols) for cell in path]
    for (r, c), (to_r, to_c) in pairwise(places):
        if (to_r - r, to_c - c) not in MOVES:
            return False
        if any(status[cell] > UNSEEN for cell in ((to_r, to_c), (r, to_c), (to_r, c))):
            return False
    return True
