"""A* over weights: equal to an obvious Dijkstra, hand-computed cases, regions."""

import heapq
from math import inf, isinf

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.grids.distances import DIAGONAL, travel_field
from pipeline.grids.weighted_search import least_cost, search_room, step_costs, way_back


def obvious(
    weights: NDArray[np.float32], regions: NDArray[np.int32], allowed: NDArray[np.bool_], start: tuple[int, int]
) -> dict[tuple[int, int], float]:
    """Dijkstra on a dictionary, cell by cell."""
    found, queue = {}, [(0.0, start)]
    while queue:
        cost, (row, col) = heapq.heappop(queue)
        if (row, col) in found:
            continue
        found[row, col] = cost
        for down in (-1, 0, 1):
            for along in (-1, 0, 1):
                there = (row + down, col + along)
                if (down, along) == (0, 0) or not weights[there] or not allowed[regions[there]]:
                    continue
                sides = [(row + down, col), (row, col + along)]
                if down and along:
                    if not all(weights[side] for side in sides):
                        continue
                    if all(regions[there] != regions[side] for side in sides):
                        continue
                length = DIAGONAL if down and along else 1.0
                step = length * (float(weights[row, col]) + float(weights[there])) / 2
                heapq.heappush(queue, (cost + step, there))
    return found


def drawn(seed: int, side: int = 20, parts: int = 4) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    rng = np.random.default_rng(seed)
    weights = (1 + rng.integers(0, 33, size=(side, side)) / 16).astype(np.float32)
    weights[rng.random((side, side)) < 0.3] = 0
    weights[[0, -1]] = weights[:, [0, -1]] = 0
    rows, cols = np.indices(weights.shape)
    return weights, ((rows * parts // side) * parts + cols * parts // side).astype(np.int32)


@pytest.mark.parametrize("seed", range(40))
def test_costs_are_those_of_an_obvious_dijkstra_bit_for_bit(seed: int) -> None:
    weights, regions = drawn(seed)
    rng = np.random.default_rng(seed + 1000)
    allowed = rng.random(16) < 0.85
    free = np.argwhere((weights > 0) & allowed[regions])
    room = search_room(weights.size)  # the same for all searches, as they leave nothing for one another
    for start, goal in zip(free[::7], free[::-7], strict=False):
        start_cell, goal_cell = (int(row * 20 + col) for row, col in (start, goal))
        cost, expanded = least_cost(weights.ravel(), regions.ravel(), allowed, 20, start_cell, goal_cell, room)
        expected = obvious(weights, regions, allowed, (int(start[0]), int(start[1])))
        assert cost == expected.get((int(goal[0]), int(goal[1])), inf)
        assert 0 < expanded <= len(expected)
        if not isinf(cost):
            way = way_back(room, start_cell, goal_cell)
            assert (way[0], way[-1]) == (start_cell, goal_cell)
            assert allowed[regions.ravel()[way]].all() and (weights.ravel()[way] > 0).all()
            assert step_costs(weights.ravel(), 20, way).sum() == cost


def test_with_weights_of_one_it_is_the_travel_distance() -> None:
    weights, regions = drawn(7)
    weights[weights > 0] = 1
    free = np.argwhere(weights > 0)
    field = travel_field(weights > 0, *free[0].tolist())
    room, allowed = search_room(400), np.ones(16, dtype=bool)
    for row, col in free[1::11]:
        start = int(free[0][0] * 20 + free[0][1])
        cost, _ = least_cost(weights.ravel(), np.zeros(400, np.int32), allowed, 20, start, int(row * 20 + col), room)
        assert cost == field[row, col]
    assert regions.max() == 15


def test_a_step_costs_its_length_times_the_mean_weight_and_never_passes_a_corner_of_regions() -> None:
    weights = np.zeros((4, 4), np.float32)
    weights[1, 1], weights[1, 2], weights[2, 1], weights[2, 2] = 1, 2, 3, 4
    room, everywhere = search_room(16), np.ones(4, dtype=bool)
    one = np.zeros(16, np.int32)
    assert least_cost(weights.ravel(), one, everywhere, 4, 5, 10, room) == (2.5 * DIAGONAL, 4)
    four = np.zeros((4, 4), np.int32)
    four[1, 2], four[2, 1], four[2, 2] = 1, 2, 3
    cost, _ = least_cost(weights.ravel(), four.ravel(), everywhere, 4, 5, 10, room)
    assert cost == 1.5 + 3.0  # by (1, 2), as by (2, 1) it is 2 + 3.5
    without = np.array([True, False, True, True])
    assert least_cost(weights.ravel(), four.ravel(), without, 4, 5, 10, room)[0] == 5.5
    two = np.zeros((4, 4), np.int32)
    two[2] = 1  # one above the other: the diagonal passes from one to the other along no corner
    assert least_cost(weights.ravel(), two.ravel(), everywhere, 4, 5, 10, room)[0] == 2.5 * DIAGONAL


def test_no_way_costs_infinitely_much() -> None:
    weights = np.zeros((3, 5), np.float32)
    weights[1, 1] = weights[1, 3] = 1
    room, one = search_room(15), np.zeros(15, np.int32)
    assert least_cost(weights.ravel(), one, np.ones(1, bool), 5, 6, 8, room) == (inf, 1)
    assert least_cost(weights.ravel(), one, np.ones(1, bool), 5, 6, 7, room) == (inf, 0)
    assert least_cost(weights.ravel(), one, np.ones(1, bool), 5, 6, 6, room) == (0.0, 1)
