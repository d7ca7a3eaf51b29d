"""The cheapest route costs no more than the cheapest ordering, whatever the prices, from wherever it starts."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.planning.ordering.bound import CELLS, Grid, Routes, fill_routes, lay_grid, next_best
from pipeline.planning.ordering.problem import Problem, state_problem
from tests.planning.ordering.problems import Numbers, Vector, draw_problem, edge_problems, least_cost


def routes_of(problem: Problem, grid: Grid, price: Vector) -> Routes:
    shape = grid.lightest.size, problem.gain.size
    routes = Routes(price, np.empty(shape), np.empty(shape, dtype=np.int64), np.empty(shape))
    fill_routes(problem, grid, routes)
    return routes


def bound_of(problem: Problem, seed: int) -> float:
    """The bound from the start, under random prices."""
    grid = lay_grid(problem.fail)
    price = np.random.default_rng(seed).normal(0, 3, problem.gain.size)
    routes = routes_of(problem, grid, price if grid.closed else np.abs(price))
    _, start = next_best(problem.legs, routes, problem.gain.size, 0, 0, 0, -np.inf, -1)
    return float(start - routes.price.sum())


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 2**31), st.integers(1, 6), st.sampled_from([0.05, 0.3, 1.0]))
def test_no_ordering_costs_less_than_the_cheapest_route(seed: int, count: int, high_p: float) -> None:
    numbers = draw_problem(seed, count, high_p=high_p)
    assert bound_of(state_problem(*numbers), seed) <= least_cost(numbers) * (1 + 1e-9)


@settings(deadline=None, max_examples=150)
@given(edge_problems(most=5), st.integers(0, 2**31))
def test_nor_with_sure_hopeless_free_and_unreachable_subgoals(numbers: Numbers, seed: int) -> None:
    bound = bound_of(state_problem(*numbers), seed)
    assert not np.isnan(bound)
    assert bound <= least_cost(numbers) * (1 + 1e-9) + 1e-9


@pytest.mark.parametrize("p", [[0.1, 0.2, 0.3, 0.05, 0.6], [0.0, 0.5, 0.0, 0.9], [0.0, 0.0, 0.0]])
def test_a_cell_knows_the_loads_of_the_sets_in_it(p: list[float]) -> None:
    grid = lay_grid(1 - np.array(p))
    assert grid.closed and grid.lightest.size == grid.steps.sum() + 1
    for size in range(len(p) + 1):
        for chosen in combinations(range(len(p)), size):
            cell, chance = grid.steps[list(chosen)].sum(), np.prod(1 - np.array(p)[list(chosen)])
            assert grid.lightest[cell] * (1 - 1e-12) <= 1 / chance <= grid.heaviest[cell] * (1 + 1e-12)


@pytest.mark.parametrize("p", [[0.1, 1.0, 0.2], [1.0, 1.0], [0.999] * 9])
def test_a_grid_ends_where_hardly_a_chance_is_left(p: list[float]) -> None:
    grid = lay_grid(1 - np.array(p))
    assert not grid.closed and grid.lightest.size <= CELLS + 2
    assert np.all(grid.steps[np.array(p) == 1.0] >= grid.lightest.size)


def test_siblings_come_in_the_order_of_their_routes() -> None:
    problem = state_problem(*draw_problem(9, 8, high_p=0.3))
    routes = routes_of(problem, lay_grid(problem.fail), np.zeros(8))
    tried, found = 0b101, []
    b, cost = next_best(problem.legs, routes, 2, 0, tried, tried, -np.inf, -1)
    while b >= 0:
        found.append((cost, b))
        b, cost = next_best(problem.legs, routes, 2, 0, tried, tried, cost, b)
    assert found == sorted(found) and {b for _, b in found} == {1, 3, 4, 5, 6, 7}
