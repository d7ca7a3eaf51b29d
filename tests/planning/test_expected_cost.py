"""The subset programme equals trying every ordering of equation (4)."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.planning.expected_cost import order_subgoals
from tests.twins import slow_best_order, slow_expected_cost


def problem(seed: int, count: int, low_p: float = 0.0) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 50, (count, 2))
    pairs = np.linalg.norm(points[:, None] - points[None], axis=2)
    robot = np.linalg.norm(points - rng.uniform(0, 50, 2), axis=1)
    return robot, pairs, rng.uniform(low_p, 1, count), rng.uniform(0, 90, count), rng.uniform(0, 60, count)


@settings(deadline=None, max_examples=150)
@given(st.integers(0, 2**31), st.integers(1, 6), st.sampled_from([0.0, 25.0]))
def test_equals_every_ordering_tried(seed: int, count: int, penalty: float) -> None:
    numbers = problem(seed, count)
    found = order_subgoals(*numbers, failure_penalty=penalty)
    _, cost = slow_best_order(*numbers, penalty)
    assert found.cost == pytest.approx(cost, abs=1e-6)
    assert sorted(found.order) == list(range(count))
    assert slow_expected_cost(found.order, *numbers, penalty) == pytest.approx(cost, abs=1e-6)


def test_a_worked_example() -> None:
    # Near dead end (P 0.1) before a sure way: 1 + 0.1*5 + 0.9*(4 + 3 + 10) = 16.8; the sure way first: 2 + 10 = 12.
    order = order_subgoals(
        np.array([1.0, 2.0]),
        np.array([[0.0, 3.0], [3.0, 0.0]]),
        np.array([0.1, 1.0]),
        np.array([5.0, 10.0]),
        np.array([4.0, 0.0]),
    )
    assert order.order[0] == 1 and order.cost == pytest.approx(12.0)


def test_a_sure_subgoal_ends_the_sum() -> None:
    robot, pairs, _, success, exploration = problem(1, 4)
    order = order_subgoals(robot, pairs, np.ones(4), success, exploration)
    assert order.cost == pytest.approx((robot + success).min())


@pytest.mark.parametrize("count", [0, 17])
def test_too_few_or_too_many_are_refused(count: int) -> None:
    with pytest.raises(ValueError, match=f"got {count}"):
        order_subgoals(*(np.zeros((count, count)) if k == 1 else np.zeros(count) for k in range(5)))
