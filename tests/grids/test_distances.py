"""Travel distances equal a heap Dijkstra, and paths really have the length that the field says."""

import numpy as np
import pytest

from pipeline.grids.distances import NO_TARGETS, descend, pair_distances, settle, settle_from, travel_field
from tests.twins import slow_field
from tests.worlds import cells_from, scattered


def test_a_path_does_not_cut_a_corner() -> None:
    passable = cells_from("#####", "#.#.#", "#...#", "#####") == 0
    field = travel_field(passable, 2, 1)
    assert field[2, 3] == pytest.approx(4.0)  # down, right, right, up: never diagonally past the wall


@pytest.mark.parametrize("seed", range(60))
def test_field_equals_the_slow_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    passable = scattered(rng, *rng.integers(4, 40, 2), share=rng.uniform(0, 0.5)) == 0
    row, col = rng.integers(1, passable.shape[0] - 1), rng.integers(1, passable.shape[1] - 1)
    np.testing.assert_allclose(travel_field(passable, row, col), slow_field(passable, row, col), atol=1e-9)


@pytest.mark.parametrize("seed", range(30))
def test_an_early_stop_is_exact_at_its_targets_and_paths_have_that_length(seed: int) -> None:
    rng = np.random.default_rng(seed)
    status = scattered(rng, 30, 25, share=0.25)
    free = np.flatnonzero(status.ravel() == 0).astype(np.int32)
    source, *targets = rng.choice(free, 6, replace=False)
    full = settle(status, 0, source, NO_TARGETS).ravel()
    early = settle(status, 0, source, np.array(targets, dtype=np.int32))
    for target in targets:
        assert early.ravel()[target] == full[target]
        path = descend(early, status, 0, target)
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
    sources = rng.choice(status.size, 6, replace=False).astype(np.int32)
    offsets = np.sort(rng.uniform(0, 12, 6))
    rows, cols = np.divmod(sources, status.shape[1])
    expected = slow_field(status == 0, 0, 0, list(zip(offsets, rows, cols, strict=True)))
    np.testing.assert_allclose(settle_from(status, 0, sources, offsets, NO_TARGETS), expected, atol=1e-9)


def test_pairs_agree_with_single_fields() -> None:
    rng = np.random.default_rng(3)
    status = scattered(rng, 30, 30, share=0.2)
    cells = rng.choice(np.flatnonzero(status.ravel() == 0), 7, replace=False).astype(np.int32)
    pairs = pair_distances(status, 0, cells)
    for i, cell in enumerate(cells):
        np.testing.assert_allclose(pairs[i], settle(status, 0, cell, NO_TARGETS).ravel()[cells], atol=1e-9)


def test_an_open_ring_is_refused() -> None:
    with pytest.raises(ValueError, match="closed outermost ring"):
        travel_field(np.ones((4, 4), dtype=bool), 1, 1)
