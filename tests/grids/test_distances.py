"""Travel distances equal a heap Dijkstra, and paths really have the length that the field says."""

import numpy as np
import pytest

from pipeline.grids.distances import (
    DIAGONAL,
    NOWHERE,
    SHUT,
    by_level,
    descend,
    open_field,
    reopen,
    settle,
    spread,
    travel_field,
    workspace_for,
)
from tests.twins import slow_field
from tests.worlds import cells_from, scattered


def settled(status: np.ndarray, source: int, targets: np.ndarray = NOWHERE) -> np.ndarray:
    field = open_field(status, 0)
    settle(field, status.shape[1], source, targets, workspace_for(status.size))
    return field


def test_a_path_does_not_cut_a_corner() -> None:
    passable = cells_from("#####", "#.#.#", "#...#", "#####") == 0
    field = travel_field(passable, 2, 1)
    assert field[2, 3] == pytest.approx(4.0)  # down, right, right, up: never diagonally past the wall


def test_a_diagonal_is_the_root_of_two_and_its_sums_are_exact() -> None:
    assert abs(DIAGONAL - np.sqrt(2.0)) < 2.0**-34
    moves = np.random.default_rng(0).choice([1.0, DIAGONAL], 100_000)
    assert np.cumsum(moves)[-1] == np.cumsum(moves[::-1])[-1] == (moves == 1.0).sum() + (moves != 1.0).sum() * DIAGONAL


@pytest.mark.parametrize("seed", range(60))
def test_field_equals_the_slow_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    passable = scattered(rng, *rng.integers(4, 40, 2), share=rng.uniform(0, 0.5)) == 0
    row, col = rng.integers(1, passable.shape[0] - 1), rng.integers(1, passable.shape[1] - 1)
    np.testing.assert_allclose(travel_field(passable, row, col), slow_field(passable, row, col), atol=1e-6)


@pytest.mark.parametrize("seed", range(30))
def test_a_distance_is_the_same_bits_from_either_end(seed: int) -> None:
    rng = np.random.default_rng(seed)
    status = scattered(rng, 40, 50, share=0.2)
    one, other = rng.choice(np.flatnonzero(status.ravel() == 0), 2, replace=False)
    assert settled(status, one)[other] == settled(status, other)[one]


@pytest.mark.parametrize("seed", range(30))
def test_an_early_stop_is_exact_at_its_targets_and_paths_have_that_length(seed: int) -> None:
    rng = np.random.default_rng(seed)
    status = scattered(rng, 30, 25, share=0.25)
    free = np.flatnonzero(status.ravel() == 0).astype(np.int32)
    source, *targets = rng.choice(free, 6, replace=False)
    full = settled(status, source)
    early = settled(status, source, np.array(targets, dtype=np.int32))
    for target in targets:
        assert early[target] == full[target]
        path = descend(early, status.shape[1], target, source)
        if np.isinf(full[target]):
            assert path.size == 0
            continue
        rows, cols = np.divmod(path, status.shape[1])
        steps = np.hypot(np.diff(rows), np.diff(cols))
        assert path[0] == target and path[-1] == source
        assert steps.max(initial=1.0) < 1.5 and (status.ravel()[path] == 0).all()
        assert steps.sum() == pytest.approx(full[target])


@pytest.mark.parametrize("seed", range(30))
def test_several_sources_with_offsets_equal_the_slow_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    status = scattered(rng, 20, 30, share=0.3)
    sources = rng.choice(np.flatnonzero(status.ravel() == 0), 6, replace=False).astype(np.int32)
    offsets = rng.uniform(0, 12, 6)
    field = open_field(status, 0)
    field[sources] = offsets
    spread(field, status.shape[1], by_level(field, sources), NOWHERE, workspace_for(status.size), False)
    rows, cols = np.divmod(sources, status.shape[1])
    expected = slow_field(status == 0, 0, 0, list(zip(offsets, rows, cols, strict=True)))
    np.testing.assert_allclose(np.where(field == SHUT, np.inf, field).reshape(status.shape), expected, atol=1e-6)


@pytest.mark.parametrize("stop", [False, True])
def test_a_reopened_field_is_as_good_as_new(stop: bool) -> None:
    rng = np.random.default_rng(7)
    status, work = scattered(rng, 30, 25, share=0.25), workspace_for(750)
    free = np.flatnonzero(status.ravel() == 0).astype(np.int32)
    field, touched, changed = open_field(status, 0), 0, NOWHERE
    for source, target in rng.choice(free[status.ravel()[free] == 0], (40, 2)):
        reopen(field, status, 0, work.trail[:touched].copy(), changed)
        assert np.array_equal(field, open_field(status, 0)), "something was left behind"
        targets = np.array([target], dtype=np.int32) if stop else NOWHERE
        touched = settle(field, 25, source, targets, work)
        changed = rng.choice(free, 5)
        status.ravel()[changed] = rng.integers(0, 2, 5)


def test_an_open_ring_is_refused() -> None:
    with pytest.raises(ValueError, match="closed outermost ring"):
        travel_field(np.ones((4, 4), dtype=bool), 1, 1)
