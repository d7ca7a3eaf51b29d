"""Positions as the robot sees them: the numbers from which every subgoal's datum and estimate is made."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
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
    points = np.array([seen.goal.row * cols + seen.goal.col, *(subgoal.point for subgoal in subgoals)])
    places = _in_robot_frame(points, cols, seen.pose.row, seen.pose.col, seen.pose.heading, seen.resolution)
    return Observation(seen.ranges, places[0], places[1:])


@njit(cache=True, nogil=True)
def _in_robot_frame(
    points: NDArray[np.int64], cols: int, row: int, col: int, heading: float, resolution: float
) -> NDArray[np.float32]:
    """Return the flat cells ``points`` as the robot at (row, col) sees them: [n, 2] float32, x ahead, y left [m]."""
    cos, sin = np.cos(heading) * resolution, np.sin(heading) * resolution
    places = np.empty((points.size, 2), dtype=np.float32)
    for k in range(points.size):
        east, north = points[k] % cols - col, points[k] // cols - row
        places[k, 0] = east * cos + north * sin
        places[k, 1] = north * cos - east * sin
    return places
