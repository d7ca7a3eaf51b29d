"""Prices that raise the bound of ``ordering.bound``, and a good ordering found on the way.

The bound is a concave function of the prices, and how often the cheapest route tries a subgoal says which price to
raise and which to lower: subgradient ascent with Polyak's step.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from pipeline.planning.ordering.bound import Grid, Routes, fill_routes, lay_grid, next_best
from pipeline.planning.ordering.problem import Indices, Problem, Vector, cost_along

ROUNDS = 80
CLOSE = 1e-3  # the search closes a gap this small sooner than more rounds would
PATIENCE = 4  # rounds without a better bound before the step is halved
MOMENTUM = 0.7  # of the last direction is kept: routes jump between two that try the same subgoals by turns


class Priced(NamedTuple):
    """A bound on the cost of every ordering with the routes that prove it, and the best ordering met."""

    grid: Grid
    routes: Routes
    bound: float
    order: Indices
    cost: float


def price_subgoals(problem: Problem) -> Priced:
    """Return the prices of the best bound found in ``ROUNDS`` rounds."""
    count = problem.gain.size
    grid = lay_grid(problem.fail)
    shape = grid.lightest.size, count
    routes = Routes(np.zeros(count), np.empty(shape), np.empty(shape, dtype=np.int64), np.empty(shape))
    best_price, bound, best_surplus = np.zeros(count), -np.inf, np.zeros(count)
    order: Indices = np.arange(count)
    cost = np.inf
    direction: Vector = np.zeros(count)
    scale, stalled = 1.0, 0
    for _ in range(ROUNDS):
        value, surplus = _cheapest_route(problem, grid, routes)
        found = follow(problem.legs, grid, routes, True)
        if cost_along(problem, found) < cost:
            order, cost = found, polish(problem, found)
        stalled += 1
        if value > bound:
            best_price[:], bound, best_surplus, stalled = routes.price, value, surplus, 0
        if cost - bound <= CLOSE * cost or not np.isfinite(cost - bound):
            break
        if stalled > PATIENCE:
            routes.price[:], value, surplus = best_price, bound, best_surplus
            direction[:], scale, stalled = 0.0, scale / 2.0, 0
        if not grid.closed:  # a price of 0 goes no lower
            surplus = np.where(routes.price > 0.0, surplus, np.maximum(surplus, 0.0))
        direction = surplus + MOMENTUM * direction
        chance = _chance_of_trying(problem.fail, order)
        length = float(chance @ direction**2)
        if length == 0.0:
            break
        routes.price[:] += scale * (cost - value) / length * chance * direction
        if not grid.closed:
            np.maximum(routes.price, 0.0, out=routes.price)
    routes.price[:] = best_price
    fill_routes(problem, grid, routes)
    return Priced(grid, routes, bound, order, cost)


def _cheapest_route(problem: Problem, grid: Grid, routes: Routes) -> tuple[float, Vector]:
    """Return the bound under the prices of ``routes``, and [N] how much too often the route tries each subgoal."""
    count = problem.gain.size
    fill_routes(problem, grid, routes)
    _, cost = next_best(problem.legs, routes, count, 0, 0, 0, -np.inf, -1)
    tries: Vector = np.bincount(follow(problem.legs, grid, routes, False), minlength=count).astype(np.float64)
    return cost - float(routes.price.sum()), tries - 1.0


def _chance_of_trying(fail: Vector, order: Indices) -> Vector:
    """Return [N] the chance that each subgoal is tried: prices have to differ as what they are set against does."""
    chance = np.empty(fail.size)
    chance[order] = np.cumprod(np.append(1.0, fail[order]))[:-1]
    return chance


@njit(cache=True, nogil=True)
def follow(legs: Vector, grid: Grid, routes: Routes, once: bool) -> Indices:
    """Return the subgoals along the cheapest route or, where each may be tried ``once`` only, along a good ordering."""
    count, cells = grid.steps.size, grid.lightest.size - 1
    route = np.empty(max(cells, count), dtype=np.int64)
    length = used = tried = 0
    last = before = count
    while length < count if once else used < cells:
        past = tried if once else (1 << last) | (1 << before)
        b, _ = next_best(legs, routes, last, used, past, tried if once else 1 << last, -np.inf, -1)
        if b < 0:
            break
        tried |= 1 << b
        used = min(used + grid.steps[b], cells)
        route[length] = b
        before, last = last, b
        length += 1
    return route[:length]


@njit(cache=True, nogil=True)
def polish(problem: Problem, order: Indices) -> float:
    """Move runs of one to three subgoals along ``order``, in place, as long as that helps; return its cost then."""
    count = order.size
    best = cost_along(problem, order)
    trial = np.empty(count, dtype=np.int64)
    improved = True
    while improved:
        improved = False
        for length in range(1, min(4, count)):
            for start in range(count - length + 1):
                for to in range(count - length + 1):
                    rest = 0
                    for k in range(count):
                        if to <= k < to + length:
                            trial[k] = order[start + k - to]
                        else:
                            rest += length if rest == start else 0
                            trial[k] = order[rest]
                            rest += 1
                    cost = cost_along(problem, trial)
                    if cost < best * (1.0 - 1e-12):  # not for rounding, or it may go round in circles
                        best, improved = cost, True
                        for k in range(count):
                            order[k] = trial[k]
    return best
