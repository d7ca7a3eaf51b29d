"""Range scans equal a ray-against-every-box twin, and reveal just what a scan saw."""

import numpy as np
import pytest

from pipeline.grids.beams import beam_directions, beam_tree, plant_beams
from pipeline.grids.inflate import disk_offsets, inflate
from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN
from pipeline.grids.partial_map import BLOCKED, CHANGES, CLEAR, OBSTACLES, UNSEEN, PartialMap, enter, unseen_map
from pipeline.grids.raycast import scan
from tests.twins import slow_range
from tests.worlds import cells_from, scattered


def scan_along(cells: np.ndarray, row: int, col: int, directions: np.ndarray, reach: float) -> np.ndarray:
    tree = plant_beams(directions, reach, cells.shape[1])
    return scan(cells, row, col, tree, 0, len(directions))[0]


def scan_into(
    cells: np.ndarray, row: int, col: int, radius: float = 0.0, reach: float = 50.0, beams: int = 512
) -> tuple[PartialMap, int]:
    map_ = unseen_map(*cells.shape)
    _, seen, occupancy = scan(cells, row, col, beam_tree(beams, reach, cells.shape[1]), 0, beams)
    return map_, enter(map_, seen, occupancy, disk_offsets(radius))


def test_ranges_along_the_axes() -> None:
    cells = cells_from("#######", "#.....#", "#.....#", "#######")
    ranges = scan_along(cells, 1, 2, beam_directions(4), 100.0)
    assert ranges.tolist() == [3.5, 1.5, 1.5, 0.5]  # east, north (+row), west, south


@pytest.mark.parametrize("seed", range(40))
def test_ranges_equal_the_slow_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = scattered(rng, 20, 26, share=0.15)
    row, col = rng.integers(1, 19), rng.integers(1, 25)
    cells[row, col] = FREE
    directions = beam_directions(64) @ np.array([[np.cos(0.01), np.sin(0.01)], [-np.sin(0.01), np.cos(0.01)]])
    found = scan_along(cells, row, col, directions, 12.0)
    expected = [slow_range(cells, row, col, direction, 12.0) for direction in directions]
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_many_beams_together_see_what_each_sees_alone(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = scattered(rng, 30, 30, share=0.1)
    row, col = (int(place) for place in rng.integers(1, 29, 2))
    cells[row, col] = FREE
    directions = beam_directions(128)
    together, _ = scan_into(cells, row, col, radius=1.0, reach=17.0, beams=128)
    alone, disk = unseen_map(30, 30), disk_offsets(1.0)
    ranges = scan_along(cells, row, col, directions, 17.0)
    for beam, direction in enumerate(directions):
        (found,), seen, occupancy = scan(cells, row, col, plant_beams(direction[None], 17.0, 30), 0, 1)
        enter(alone, seen, occupancy, disk)
        assert found == ranges[beam]
    assert np.array_equal(together.known, alone.known) and np.array_equal(together.status, alone.status)


def test_no_beam_slips_between_two_walls_that_touch_in_a_corner() -> None:
    cells = cells_from("######", "#..#.#", "#.#..#", "#....#", "######")
    # From (2, 1) the exact diagonal runs into the corner between (3, 3) and (2, 2).
    assert scan_along(cells, 2, 1, beam_directions(8), 50.0)[1] < 2.0


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


@pytest.mark.parametrize("seed", range(10))
def test_the_journals_name_each_change_and_nothing_else(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = scattered(rng, 25, 25, share=0.1)
    map_, tree = unseen_map(25, 25), beam_tree(256, 8.0, 25)
    for row, col in rng.permutation(np.argwhere(cells == FREE))[:12]:
        before, (changes, obstacles) = map_.status.copy(), map_.written.tolist()
        occupied = map_.known == OCCUPIED
        _, seen, met = scan(cells, int(row), int(col), tree, 0, 256)
        enter(map_, seen, met, disk_offsets(1.0))
        named = map_.changes[changes : map_.written[CHANGES]]
        assert set(np.flatnonzero(before != map_.status)) == set(named.tolist())
        found = map_.obstacles[obstacles : map_.written[OBSTACLES]]
        assert sorted(found.tolist()) == np.flatnonzero((map_.known == OCCUPIED) & ~occupied).tolist()


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
    assert np.array_equal(inner == UNSEEN, (map_.known[1:-1, 1:-1] == UNKNOWN) & ~blocked)


def test_a_limited_range_sees_no_obstacle_beyond_it() -> None:
    cells = cells_from("##########", "#........#", "##########")
    map_, _ = scan_into(cells, 1, 1, reach=4.0)
    assert map_.known[1].tolist() == [OCCUPIED, *[FREE] * 5, *[UNKNOWN] * 4]


def test_beams_next_to_each_other_share_their_first_cells() -> None:
    alone = sum(plant_beams(direction[None], 60.0, 200).way.shape[0] for direction in beam_directions(1024))
    assert beam_tree(1024, 60.0, 200).way.shape[0] < 0.8 * alone
    assert beam_tree(1024, 20.0, 200).way.shape[0] < 0.35 * alone
