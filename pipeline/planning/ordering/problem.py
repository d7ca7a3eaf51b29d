"""What an ordering of subgoals costs: the numbers that the solver reads."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Indices = NDArray[np.int64]


class Problem(NamedTuple):
    """N subgoals to put in order; all costs are in the unit of the distances, and none is below 0.

    legs: [N + 1, N] distance from each subgoal, and in row N from the robot, to each subgoal; inf where there is no
        way, and from a subgoal to itself.
    gain: [N] P_S R_S + (1 - P_S) R_E, what a try costs once there, without what follows a failure.
    fail: [N] 1 - P_S.
    """

    legs: Vector
    gain: Vector
    fail: Vector


def state_problem(
    robot_distance: Vector, pair_distance: Vector, p_success: Vector, success: Vector, exploration: Vector
) -> Problem:
    """Return the problem as the kernels read it; the arguments are those of ``order_subgoals``."""
    count = robot_distance.size
    problem = Problem(np.empty((count + 1, count)), np.empty(count), np.empty(count))
    numbers = (robot_distance, pair_distance, p_success, success, exploration)
    _fill(*problem, *(np.ascontiguousarray(each, dtype=np.float64) for each in numbers))
    return problem


@njit(cache=True, nogil=True)
def _fill(
    legs: Vector,
    gain: Vector,
    fail: Vector,
    robot_distance: Vector,
    pair_distance: Vector,
    p_success: Vector,
    success: Vector,
    exploration: Vector,
) -> None:
    count = gain.size
    for b in range(count):
        for a in range(count):
            legs[a, b] = pair_distance[a, b] if a != b else np.inf
        legs[count, b] = robot_distance[b]
        fail[b] = 1.0 - p_success[b]
        gain[b] = p_success[b] * success[b] if p_success[b] > 0.0 else 0.0  # what cannot happen costs nothing,
        gain[b] += fail[b] * exploration[b] if fail[b] > 0.0 else 0.0  # be it inf
