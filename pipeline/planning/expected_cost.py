"""The order in which to try subgoals: the one of least expected cost (LSP eq. 4).

The cost of an ordering b1, b2, ... is D(b1) + P R_S + (1 - P) [R_E + the cost of b2, b3, ... from b1]. Equation (4)
adds nothing once the subgoals are exhausted, although the last one may fail too: that is ``failure_penalty = 0``. Any
other penalty is paid with the chance that all fail, which no order changes; it changes the cost and never the choice.

Every order is exact, in a time that depends on how many subgoals there are and on nothing else (``ordering.exact``).
"""

from typing import NamedTuple

from pipeline.planning.ordering import MOST_SUBGOALS
from pipeline.planning.ordering.exact import solve_exactly
from pipeline.planning.ordering.problem import Vector, state_problem


class Ordering(NamedTuple):
    """The best order, and its expected cost in the unit of the distances."""

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
    """Return the ordering of least expected cost.

    All costs share one unit and are 0 or more; inf says that there is no way. Of several subgoals that are equally good
    to try next the one with the lowest index comes first.

    robot_distance: [n] from the robot to each subgoal; pair_distance: [n, n] between subgoals, by known space.
    p_success, success, exploration: [n] P_S, R_S and R_E of each subgoal.
    failure_penalty: added when all have failed.

    Raises:
        ValueError: no subgoal, or more than ``MOST_SUBGOALS``.
    """
    count = robot_distance.size
    if not 1 <= count <= MOST_SUBGOALS:
        raise ValueError(f"order_subgoals takes 1 to {MOST_SUBGOALS} subgoals, got {count}")
    problem = state_problem(robot_distance, pair_distance, p_success, success, exploration)
    order, cost = solve_exactly(problem)
    all_fail = float(problem.fail.prod())
    return Ordering(order.tolist(), cost + (failure_penalty * all_fail if all_fail > 0.0 else 0.0))
