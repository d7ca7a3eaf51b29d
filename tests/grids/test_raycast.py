"""Range scans equal a ray-against-every-box twin, and insertion reveals just what a scan saw."""

import numpy as np
import pytest

from pipeline.grids.inflate import disk_offsets, inflate
from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN
from pipeline.grids.partial_map import BLOCKED, CLEAR, unseen_map
from pipeline.grids.raycast import beam_directions, cast_rays, insert_scan
from tests.twins import slow_range
from tests.worlds import cells_from, scattered


def test_ranges_along_the_axes() -> None:
    cells = cells_from("#######", "#.....#", "#.....#", "#######")
    scan = cast_rays(cells, 1, 2, beam_directions(4), 100.0)
    assert scan.hits.tolist() == [13, 23, 7, 2]
    assert scan.ranges.tolist() == [3.5, 1.5, 1.5, 0.5]  # east, north (+row), west, south


@pytest.mark.parametrize("seed", range(40))
def test_ranges_equal_the_slow_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = scattered(rng, 20, 26, share=0.15)
    row, col = rng.integers(1, 19), rng.integers(1, 25)
    cells[row, col] = FREE
    directions = beam_directions(64) @ np.array([[np.cos(0.01), np.sin(0.01)], [-np.sin(0.01), np.cos(0.01)]])
    found = cast_rays(cells, row, col, directions, 12.0).ranges
    expected = [slow_range(cells, row, col, direction, 12.0) for direction in directions]
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_no_beam_slips_between_two_walls_that_touch_in_a_corner() -> None:
    cells = cells_from("######", "#..#.#", "#.#..#", "#....#", "######")
    # From (2, 1) the exact diagonal runs into the corner between (3, 3) and (2, 2).
    assert cast_rays(cells, 2, 1, beam_directions(8), 50.0).ranges[1] < 2.0


def scan_into(cells: np.ndarray, row: int, col: int, radius: float = 0.0, reach: float = 50.0, beams: int = 512):
    directions = beam_directions(beams)
    map_ = unseen_map(*cells.shape)
    scan = cast_rays(cells, row, col, directions, reach)
    fresh = insert_scan(map_.known, map_.status, row, col, directions, scan, disk_offsets(radius))
    return map_, fresh


def test_every_scan_of_many_worlds_reveals_only_the_truth() -> None:
    # Beams at multiples of 45 degrees run through corners, where two cells are entered at one distance.
    rng = np.random.default_rng(0)
    for _ in range(60):
        cells = scattered(rng, 40, 40, share=rng.uniform(0.02, 0.3))
        for row, col in rng.permutation(np.argwhere(cells == FREE))[:40]:
            map_, _ = scan_into(cells, row, col, beams=1024)
            seen = map_.known != UNKNOWN
            assert (map_.known[seen] == cells[seen]).all()


@pytest.mark.parametrize("seed", range(40))
def test_a_scan_reveals_only_the_truth_and_all_four_neighbours(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = scattered(rng, 25, 25, share=0.3)
    row, col = rng.integers(1, 24, 2)
    cells[row, col] = FREE
    map_, fresh = scan_into(cells, row, col)
    seen = map_.known != UNKNOWN
    assert (map_.known[seen] == cells[seen]).all()
    assert fresh == seen.sum()
    for drow, dcol in ((0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)):
        assert seen[row + drow, col + dcol]


def test_a_scan_of_an_open_hall_leaves_no_hole() -> None:
    cells = np.zeros((101, 101), dtype=np.uint8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    map_, _ = scan_into(cells, 50, 50, reach=200.0, beams=1024)
    assert (map_.known[1:-1, 1:-1] == FREE).all()


@pytest.mark.parametrize("radius", [0.0, 1.0, 1.5, 2.5])
def test_status_is_the_inflation_of_what_was_seen(radius: float) -> None:
    cells = scattered(np.random.default_rng(5), 30, 30, share=0.1)
    cells[15, 15] = FREE
    map_, _ = scan_into(cells, 15, 15, radius)
    blocked = inflate(map_.known == OCCUPIED, radius)[1:-1, 1:-1]
    inner = map_.status[1:-1, 1:-1]
    assert np.array_equal(inner == BLOCKED, blocked)
    assert np.array_equal(inner == CLEAR, (map_.known[1:-1, 1:-1] == FREE) & ~blocked)


def test_a_limited_range_sees_no_obstacle_beyond_it() -> None:
    cells = cells_from("##########", "#........#", "##########")
    map_, _ = scan_into(cells, 1, 1, reach=4.0)
    assert map_.known[1].tolist() == [OCCUPIED, *[FREE] * 5, *[UNKNOWN] * 4]
