"""The order of least expected cost."""

import warnings
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.planning.expected_cost import order_subgoals
from pipeline.planning.ordering import MOST_SUBGOALS
from tests.planning.problems import (
    Numbers,
    draw_problem,
    edge_problems,
    least_cost,
    least_cost_by_subsets,
    plain_cost,
)
from tests.twins import slow_best_order, slow_expected_cost


@settings(deadline=None, max_examples=150)
@given(st.integers(0, 2**31), st.integers(1, 6), st.sampled_from([0.0, 25.0]))
def test_equals_every_ordering_tried(seed: int, count: int, penalty: float) -> None:
    numbers = draw_problem(seed, count)
    found = order_subgoals(*numbers, failure_penalty=penalty)
    _, cost = slow_best_order(*numbers, penalty)
    assert found.cost == pytest.approx(cost, rel=1e-9)
    assert sorted(found.order) == list(range(count))
    assert slow_expected_cost(found.order, *numbers, penalty) == pytest.approx(cost, rel=1e-9)


def test_equals_every_ordering_of_seven() -> None:
    numbers = draw_problem(7, 7)
    assert order_subgoals(*numbers).cost == pytest.approx(slow_best_order(*numbers, 0.0)[1], rel=1e-9)


@settings(deadline=None, max_examples=200)
@given(edge_problems(most=6))
def test_sure_hopeless_free_and_unreachable_subgoals(numbers: Numbers) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = order_subgoals(*numbers)
    assert found.cost == pytest.approx(least_cost(numbers), rel=1e-9)
    assert plain_cost(tuple(found.order), numbers) == pytest.approx(found.cost, rel=1e-9)


# Five subgoals share a block of subsets; from six on there are several.
@pytest.mark.parametrize("count", [5, 6, 7, 8, 9, 10, 11, 12])
def test_equals_the_recursion_over_subsets(count: int) -> None:
    for seed, high_p in ((count, 1.0), (count + 100, 0.2)):
        numbers = draw_problem(seed, count, high_p=high_p)
        found = order_subgoals(*numbers)
        assert found.cost == pytest.approx(least_cost_by_subsets(numbers), rel=1e-9)
        assert plain_cost(tuple(found.order), numbers) == pytest.approx(found.cost, rel=1e-9)


def test_a_worked_example() -> None:
    # Near dead end (P 0.1) before a sure way: 1 + 0.1*5 + 0.9*(4 + 3 + 10) = 16.8; the sure way first: 2 + 10 = 12.
    found = order_subgoals(
        np.array([1.0, 2.0]),
        np.array([[0.0, 3.0], [3.0, 0.0]]),
        np.array([0.1, 1.0]),
        np.array([5.0, 10.0]),
        np.array([4.0, 0.0]),
    )
    assert found.order == [1, 0] and found.cost == pytest.approx(12.0)


def test_a_sure_subgoal_ends_the_sum() -> None:
    robot, pairs, _, success, exploration = draw_problem(1, 4)
    found = order_subgoals(robot, pairs, np.ones(4), success, exploration)
    assert found.cost == pytest.approx((robot + success).min())


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 2**31), st.integers(1, 6))
def test_of_equally_good_subgoals_the_first_comes_first(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    numbers = Numbers(
        rng.integers(1, 3, count).astype(float),
        rng.integers(1, 3, (count, count)).astype(float),
        rng.choice([0.0, 0.25, 0.5], count),  # sums of such products are exact, so equal costs are equal numbers
        rng.choice([2.0, 4.0], count),
        rng.choice([2.0, 4.0], count),
    )
    costs = {order: plain_cost(order, numbers) for order in permutations(range(count))}
    first = min(order for order, cost in costs.items() if cost == min(costs.values()))
    assert order_subgoals(*numbers).order == list(first)


def test_equal_subgoals_keep_their_order() -> None:
    same = np.ones(9)
    assert order_subgoals(same, np.zeros((9, 9)), same / 4, same, same).order == list(range(9))


def test_the_penalty_changes_the_cost_and_not_the_choice() -> None:
    numbers = draw_problem(3, 9, high_p=0.3)
    without, with_it = order_subgoals(*numbers), order_subgoals(*numbers, failure_penalty=1e6)
    assert with_it.order == without.order
    assert with_it.cost == pytest.approx(without.cost + 1e6 * np.prod(1 - numbers.p))
    sure = numbers._replace(p=np.append(numbers.p[:-1], 1.0))
    assert order_subgoals(*sure, failure_penalty=np.inf).cost == order_subgoals(*sure).cost


@pytest.mark.parametrize("count", [1, 4, 8])
def test_where_nothing_can_be_reached_the_cost_is_inf(count: int) -> None:
    numbers = draw_problem(0, count, high_p=0.5)._replace(robot=np.full(count, np.inf))
    found = order_subgoals(*numbers)
    assert sorted(found.order) == list(range(count))
    assert found.cost == np.inf


def test_an_unreachable_subgoal_waits_behind_a_sure_one() -> None:
    robot, pairs, p, success, exploration = draw_problem(5, 8, high_p=0.2)
    robot[3] = pairs[:, 3] = pairs[3] = np.inf
    p[6] = 1.0
    found = order_subgoals(robot, pairs, p, success, exploration)
    assert np.isfinite(found.cost)
    assert found.order.index(3) > found.order.index(6)


def test_arguments_may_be_views_and_stay_as_they_are() -> None:
    numbers = draw_problem(2, 10)
    table = np.stack([numbers.p, numbers.success, numbers.exploration], axis=1)
    before = numbers.pairs.copy(), table.copy()
    assert order_subgoals(numbers.robot[::1], numbers.pairs.T.T, *table.T) == order_subgoals(*numbers)
    assert np.array_equal(numbers.pairs, before[0]) and np.array_equal(table, before[1])


def test_the_largest_number_of_subgoals() -> None:
    # One after the other along a line, alike but for their places: whoever turns round walks the line twice.
    away = np.arange(1.0, MOST_SUBGOALS + 1)
    pairs = np.abs(away[:, None] - away)
    same = np.ones(MOST_SUBGOALS)
    found = order_subgoals(away, pairs, 0.0 * same, same, 2.0 * same)
    assert found.order == list(range(MOST_SUBGOALS))
    assert found.cost == MOST_SUBGOALS * (1.0 + 2.0)


@pytest.mark.parametrize("count", [0, MOST_SUBGOALS + 1])
def test_too_few_or_too_many_are_refused(count: int) -> None:
    with pytest.raises(ValueError, match=f"takes 1 to {MOST_SUBGOALS} subgoals, got {count}"):
        order_subgoals(*(np.zeros((count, count)) if k == 1 else np.zeros(count) for k in range(5)))
