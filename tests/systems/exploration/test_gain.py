"""The gain of a view: hand-counted, and against a slow twin in random maps."""

import numpy as np
import pytest

from pipeline.grids.beams import beam_directions
from pipeline.grids.occupancy import OCCUPIED, UNKNOWN
from pipeline.systems.exploration.gain import SECTORS, Lookout, best_window, count_unseen, rays_of
from tests.systems.exploration.explorations import robot_of
from tests.worlds import cells_from

# Seen from row 2, col 4: unseen to the west, a wall with unseen space behind it to the north, one cell to the east.
CORNER = (
    "###########",
    "#?????????#",
    "#...###...#",
    "#??......?#",
    "#.........#",
    "###########",
)


def slow_unseen(known: np.ndarray, opaque: np.ndarray, row: int, col: int, beams: int, reach: float) -> dict[int, set]:
    """Walk each ray in small steps of its own; return the unseen cells met, by sector."""
    found: dict[int, set] = {}
    rows, cols = known.shape
    for x, y in beam_directions(beams):
        crossings = []
        for part, axis in ((x, "x"), (y, "y")):
            pace = 1.0 / abs(part) if part else np.inf
            way = 0.5 * pace
            while way < reach:  # added up as a ray is, so that both round alike where it passes a corner
                crossings.append((way, axis))
                way += pace
        crossings.sort()
        r, c = row, col
        for _, axis in crossings:
            r, c = (r, c + (1 if x > 0 else -1)) if axis == "x" else (r + (1 if y > 0 else -1), c)
            if not (0 < r < rows - 1 and 0 < c < cols - 1) or opaque[r, c] == OCCUPIED:
                break
            if known[r, c] == UNKNOWN:
                bearing = np.arctan2(r - row, c - col) % (2 * np.pi)
                found.setdefault(int(bearing / (2 * np.pi) * SECTORS + 1e-9) % SECTORS, set()).add((r, c))
    return found


def test_unseen_cells_in_a_drawn_map() -> None:
    known = cells_from(*CORNER)
    lookout = Lookout(robot_of(20.0).sensor, 8, known, known, 1.0)
    counts = lookout.sectors(2 * 11 + 5)
    # Along the axes: two cells to the west, one to the east. Rays at 45 degrees end at the wall's row or the border.
    assert counts[SECTORS // 2] == 2 and counts[0] == 1
    assert lookout.view(2 * 11 + 5).heading is None and lookout.view(2 * 11 + 5).unseen == counts.sum()


def test_a_field_of_view_looks_where_most_is_unseen() -> None:
    known = cells_from(*CORNER)
    view = Lookout(robot_of(20.0, 90.0).sensor, 8, known, known, 1.0).view(2 * 11 + 5)
    assert view.unseen == 2 and abs(np.degrees(view.heading) - 180.0) <= 45.0
    whole = Lookout(robot_of(20.0, 90.0).sensor, 8, known, known, 1.0)
    assert whole.seen_from(2 * 11 + 5, view.heading) == view.unseen


@pytest.mark.parametrize("seed", range(60))
def test_counts_are_those_of_the_slow_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, cols = int(rng.integers(5, 24)), int(rng.integers(5, 24))
    known = rng.choice([0, 1, 2], size=(rows, cols), p=[0.4, 0.1, 0.5]).astype(np.uint8)
    opaque = known if seed % 2 else (rng.random((rows, cols)) < 0.2).astype(np.uint8)
    row, col = int(rng.integers(1, rows - 1)), int(rng.integers(1, cols - 1))
    beams, reach = int(rng.choice([8, 24, 64])), float(rng.choice([2.5, 7.25, 31.0]))
    found = count_unseen(known, opaque, row, col, *rays_of(beams, reach, cols), np.zeros(known.size, np.int32), 1)
    slow = slow_unseen(known, opaque, row, col, beams, reach)
    assert found.tolist() == [len(slow.get(k, ())) for k in range(SECTORS)]
    width = int(rng.integers(1, SECTORS))
    sums = [sum(int(found[(k + j) % SECTORS]) for j in range(width)) for k in range(SECTORS)]
    assert best_window(found, width) == (sums.index(max(sums)), max(sums))
    lookout = Lookout(robot_of(reach, 5.0 * width if width > 1 else 10.0).sensor, beams, known, opaque, 1.0)
    assert lookout.view(row * cols + col).unseen <= lookout.most
