"""The cheapest order of subgoals, exactly: a dynamic programme over subsets (LSP eq. 4).

With W(a, S) the expected cost that remains after exploring beyond subgoal ``a`` in vain while the set S is untried,

    W(a, {}) = failure_penalty
    W(a, S)  = min over b in S of  D(a, b) + P_b R_S(b) + (1 - P_b) [ R_E(b) + W(b, S - b) ]

so n subgoals cost n^2 2^n steps instead of the n! orderings. Equation (4) adds nothing once the subgoals are
exhausted, although the last one may fail too: that is ``failure_penalty = 0``.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

MOST_SUBGOALS = 16
Vector = NDArray[np.float64]


class Ordering(NamedTuple):
    """The best order in which to try subgoals, and its expected cost in the unit of the distances."""

    order: list[int]
    cost: float


def order_subgoals(
    robot_distance: Vector,
    pair_distance: Vector,
    p_success: Vector,
    success: Vector,
    exploration: Vector,
    *,
    failure_penalty: float = 0.0,
) -> Ordering:
    """Return the ordering of least expected cost. All costs share one unit.

    robot_distance: [n] from the robot to each subgoal; pair_distance: [n, n] between subgoals, by known space.
    p_success, success, exploration: [n] P_S, R_S and R_E of each subgoal.

    Raises:
        ValueError: no subgoal, or more than ``MOST_SUBGOALS``.
    """
    count = robot_distance.size
    if not 1 <= count <= MOST_SUBGOALS:
        raise ValueError(f"order_subgoals takes 1 to {MOST_SUBGOALS} subgoals, got {count}")
    order, cost = _solve(robot_distance, pair_distance, p_success, success, exploration, failure_penalty)
    return Ordering([int(subgoal) for subgoal in order], float(cost))


@njit(cache=True, nogil=True)
def _solve(
    robot_distance: Vector,
    pair_distance: Vector,
    p_success: Vector,
    success: Vector,
    exploration: Vector,
    failure_penalty: float,
) -> tuple[NDArray[np.int64], float]:
    count = robot_distance.size
    full = (1 << count) - 1
    gain = p_success * success + (1.0 - p_success) * exploration
    fail = 1.0 - p_success
    remaining = np.empty((full + 1, count))  # remaining[S, a] = W(a, S)
    choice = np.empty((full + 1, count), dtype=np.int8)
    remaining[0] = failure_penalty
    onward = np.empty(count)
    members = np.empty(count, dtype=np.int64)
    for subset in range(1, full + 1):
        size = 0
        for b in range(count):
            if subset >> b & 1:
                members[size] = b
                onward[size] = gain[b] + fail[b] * remaining[subset ^ (1 << b), b]
                size += 1
        for a in range(count):
            if subset >> a & 1:
                continue
            best = np.inf
            for k in range(size):
                cost = pair_distance[a, members[k]] + onward[k]
                if cost < best:
                    best = cost
                    choice[subset, a] = members[k]
            remaining[subset, a] = best
    best = np.inf
    first = 0
    for b in range(count):
        cost = robot_distance[b] + gain[b] + fail[b] * remaining[full ^ (1 << b), b]
        if cost < best:
            best, first = cost, b
    order = np.empty(count, dtype=np.int64)
    order[0] = first
    subset = full ^ (1 << first)
    for k in range(1, count):
        order[k] = choice[subset, order[k - 1]]
        subset ^= 1 << order[k]
    return order, best
