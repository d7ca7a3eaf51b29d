"""A path is checked against the robot's own map: the kernel beside its twin, and each fault by hand."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import PlannerError
from pipeline.grids.occupancy import Cell
from pipeline.grids.partial_map import BLOCKED, CLEAR, UNSEEN, map_of
from pipeline.planning.seen import Pose, Seen
from pipeline.simulation.answers import (
    CORNER,
    ELSEWHERE,
    JUMPS,
    OBSTACLE,
    OUTSIDE,
    SOUND,
    check_surrender,
    checked_path,
    path_fault,
)
from tests.twins import slow_path_is_sound

# 4 rows of 5 cells; row 0 is the lowest. The robot stands at cell 6 = (1, 1), cell 8 = (1, 3) is blocked.
STATUS = np.array(
    [
        [BLOCKED, BLOCKED, BLOCKED, BLOCKED, BLOCKED],
        [BLOCKED, CLEAR, CLEAR, BLOCKED, BLOCKED],
        [BLOCKED, CLEAR, UNSEEN, UNSEEN, BLOCKED],
        [BLOCKED, BLOCKED, BLOCKED, BLOCKED, BLOCKED],
    ],
    dtype=np.uint8,
)


def seen_with(status: np.ndarray, robot: tuple[int, int], goal: tuple[int, int]) -> Seen:
    known = np.zeros_like(status)
    return Seen(map_of(known, status), Pose(*robot, 0.0), Cell(*goal), np.zeros(8, np.float32), 0.5, 16)


@pytest.mark.parametrize(
    ("path", "fault", "place"),
    [
        ([6, 12, 13], SOUND, 0),
        ([6], SOUND, 0),
        ([], ELSEWHERE, 0),
        ([7, 12], ELSEWHERE, 0),
        ([6, 13], JUMPS, 1),
        ([6, 6], JUMPS, 1),
        ([6, 7, 8], OBSTACLE, 2),
        ([6, 7, 13], CORNER, 2),  # past the blocked cell 8
        ([6, 12, 13, 14, 15], OBSTACLE, 3),
        ([6, 20], OUTSIDE, 1),
        ([6, -1], OUTSIDE, 1),
    ],
)
def test_each_fault_by_hand(path: list[int], fault: int, place: int) -> None:
    cells = np.array(path, dtype=np.int32)
    assert path_fault(cells, STATUS, 6) == (fault, place)
    assert slow_path_is_sound(path, STATUS, 6) == (fault == SOUND)


def test_neighbours_by_number_need_not_be_neighbours_on_the_map() -> None:
    status = np.full((4, 5), CLEAR, dtype=np.uint8)
    assert path_fault(np.array([9, 10], dtype=np.int32), status, 9) == (JUMPS, 1), "the end of a row, then the next"


@settings(deadline=None, max_examples=300)
@given(st.integers(0, 2**32 - 1))
def test_the_kernel_equals_its_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rows, cols = rng.integers(3, 8, 2)
    status = rng.choice([CLEAR, UNSEEN, BLOCKED], (rows, cols), p=[0.6, 0.25, 0.15]).astype(np.uint8)
    robot = int(rng.integers(rows * cols))
    moves = rng.choice([1, -1, cols, -cols, cols + 1, cols - 1, 1 - cols, -cols - 1], rng.integers(0, 6))
    path = np.concatenate(([robot], robot + np.cumsum(moves))).astype(np.int32)
    assert (path_fault(path, status, robot)[0] == SOUND) == slow_path_is_sound(path.tolist(), status, robot)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (np.array([6.0, 7.0]), r"Walker on plan 7, scan 17: the path is float64 \(2,\), expected flat cells as int32"),
        (np.array([6, 7]), r"the path is int64 \(2,\), expected flat cells as int32"),
        (np.array([[6, 7]], dtype=np.int32), r"the path is int32 \(1, 2\), expected"),
        ([6, 7], r"the path is list, expected flat cells as int32"),
        (np.array([], dtype=np.int32), "the path is empty"),
        (np.array([6], dtype=np.int32), "the path never moves the robot"),
        (np.array([7, 6], dtype=np.int32), "starts at row 1, col 2, expected the robot's cell at row 1, col 1"),
        (np.array([6, 13], dtype=np.int32), "jumps from row 1, col 1 to row 2, col 3 at place 1"),
        (np.array([6, 99], dtype=np.int32), "has the flat cell 99 at place 1, outside the 4 x 5 grid"),
        (np.array([6, 7, 8], dtype=np.int32), "runs through a seen obstacle.* at row 1, col 3, place 2"),
        (np.array([6, 7, 13], dtype=np.int32), "cuts the corner of a seen obstacle from row 1, col 2 to row 2, col 3"),
    ],
)
def test_a_fault_is_one_sentence(answer: object, message: str) -> None:
    with pytest.raises(PlannerError, match=message):
        checked_path(answer, seen_with(STATUS, (1, 1), (2, 3)), "Walker on plan 7")


def test_the_planner_keeps_its_array() -> None:
    answer = np.array([6, 7], dtype=np.int32)
    taken = checked_path(answer, seen_with(STATUS, (1, 1), (2, 3)), "Walker")
    answer[1] = 99
    assert taken.tolist() == [6, 7]


def test_only_a_goal_that_is_out_of_reach_may_be_given_up() -> None:
    with pytest.raises(PlannerError, match=r"given up, although free or unseen space leads there, 1\.2 m long"):
        check_surrender(seen_with(STATUS, (1, 1), (2, 3)), "Walker")  # (sqrt(2) + 1) x 0.5 m
    shut = STATUS.copy()
    shut[2, 2] = BLOCKED
    check_surrender(seen_with(shut, (1, 1), (2, 3)), "Walker")
    check_surrender(seen_with(STATUS, (1, 1), (1, 3)), "Walker")
