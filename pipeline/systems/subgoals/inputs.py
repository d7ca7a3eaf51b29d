"""The network's input, built by this one function for training and for planning alike.

The ranges of a scan, the goal's (x, y), the subgoal's (x, y), all in metres. For the 256 ranges of the paper these are
260 numbers (Stein et al. 2018, section 4); for B ranges, B + 4.
"""

from typing import Final, Literal

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

PLACES: Final = 4  # coordinates of the goal and the subgoal, behind the ranges
INPUT_FRAMES: Final = ("subgoal", "robot")

InputFrame = Literal["subgoal", "robot"]


def subgoal_inputs(
    ranges: NDArray[np.floating], goal_xy: ArrayLike, subgoal_xy: ArrayLike, *, frame: InputFrame = "subgoal"
) -> NDArray[np.float32]:
    """Return the network's input, one row per subgoal.

    ranges: [B] or [N, B] m; beam i at angle ``2 pi i / B`` counter-clockwise from the robot's heading.
    goal_xy, subgoal_xy: [2] or [N, 2] m, robot frame (x ahead, y left). One scan or goal may serve many subgoals.
    frame: "robot" joins the three as they are, as the paper does. "subgoal" turns the scene so that the subgoal
        lies straight ahead and mirrors it so that the goal lies to the left: what the robot's heading was, and
        whether the plan was a mirror image, can then not matter, and the network need not learn that.
    Returns [N, B + PLACES] float32.
    """
    scans = np.array(ranges, ndmin=2, copy=None)
    goals = np.array(goal_xy, np.float64, ndmin=2, copy=None)
    subgoals = np.array(subgoal_xy, np.float64, ndmin=2, copy=None)
    beams = scans.shape[1]
    inputs = np.empty((max(len(scans), len(goals), len(subgoals)), beams + PLACES), np.float32)
    if frame == "robot":
        inputs[:, :beams], inputs[:, beams : beams + 2], inputs[:, beams + 2 :] = scans, goals, subgoals
        return inputs
    if frame != "subgoal":
        raise ValueError(f"input frame {frame!r} is unknown: expected one of {INPUT_FRAMES}")
    _turn_and_mirror(scans.astype(np.float32), goals, subgoals, inputs)
    return inputs


@njit(cache=True, nogil=True)
def _turn_and_mirror(
    scans: NDArray[np.float32], goals: NDArray[np.float64], subgoals: NDArray[np.float64], inputs: NDArray[np.float32]
) -> None:
    """Fill ``inputs`` [N, B + PLACES]; of ``scans``, ``goals``, ``subgoals`` each has N rows or one that serves all."""
    beams = scans.shape[1]
    for row in range(inputs.shape[0]):
        scan, goal, subgoal = scans[row % len(scans)], goals[row % len(goals)], subgoals[row % len(subgoals)]
        bearing = np.arctan2(subgoal[1], subgoal[0])  # 0 for a subgoal under the robot: it has none
        cosine, sine = np.cos(bearing), np.sin(bearing)
        left = cosine * goal[1] - sine * goal[0]
        beam = int(np.rint(bearing * (beams / (2.0 * np.pi))))
        turn = -1 if left < 0.0 else 1
        for place in range(beams):
            inputs[row, place] = scan[(beam + turn * place) % beams]
        inputs[row, beams] = cosine * goal[0] + sine * goal[1]
        inputs[row, beams + 1] = abs(left)
        inputs[row, beams + 2] = cosine * subgoal[0] + sine * subgoal[1]  # its distance
        inputs[row, beams + 3] = 0.0
