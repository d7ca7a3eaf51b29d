"""A best-first search for the cheapest ordering, which may stop early and then says how far off it can be.

A node is the beginning of an ordering, and its bound the least that an ordering with this beginning can cost by
``ordering.bound``. The node of the least bound is expanded first, so that bound holds for all orderings not yet seen:
it is what the search proves, and it only rises. Of beginnings that try the same set and end alike only the cheapest is
kept. A node makes its children one at a time, each when the one before it is expanded; so there are never more than two
nodes per expansion.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.planning.ordering.bound import Grid, Routes, next_best
from pipeline.planning.ordering.prices import price_subgoals
from pipeline.planning.ordering.problem import Indices, Problem

SAME = 1e-9  # relative difference of costs below which one ordering is as good as the other
_NODE = np.dtype(
    [
        ("tried", np.int64),  # set of subgoals as bits
        ("last", np.int64),  # subgoal tried last; N for none
        ("used", np.int64),  # cell of the load
        ("parent", np.int64),
        ("chance", np.float64),  # that all of them fail
        ("cost", np.float64),  # expected up to there
        ("owed", np.float64),  # sum of the prices of the subgoals left
        ("rank", np.float64),  # among its siblings: what the cheapest route by it costs, seen from the parent
        ("bound", np.float64),
    ]
)
Nodes = NDArray[np.void]


def search_order(problem: Problem, most_expanded: int) -> tuple[Indices, float, float]:
    """Return the best ordering found, its cost, and a cost that no ordering falls below.

    The two are equal if the search came to its end within ``most_expanded`` nodes, each of which takes 150 bytes; then
    no ordering is better by more than a share of ``SAME``. The same arguments give the same ordering, and more nodes
    never give a wider gap.
    """
    grid, routes, bound, order, cost = price_subgoals(problem)
    if not np.isfinite(bound):
        return order, cost, bound
    nodes = np.empty(2 * most_expanded + 2, dtype=_NODE)
    nodes[0] = (0, problem.gain.size, 0, -1, 1.0, 0.0, routes.price.sum(), 0.0, bound)
    met = np.zeros(1 << (2 * most_expanded).bit_length(), dtype=np.int32)
    cost, bound = _search(problem, grid, routes, nodes, met, order, cost, most_expanded)
    return order, float(cost), float(bound)


@njit(cache=True, nogil=True)
def _search(
    problem: Problem,
    grid: Grid,
    routes: Routes,
    nodes: Nodes,
    met: NDArray[np.int32],
    order: Indices,
    cost: float,
    most_expanded: int,
) -> tuple[float, float]:
    """Improve ``order`` and its ``cost``; return the cost and the bound."""
    count = problem.gain.size
    heap = np.zeros(nodes.size, dtype=np.int32)
    waiting = made = 1
    for _ in range(most_expanded):
        if waiting == 0 or nodes[heap[0]].bound >= cost * (1.0 - SAME):
            break
        node = _pop(heap, waiting, nodes)
        waiting -= 1
        for sibling in (False, True):
            parent, above, beyond = node, -np.inf, -1
            if sibling:
                parent, above, beyond = nodes[node].parent, nodes[node].rank, nodes[node].last
            elif not _is_news(nodes, met, node):
                continue
            if parent < 0 or not _make_child(problem, grid, routes, nodes, made, parent, above, beyond):
                continue
            if nodes[made].bound >= cost * (1.0 - SAME):
                continue
            if nodes[made].tried == (1 << count) - 1:
                if nodes[made].cost < cost:
                    cost = nodes[made].cost
                    at = made
                    for k in range(count - 1, -1, -1):
                        order[k] = nodes[at].last
                        at = nodes[at].parent
            else:
                _push(heap, waiting, nodes, made)
                waiting += 1
                made += 1
    if waiting == 0 or nodes[heap[0]].bound >= cost * (1.0 - SAME):
        return cost, cost
    return cost, nodes[heap[0]].bound


@njit(inline="always")
def _make_child(
    problem: Problem, grid: Grid, routes: Routes, nodes: Nodes, made: int, at: int, above: float, beyond: int
) -> bool:
    """Write the next child of node ``at`` to place ``made``; return whether there is one."""
    legs, gain, fail = problem
    parent, child = nodes[at], nodes[made]
    b, rank = next_best(legs, routes, parent.last, parent.used, parent.tried, parent.tried, above, beyond)
    if b >= 0:
        child.tried = parent.tried | (1 << b)
        child.last = b
        child.used = min(parent.used + grid.steps[b], grid.lightest.size - 1)
        child.parent = at
        child.chance = parent.chance * fail[b]
        child.owed = parent.owed - routes.price[b]
        child.rank = rank
        cost, bound = parent.cost, parent.cost - parent.owed
        if parent.chance > 0.0:
            cost += parent.chance * (legs[parent.last, b] + gain[b])
            bound += parent.chance * rank
        child.cost = cost
        # Siblings must come by rising bound, so their own costs, which may fall, count for their children only.
        child.bound = max(bound, parent.bound, parent.cost)
    return b >= 0


@njit(inline="always")
def _is_news(nodes: Nodes, met: NDArray[np.int32], node: int) -> bool:
    """Note ``node`` in the table ``met`` unless a node of the same set and end that costs no more is there."""
    tried, last = nodes[node].tried, nodes[node].last
    slot = tried * 0x9E3779B97F4A7C1 ^ last * 0x5851F42D4C957F2D
    slot = (slot ^ slot >> 29) & (met.size - 1)
    news = True
    while met[slot] > 0:
        other = nodes[met[slot]]
        if other.tried == tried and other.last == last:
            news = nodes[node].cost < other.cost
            break
        slot = (slot + 1) & (met.size - 1)
    if news:
        met[slot] = node
    return news


@njit(inline="always")
def _comes_first(nodes: Nodes, one: int, other: int) -> bool:
    """Return whether to expand ``one`` before ``other``: by bound, and of equal ones the newer, which is deeper."""
    return nodes[one].bound < nodes[other].bound or (nodes[one].bound == nodes[other].bound and one > other)


@njit(inline="always")
def _push(heap: NDArray[np.int32], size: int, nodes: Nodes, node: int) -> None:
    at = size
    while at > 0 and _comes_first(nodes, node, heap[(at - 1) >> 1]):
        heap[at] = heap[(at - 1) >> 1]
        at = (at - 1) >> 1
    heap[at] = node


@njit(inline="always")
def _pop(heap: NDArray[np.int32], size: int, nodes: Nodes) -> int:
    top, node = heap[0], heap[size - 1]
    at, child = 0, 1
    while child < size - 1:
        if child + 1 < size - 1 and _comes_first(nodes, heap[child + 1], heap[child]):
            child += 1
        if _comes_first(nodes, node, heap[child]):
            break
        heap[at] = heap[child]
        at, child = child, 2 * child + 1
    heap[at] = node
    return int(top)
