"""Inflation equals its definition: centre to centre distance."""

import numpy as np
import pytest

from pipeline.grids.inflate import disk_offsets, inflate


@pytest.mark.parametrize("radius", [0.0, 0.9, 1.0, 1.42, 2.5])
def test_inflation_equals_the_slow_twin(radius: float) -> None:
    blocked = np.random.default_rng(1).random((20, 17)) < 0.05
    rows, cols = np.indices(blocked.shape)
    expected = np.zeros_like(blocked)
    for row, col in np.argwhere(blocked):
        expected |= np.hypot(rows - row, cols - col) <= radius + 1e-9
    assert np.array_equal(inflate(blocked, radius), expected)


def test_the_disk_is_what_one_cell_blocks() -> None:
    alone = np.zeros((9, 9), dtype=bool)
    alone[4, 4] = True
    stamped = np.zeros_like(alone)
    for row, col in disk_offsets(2.5):
        stamped[4 + row, 4 + col] = True
    assert np.array_equal(stamped, inflate(alone, 2.5))


def test_nothing_blocked_stays_so() -> None:
    assert not inflate(np.zeros((3, 3), dtype=bool), 2.0).any()
