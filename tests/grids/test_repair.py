"""A repaired field is, to the last bit, the field computed anew, whatever opened and closed."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.grids.distances import NOWHERE, SHUT, open_field, settle, workspace_for
from pipeline.grids.fields import LiveField, MapField, RobotField, RovingField
from pipeline.grids.partial_map import BLOCKED, CHANGES, CLEAR, UNSEEN, map_of
from pipeline.grids.repair import GAVE_UP, repair
from tests.twins import slow_field
from tests.worlds import cells_from, scattered


def anew(status: np.ndarray, source: int, limit: int = 0) -> np.ndarray:
    field = open_field(status, limit)
    settle(field, status.shape[1], source, NOWHERE, workspace_for(status.size))
    return field


@settings(deadline=None, max_examples=400)
@given(
    seed=st.integers(0, 2**32 - 1),
    walls=st.floats(0.0, 0.5),
    kind=st.sampled_from(["close", "open", "both"]),
    size=st.integers(1, 40),
)
def test_repaired_equals_computed_anew(seed: int, walls: float, kind: str, size: int) -> None:
    rng = np.random.default_rng(seed)
    status = scattered(rng, *rng.integers(3, 24, 2), share=walls)
    inner = np.arange(status.size, dtype=np.int32).reshape(status.shape)[1:-1, 1:-1].ravel()
    source = int(rng.choice(inner))
    field = LiveField(status, 0, source, workspace_for(status.size))
    for _ in range(8):
        changed = rng.choice(inner, size)  # some of them twice, some of them as they were
        status.ravel()[changed] = {"close": 1, "open": 0, "both": rng.integers(0, 2, size)}[kind]
        field.update(changed)
        assert np.array_equal(field.values, anew(status, source))


def test_the_detour_around_a_closed_door_by_hand() -> None:
    status = cells_from("#######", "#..#..#", "#.....#", "#..#..#", "#..#..#", "#.....#", "#######").astype(np.uint8)
    source, door, behind = 4 * 7 + 1, 4 * 7 + 3, 4 * 7 + 5
    field = anew(status, source)
    assert field[behind] == 4.0
    status.ravel()[door] = 1
    cleared = repair(field, status, 0, source, 0.0, np.array([door], np.int32), 49, workspace_for(49))
    assert cleared > 0 and field[door] == SHUT
    expected = slow_field(status == 0, 4, 1)[4, 5]
    assert abs(field[behind] - expected) < 1e-6 and expected > 8.0


def test_what_concerns_no_shortest_way_costs_nothing() -> None:
    status = cells_from("#######", "#.....#", "#.....#", "#.....#", "#######").astype(np.uint8)
    field, corner = anew(status, 2 * 7 + 1), 3 * 7 + 5
    status.ravel()[corner] = 1
    touched = repair(field, status, 0, 2 * 7 + 1, 0.0, np.array([corner], np.int32), 35, workspace_for(35))
    assert touched == 1, "only the closed cell itself"


def test_too_large_a_repair_is_given_up_and_done_anew() -> None:
    status = cells_from("##########", "#........#", "#.########", "#........#", "##########").astype(np.uint8)
    source, only_way = 3 * 10 + 8, 2 * 10 + 1
    field = anew(status, source)
    status.ravel()[only_way] = 1
    work, changed = workspace_for(50), np.array([only_way], np.int32)
    assert repair(field.copy(), status, 0, source, 0.0, changed, 3, work) == GAVE_UP
    status.ravel()[only_way] = 0
    live = LiveField(status, 0, source, work)
    status.ravel()[only_way] = 1
    live.update(changed)
    assert np.array_equal(live.values, anew(status, source))


def test_fields_of_a_map_read_its_journal() -> None:
    rng = np.random.default_rng(4)
    status = np.full((20, 24), UNSEEN, dtype=np.uint8)
    status[0], status[-1], status[:, 0], status[:, -1] = BLOCKED, BLOCKED, BLOCKED, BLOCKED
    map_, work = map_of(np.zeros_like(status), status), workspace_for(status.size)
    inner = np.arange(status.size, dtype=np.int32).reshape(status.shape)[1:-1, 1:-1].ravel()
    source = int(inner[200])
    onward, roving = MapField(map_, UNSEEN, source, work), RovingField(map_, CLEAR, work)
    robot = RobotField(map_, CLEAR, source, work)
    for _ in range(30):
        for cell in rng.choice(inner, 12, replace=False):
            now = {
                UNSEEN: rng.choice([CLEAR, BLOCKED], p=[0.8, 0.2]),
                CLEAR: rng.choice([CLEAR, BLOCKED], p=[0.9, 0.1]),
            }
            if status.ravel()[cell] != (new := now.get(status.ravel()[cell], BLOCKED)):
                status.ravel()[cell] = new
                map_.changes[map_.written[CHANGES]] = cell
                map_.written[CHANGES] += 1
        assert np.array_equal(onward.catch_up(), anew(status, source, UNSEEN))
        place = int(rng.choice(inner))
        assert np.array_equal(roving.settle(place, NOWHERE), anew(status, place, CLEAR))
        robot.move(place)
        expected = anew(status, place, CLEAR)
        assert np.array_equal(np.where(robot.values == SHUT, SHUT, robot.values - robot.base), expected)
