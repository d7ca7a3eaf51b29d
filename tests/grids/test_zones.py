"""Zones equal their definition, however the map came about, and a reader can see what comes apart."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.grids.partial_map import BLOCKED, CLEAR, UNSEEN
from pipeline.grids.zones import FRESH, GOALWARD, REACHED, REBUILT, advance, divide
from tests.twins import slow_components
from tests.worlds import scattered

CROSS = [(1, 0), (-1, 0), (0, 1), (0, -1)]


class Divided:
    """The zones of a status that changes."""

    def __init__(self, status: np.ndarray, home: int, goal: int) -> None:
        self.status, self.home, self.goal = status, home, goal
        self.zones, self.counts = np.empty(status.size, dtype=np.uint8), np.zeros(2, dtype=np.int64)
        self.sets, self.fresh, self.stack = (np.empty(times * status.size, dtype=np.int32) for times in (1, 1, 8))
        divide(status, home, goal, self.zones, self.sets, self.counts, self.stack)

    def change(self, cells: np.ndarray) -> np.ndarray:
        kept = (self.zones, self.sets, self.counts, self.fresh, self.stack)
        advance(self.status, self.home, self.goal, cells.astype(np.int32), *kept)
        return self.fresh[: self.counts[FRESH]]

    def parts(self) -> tuple[set[int], set[int]]:
        """The reached cells, and those beyond that are connected to the goal (none once it is reached or blocked)."""
        goalward = np.flatnonzero(self.zones == GOALWARD) if self.zones[self.goal] == GOALWARD else []
        return set(np.flatnonzero(self.zones == REACHED).tolist()), set(map(int, goalward))


def slow_parts(status: np.ndarray, home: int, goal: int) -> tuple[set[int], set[int]]:
    cols = status.shape[1]

    def connected(cells: np.ndarray, to: int) -> set[int]:
        parts = slow_components(map(tuple, np.argwhere(cells).tolist()), CROSS)
        part = next((each for each in parts if divmod(to, cols) in each), set())
        return {row * cols + col for row, col in part}

    reached = connected(status == CLEAR, home)
    beyond = status <= UNSEEN
    beyond.ravel()[sorted(reached)] = False
    return reached, connected(beyond, goal)


@settings(deadline=None, max_examples=150)
@given(seed=st.integers(0, 2**32 - 1), seen_free=st.floats(0.3, 1.0), size=st.integers(1, 30))
def test_step_by_step_equals_the_slow_definition(seed: int, seen_free: float, size: int) -> None:
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(5, 16, 2))
    status = np.where(scattered(rng, *shape, share=0.0) == 0, UNSEEN, BLOCKED).astype(np.uint8)
    inner = np.arange(status.size).reshape(shape)[1:-1, 1:-1].ravel()
    home, goal = (int(cell) for cell in rng.choice(inner, 2, replace=False))
    status.ravel()[home] = CLEAR
    divided = Divided(status, home, goal)
    for _ in range(25):
        before, _ = divided.parts()
        cells = rng.choice(inner, size)
        for cell in cells:
            if cell == home:
                continue
            blocked = status.ravel()[cell] == BLOCKED or rng.random() > seen_free
            status.ravel()[cell] = BLOCKED if blocked else CLEAR
        fresh = divided.change(cells)
        reached, goalward = divided.parts()
        assert (reached, goalward) == slow_parts(status, home, goal)
        if not divided.counts[REBUILT]:
            assert set(fresh.tolist()) == reached - before and fresh.size == len(reached - before)


def test_reached_space_that_comes_apart_is_divided_anew() -> None:
    status = np.full((5, 9), BLOCKED, dtype=np.uint8)
    status[2, 1:8], status[1, 7] = CLEAR, UNSEEN
    divided = Divided(status, 2 * 9 + 1, 9 + 7)
    assert divided.parts() == ({2 * 9 + col for col in range(1, 8)}, {9 + 7})
    status[2, 4] = BLOCKED
    divided.change(np.array([2 * 9 + 4]))
    assert divided.counts[REBUILT] == 1
    assert divided.parts() == ({2 * 9 + col for col in range(1, 4)}, {9 + 7, *(2 * 9 + col for col in range(5, 8))})


def test_a_pocket_that_is_cut_off_no_longer_counts() -> None:
    status = np.full((5, 9), UNSEEN, dtype=np.uint8)
    status[0], status[-1], status[:, 0], status[:, -1] = BLOCKED, BLOCKED, BLOCKED, BLOCKED
    status[2, 1] = CLEAR
    divided = Divided(status, 2 * 9 + 1, 2 * 9 + 7)
    assert len(divided.parts()[1]) == 3 * 7 - 1
    status[1:4, 4] = BLOCKED
    divided.change(np.array([9 + 4, 2 * 9 + 4, 3 * 9 + 4]))
    assert divided.parts()[1] == {row * 9 + col for row in (1, 2, 3) for col in (5, 6, 7)}
