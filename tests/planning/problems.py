"""Problems of ordering subgoals, and plain solutions of them, for the tests of their solvers."""

from functools import cache
from itertools import permutations
from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

Vector = NDArray[np.float64]


class Numbers(NamedTuple):
    """The arguments of ``order_subgoals``."""

    robot: Vector
    pairs: Vector
    p: Vector
    success: Vector
    exploration: Vector


def draw_problem(seed: int, count: int, low_p: float = 0.0, high_p: float = 1.0) -> Numbers:
    """Subgoals scattered over a square of 50 m."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 50, (count, 2))
    pairs = np.linalg.norm(points[:, None] - points[None], axis=2)
    robot = np.linalg.norm(points - rng.uniform(0, 50, 2), axis=1)
    return Numbers(
        robot, pairs, rng.uniform(low_p, high_p, count), rng.uniform(0, 90, count), rng.uniform(0, 60, count)
    )


@st.composite
def edge_problems(draw: st.DrawFn, most: int) -> Numbers:
    """Few values, so many ties; sure and hopeless subgoals, costs of 0, ways that do not exist and no triangle rule."""
    count = draw(st.integers(1, most))
    rng = np.random.default_rng(draw(st.integers(0, 2**31)))
    no_way = draw(st.sampled_from([0.0, 0.1, 0.5]))
    legs = rng.integers(0, 6, (count + 1, count)).astype(float)
    legs[rng.random(legs.shape) < no_way] = np.inf
    p = rng.choice(draw(st.sampled_from([(0.0, 0.25, 0.5, 1.0), (0.25, 0.5), (0.0, 1.0), (1e-9, 1 - 1e-9)])), count)
    success = rng.choice((0.0, 1.0, 8.0, np.inf if no_way else 4.0), count)
    return Numbers(legs[count], legs[:count], p, success, rng.choice((0.0, 2.0, 4.0), count))


def plain_cost(order: tuple[int, ...], numbers: Numbers, penalty: float = 0.0) -> float:
    """Equation (4) along one ordering, where what cannot happen costs nothing even if it would cost inf."""
    cost, chance = 0.0, 1.0
    leg = numbers.robot
    for b in order:
        for weight, value in (
            (chance, leg[b]),
            (chance * numbers.p[b], numbers.success[b]),
            (chance * (1 - numbers.p[b]), numbers.exploration[b]),
        ):
            cost += weight * value if weight > 0 else 0.0
        chance *= 1 - numbers.p[b]
        leg = numbers.pairs[b]
    return float(cost + (chance * penalty if chance > 0 else 0.0))


def least_cost(numbers: Numbers) -> float:
    """The least cost of all orderings."""
    return min(plain_cost(order, numbers) for order in permutations(range(numbers.robot.size)))


def least_cost_by_subsets(numbers: Numbers) -> float:
    """The recursion of equation (4), remembering what it has met."""
    count = numbers.robot.size

    @cache
    def rest(last: int, untried: frozenset[int]) -> float:
        leg = numbers.robot if last < 0 else numbers.pairs[last]
        costs = []
        for b in untried:
            p, fail = float(numbers.p[b]), 1 - float(numbers.p[b])
            cost = float(leg[b]) + (p * float(numbers.success[b]) if p > 0 else 0.0)
            costs.append(cost + (fail * (float(numbers.exploration[b]) + rest(b, untried - {b})) if fail > 0 else 0.0))
        return min(costs, default=0.0)

    return rest(-1, frozenset(range(count)))
