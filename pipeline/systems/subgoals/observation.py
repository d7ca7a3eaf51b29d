"""Positions as the robot sees them: the numbers from which every subgoal's datum and estimate is made."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal


class Observation(NamedTuple):
    """One scan and n subgoals in the robot frame: x ahead, y to the left [m].

    ranges: [beams] float32 [m]; goal: [2] float32; subgoals: [n, 2] float32.
    """

    ranges: NDArray[np.float32]
    goal: NDArray[np.float32]
    subgoals: NDArray[np.float32]


def observe(seen: Seen, subgoals: Sequence[Subgoal]) -> Observation:
    """Return the scan, the goal and ``subgoals`` in the robot frame of this step."""
    cols = seen.map.known.shape[1]
    points = np.array([subgoal.point for subgoal in subgoals], dtype=np.int64)
    rows, columns = np.divmod(points, cols)
    offsets = np.stack([columns - seen.pose.col, rows - seen.pose.row], axis=1)
    to_goal = np.array([[seen.goal.col - seen.pose.col, seen.goal.row - seen.pose.row]])
    cos, sin = np.cos(seen.pose.heading), np.sin(seen.pose.heading)
    turn = np.array([[cos, -sin], [sin, cos]]) * seen.resolution  # world offset @ turn = robot frame
    return Observation(
        seen.ranges,
        (to_goal @ turn)[0].astype(np.float32),
        (offsets @ turn).astype(np.float32),
    )
