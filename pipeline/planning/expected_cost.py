"""The order in which to try subgoals: the one of least expected cost (LSP eq. 4).

The cost of an ordering b1, b2, ... is D(b1) + P R_S + (1 - P) [R_E + the cost of b2, b3, ... from b1]. Equation (4)
adds nothing once the subgoals are exhausted, although the last one may fail too: that is ``failure_penalty = 0``. Any
other penalty is paid with the chance that all fail, which no order changes; it changes the cost and never the choice.

Up to ``MOST_EXACT`` subgoals are solved exactly, in the same time whatever the numbers (``ordering.exact``); more of
them by a search that knows how far from the best it can be (``ordering.search``).
"""

from typing import NamedTuple

from pipeline.planning.ordering import MOST_EXACT, MOST_SUBGOALS
from pipeline.planning.ordering.exact import solve_exactly
from pipeline.planning.ordering.problem import Vector, state_problem
from pipeline.planning.ordering.search import search_order


class Ordering(NamedTuple):
    """The best order found, its expected cost, and what no ordering falls below, in the unit of the distances.

    The cost equals the bound where the order is known to be the best.
    """

    order: list[int]
    cost: float
    bound: float


def order_subgoals(
    robot_distance: Vector,
    pair_distance: Vector,
    p_success: Vector,
    success: Vector,
    exploration: Vector,
    *,
    failure_penalty: float = 0.0,
    most_expanded: int = 100_000,
) -> Ordering:
    """Return the ordering of least expected cost, or a good one and a bound if that takes too long to find.

    All costs share one unit and are 0 or more; inf says that there is no way. Up to ``MOST_EXACT`` subgoals, of several
    that are equally good to try next the one with the lowest index comes first. Above, the result depends on the
    arguments alone, and of orderings that differ in cost by less than 1e-9 of it any may come out.

    robot_distance: [n] from the robot to each subgoal; pair_distance: [n, n] between subgoals, by known space.
    p_success, success, exploration: [n] P_S, R_S and R_E of each subgoal.
    failure_penalty: added when all have failed.
    most_expanded: nodes that the search may expand, 1 to 2 us and 150 bytes each; exact solutions do not need it.

    Raises:
        ValueError: no subgoal, or more than ``MOST_SUBGOALS``; a negative ``most_expanded``.
    """
    count = robot_distance.size
    if not 1 <= count <= MOST_SUBGOALS:
        raise ValueError(f"order_subgoals takes 1 to {MOST_SUBGOALS} subgoals, got {count}")
    if most_expanded < 0:
        raise ValueError(f"most_expanded is how many nodes a search may expand, 0 or more, got {most_expanded}")
    problem = state_problem(robot_distance, pair_distance, p_success, success, exploration)
    if count <= MOST_EXACT:
        order, cost = solve_exactly(problem)
        bound = cost
    else:
        order, cost, bound = search_order(problem, most_expanded)
    all_fail = float(problem.fail.prod())
    at_the_end = failure_penalty * all_fail if all_fail > 0.0 else 0.0
    return Ordering(order.tolist(), cost + at_the_end, bound + at_the_end)
