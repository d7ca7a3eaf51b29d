"""The canonical input does not know how the robot stood, nor whether the plan was a mirror image."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipeline.systems.subgoals.inputs import subgoal_inputs

BEAM = 2 * np.pi / 256

coordinate = st.floats(-20, 20, allow_nan=False)
point = st.tuples(coordinate, coordinate).filter(lambda xy: np.hypot(*xy) > 0.1).map(np.array)
seeds = st.integers(0, 2**32 - 1)


def scan(seed: int) -> NDArray[np.float32]:
    return np.random.default_rng(seed).uniform(0.2, 10.0, 256).astype(np.float32)


def turned(xy: NDArray[np.float64], angle: float) -> NDArray[np.float64]:
    """``xy`` in the frame of a robot that has turned by ``angle``."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([cosine * xy[0] + sine * xy[1], cosine * xy[1] - sine * xy[0]])


def test_robot_frame_is_plain_concatenation() -> None:
    ranges = scan(0)
    row = subgoal_inputs(ranges, (1, 2), [(3, 4), (5, 6)], frame="robot")
    assert row.dtype == np.float32
    assert np.array_equal(row[:, :256], [ranges, ranges])
    assert np.array_equal(row[:, 256:], [[1, 2, 3, 4], [1, 2, 5, 6]])


def test_a_subgoal_to_the_left_is_turned_ahead() -> None:
    ranges = np.arange(256, dtype=np.float32)
    (row,) = subgoal_inputs(ranges, (1.0, 3.0), (0.0, 2.0))  # goal then lies 3 m ahead, 1 m to the right: mirrored
    assert row[256:].tolist() == pytest.approx([3.0, 1.0, 2.0, 0.0])
    assert row[:3].tolist() == [64.0, 63.0, 62.0]
    (row,) = subgoal_inputs(ranges, (-1.0, 3.0), (0.0, 2.0))  # to the left: not mirrored
    assert row[256:].tolist() == pytest.approx([3.0, 1.0, 2.0, 0.0])
    assert row[[0, 1, 255]].tolist() == [64.0, 65.0, 63.0]


@given(seeds, point, point, st.integers(-300, 300))
def test_turning_the_robot_by_whole_beams_changes_nothing(
    seed: int, goal: NDArray[np.float64], subgoal: NDArray[np.float64], beams: int
) -> None:
    ranges = scan(seed)
    before = subgoal_inputs(ranges, goal, subgoal)
    after = subgoal_inputs(np.roll(ranges, -beams), turned(goal, beams * BEAM), turned(subgoal, beams * BEAM))
    np.testing.assert_allclose(after[:, 256:], before[:, 256:], atol=1e-4)
    if not _on_an_edge(goal, subgoal):
        assert np.array_equal(after[:, :256], before[:, :256])


@given(seeds, point, point)
def test_mirroring_the_scene_changes_nothing(
    seed: int, goal: NDArray[np.float64], subgoal: NDArray[np.float64]
) -> None:
    ranges, flip = scan(seed), np.array([1.0, -1.0])
    before = subgoal_inputs(ranges, goal, subgoal)
    after = subgoal_inputs(np.roll(ranges[::-1], 1), goal * flip, subgoal * flip)
    np.testing.assert_allclose(after[:, 256:], before[:, 256:], atol=1e-4)
    if not _on_an_edge(goal, subgoal):
        assert np.array_equal(after[:, :256], before[:, :256])


@given(seeds, point, point)
def test_nothing_is_lost_but_heading_and_hand(
    seed: int, goal: NDArray[np.float64], subgoal: NDArray[np.float64]
) -> None:
    ranges = scan(seed)
    (row,) = subgoal_inputs(ranges, goal, subgoal)
    assert np.array_equal(np.sort(row[:256]), np.sort(ranges))
    assert np.hypot(*row[256:258]) == pytest.approx(np.hypot(*goal), rel=1e-5)
    assert row[258] == pytest.approx(np.hypot(*subgoal), rel=1e-5)
    assert row[257] >= 0.0
    assert row[259] == 0.0
    gap = np.hypot(row[256] - row[258], row[257])
    assert gap == pytest.approx(np.hypot(*(goal - subgoal)), rel=1e-4, abs=1e-4)


@pytest.mark.parametrize("frame", ["subgoal", "robot"])
def test_one_scan_for_many_subgoals_equals_one_at_a_time(frame: str) -> None:
    rng = np.random.default_rng(3)
    ranges, goal, subgoals = scan(1), rng.normal(size=2), rng.normal(size=(6, 2))
    together = subgoal_inputs(ranges, goal, subgoals, frame=frame)  # type: ignore[arg-type]
    repeated = subgoal_inputs(np.tile(ranges, (6, 1)), np.tile(goal, (6, 1)), subgoals, frame=frame)  # type: ignore[arg-type]
    alone = [subgoal_inputs(ranges, goal, subgoal, frame=frame)[0] for subgoal in subgoals]  # type: ignore[arg-type]
    assert np.array_equal(together, alone)
    assert np.array_equal(together, repeated)


def test_a_subgoal_under_the_robot_is_taken_as_ahead() -> None:
    (row,) = subgoal_inputs(scan(2), (0.0, 1.0), (0.0, 0.0))
    assert np.array_equal(row[:256], scan(2))
    assert row[256:].tolist() == [0.0, 1.0, 0.0, 0.0]


@pytest.mark.parametrize("beams", [8, 64, 512])
def test_a_scan_of_any_length_is_turned_whole(beams: int) -> None:
    ranges = np.arange(beams, dtype=np.float32)
    (left,) = subgoal_inputs(ranges, (-1.0, 3.0), (0.0, 2.0))  # a quarter turn: beam `beams / 4` lies ahead
    assert np.array_equal(left[:beams], np.roll(ranges, -beams // 4))
    assert left[beams:].tolist() == pytest.approx([3.0, 1.0, 2.0, 0.0])
    (plain,) = subgoal_inputs(ranges, (1.0, 2.0), (3.0, 4.0), frame="robot")
    assert plain.tolist() == [*ranges.tolist(), 1.0, 2.0, 3.0, 4.0]


def test_no_rows_give_no_rows() -> None:
    assert subgoal_inputs(np.empty((0, 256)), np.empty((0, 2)), np.empty((0, 2))).shape == (0, 260)


def test_an_unknown_frame_is_named() -> None:
    with pytest.raises(ValueError, match="input frame 'world' is unknown"):
        subgoal_inputs(scan(0), (1, 0), (1, 0), frame="world")  # type: ignore[arg-type]


def _on_an_edge(goal: NDArray[np.float64], subgoal: NDArray[np.float64]) -> bool:
    """Whether rounding may go either way: the subgoal between two beams, the goal dead ahead or behind."""
    at = np.arctan2(subgoal[1], subgoal[0]) / BEAM
    across = (subgoal[0] * goal[1] - subgoal[1] * goal[0]) / np.hypot(*subgoal)
    return bool(abs(at - np.floor(at) - 0.5) < 1e-6 or abs(across) < 1e-6)
