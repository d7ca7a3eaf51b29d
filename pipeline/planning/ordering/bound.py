"""A lower bound on what finishing an ordering costs: the cheapest route that may come back to a subgoal.

What is still to come depends on the set of subgoals that were tried. A route forgets the set and knows only its load,
the sum of -log(1 - P) over it, as a cell of a grid; so it may try a subgoal twice (though never a, b, a). That leaves
few enough states for the exact answer, and since every ordering is a route, none costs less than the cheapest route.
With V(q, a) what follows after ``a`` has failed, q the cell of the load by then:

    V(q, a) = min over b of  D(a, b) + onward(q, b),   V = 0 in the last cell
    onward(q, b) = gain_b + price_b toll(q) + (1 - P_b) V(q + step_b, b)

Every try of b costs price_b more, as seen from the start, and the sum of the prices is taken off again: an ordering
tries each subgoal once and comes out even, a route that tries the dear ones again and leaves out cheap ones does not.
toll(q) turns a cost seen from the start into one seen from here; all it knows of the chance to come this far is the
cell, so it is rounded to the side on which no ordering pays more than the price. Good prices, see ``ordering.prices``,
leave 0 to 5 % between the bound and the best ordering.

This is the state space relaxation of Christofides, Mingozzi and Toth (Networks 11, 1981), who ask for a vehicle's load.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from pipeline.planning.ordering.problem import Indices, Problem, Vector

CELLS = 400  # more of them cost time in proportion, fewer cost sharpness: tolls are rounded more
MOST_LOAD = 20.0  # what comes after so much, at a chance of 2e-9, is left out of the bound


class Grid(NamedTuple):
    """Cells 0 to Q of the load.

    steps: [N] cells that each subgoal adds, at least 1.
    lightest, heaviest: [Q + 1] exp of the least and of the greatest load of any set of subgoals in that cell; inf and 0
        where there is none.
    closed: whether the last cell means that all were tried; otherwise that what follows is too unlikely to count.
    """

    steps: Indices
    lightest: Vector
    heaviest: Vector
    closed: bool


class Routes(NamedTuple):
    """The cheapest routes under one set of prices.

    price: [N] added to each try, as seen from the start; at least 0 unless the grid is closed, since then a subgoal may
        be left out.
    onward: [Q + 1, N] onward(q, b); inf where b no longer fits.
    following: [Q + 1, N] the subgoal that comes next after b, N for none.
    otherwise: [Q + 1, N] onward(q, b) if that subgoal may not come next.
    """

    price: Vector
    onward: Vector
    following: Indices
    otherwise: Vector


def lay_grid(fail: Vector) -> Grid:
    """Return the grid for subgoals that fail with the probabilities ``fail`` [N]."""
    with np.errstate(divide="ignore"):
        load = -np.log(fail)
    unsure = np.isfinite(load)
    total = load[unsure].sum()
    pitch = min(total, MOST_LOAD) / CELLS or 1.0
    steps = np.clip(np.rint(load / pitch), 1, 2 * CELLS).astype(np.int64)  # a sure subgoal leads beyond the last cell
    closed = bool(unsure.all() and total <= MOST_LOAD)
    cells = CELLS if total > MOST_LOAD else int(steps[unsure].sum()) + (not closed)
    lightest, heaviest = np.full(cells + 1, np.inf), np.full(cells + 1, -np.inf)
    lightest[0] = heaviest[0] = 0.0
    for step, more in zip(steps, load, strict=True):
        if step <= cells:
            lightest[step:] = np.minimum(lightest[step:], lightest[:-step] + more)
            heaviest[step:] = np.maximum(heaviest[step:], heaviest[:-step] + more)
    return Grid(steps, np.exp(lightest), np.exp(heaviest), closed)


@njit(cache=True, nogil=True)
def fill_routes(problem: Problem, grid: Grid, routes: Routes) -> None:
    """Compute ``routes`` under its prices, from the last cell to the first: Q N^2 steps."""
    legs, gain, fail = problem
    steps, lightest, heaviest, closed = grid
    price, onward, following, otherwise = routes
    count, cells = gain.size, lightest.size - 1
    for q in range(cells, -1, -1):
        for b in range(count):
            after = q + steps[b]
            best = second = np.inf
            follower = count
            if after > cells and closed:
                pass
            elif after >= cells or fail[b] == 0.0:
                best = second = 0.0
            elif lightest[after] < np.inf:
                for c in range(count):
                    cost = legs[b, c] + (otherwise[after, c] if following[after, c] == b else onward[after, c])
                    if cost < best:
                        best, second, follower = cost, best, c
                    elif cost < second:
                        second = cost
            toll = lightest[q] if price[b] > 0.0 else heaviest[q]
            now = gain[b] + (price[b] * toll if q < cells else 0.0)
            onward[q, b], otherwise[q, b] = now + fail[b] * best, now + fail[b] * second
            following[q, b] = follower


@njit(cache=True, nogil=True)
def next_best(
    legs: Vector, routes: Routes, last: int, used: int, tried: int, barred: int, above: float, beyond: int
) -> tuple[int, float]:
    """Return the subgoal with which the cheapest route goes on, and what that route costs; -1 and inf if none is left.

    last, used: the subgoal that failed last (N: the robot has just set out) and the cell of the load.
    tried, barred: sets of subgoals, as bits, that may not come next, and not after the next.
    above, beyond: leave out what does not come after this cost and subgoal, ordered by cost and then by subgoal.
    """
    _, onward, following, otherwise = routes
    found, least = -1, np.inf
    for b in range(onward.shape[1]):
        if not tried >> b & 1:
            cost = legs[last, b] + (otherwise[used, b] if barred >> following[used, b] & 1 else onward[used, b])
            if (cost > above or (cost == above and b > beyond)) and (cost < least or found < 0):
                found, least = b, cost
    return found, least
