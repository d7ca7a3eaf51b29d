import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN
from pipeline.grids.outlook import look_around
from tests.worlds import cells_from

EAST = np.array([[1.0, 0.0]])


def test_a_line_counts_the_unseen_cells_before_the_first_obstacle():
    known = cells_from("########", "#..??.##", "########")
    assert look_around(known, 1, 1, EAST, 20.0).ravel().tolist() == [4.5, 2.0, 1.5]


def test_a_line_ends_at_the_range_and_at_the_edge_of_the_map():
    known = cells_from("???", "...", "???")
    assert look_around(known, 1, 0, EAST, 1.25).ravel().tolist() == [1.25, 0.0, 1.25]
    assert look_around(known, 1, 0, EAST, 9.0).ravel().tolist() == [2.5, 0.0, 9.0]
    assert look_around(known, 1, 0, np.array([[0.0, 1.0]]), 9.0).ravel().tolist() == [1.5, 1.0, 0.5]


def cell_at(known, y, x):
    r, c = int(np.floor(y)), int(np.floor(x))
    return known[r, c] if 0 <= r < known.shape[0] and 0 <= c < known.shape[1] else OCCUPIED


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1))
@example(76197)  # meets a corner just before the range ends
def test_lines_equal_dense_samples(seed):
    rng = np.random.default_rng(seed)
    known = rng.choice([FREE, OCCUPIED, UNKNOWN], size=(9, 11), p=[0.6, 0.15, 0.25]).astype(np.uint8)
    row, col = rng.integers(1, 8), rng.integers(1, 10)
    angles = rng.uniform(0, 2 * np.pi, 4)
    lines = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    found = look_around(known, row, col, lines, 6.0)
    for (dx, dy), (end, unseen, first) in zip(lines, found.T, strict=True):
        steps = (np.arange(6000) + 0.5) * 0.001
        r, c = np.floor(row + 0.5 + dy * steps).astype(int), np.floor(col + 0.5 + dx * steps).astype(int)
        inside = (r >= 0) & (c >= 0) & (r < 9) & (c < 11)
        values = np.where(inside, known[r.clip(0, 8), c.clip(0, 10)], OCCUPIED)
        before = steps < end - 1e-9
        assert not (values[before] == OCCUPIED).any()
        assert end == 6.0 or cell_at(known, row + 0.5 + dy * (end + 1e-7), col + 0.5 + dx * (end + 1e-7)) == OCCUPIED
        assert abs(unseen - (values[before] == UNKNOWN).sum() * 0.001) < 0.02
        grey = steps[before & (values == UNKNOWN)]
        if grey.size:
            assert first <= grey[0]
