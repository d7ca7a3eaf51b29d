"""The network's input, built by this one function for training and for planning alike.

260 numbers: 256 ranges, the goal's (x, y), the subgoal's (x, y), all in metres (Stein et al. 2018, section 4).
"""

from typing import Final, Literal

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

BEAMS: Final = 256
INPUTS: Final = BEAMS + 4
INPUT_FRAMES: Final = ("subgoal", "robot")

InputFrame = Literal["subgoal", "robot"]

GOAL: Final = slice(BEAMS, BEAMS + 2)
SUBGOAL: Final = slice(BEAMS + 2, BEAMS + 4)


def subgoal_inputs(
    ranges: NDArray[np.floating], goal_xy: ArrayLike, subgoal_xy: ArrayLike, *, frame: InputFrame = "subgoal"
) -> NDArray[np.float32]:
    """Return the network's input, one row per subgoal.

    ranges: [256] or [N, 256] m; beam i at angle ``2 pi i / 256`` counter-clockwise from the robot's heading.
    goal_xy, subgoal_xy: [2] or [N, 2] m, robot frame (x ahead, y left). One scan or goal may serve many subgoals.
    frame: "robot" joins the three as they are, as the paper does. "subgoal" turns the scene so that the subgoal
        lies straight ahead and mirrors it so that the goal lies to the left: what the robot's heading was, and
        whether the plan was a mirror image, can then not matter, and the network need not learn that.
    Returns [N, 260] float32.
    """
    scans = np.array(ranges, ndmin=2, copy=None)
    goals = np.array(goal_xy, np.float64, ndmin=2, copy=None)
    subgoals = np.array(subgoal_xy, np.float64, ndmin=2, copy=None)
    inputs = np.empty((max(len(scans), len(goals), len(subgoals)), INPUTS), np.float32)
    if frame == "robot":
        inputs[:, :BEAMS], inputs[:, GOAL], inputs[:, SUBGOAL] = scans, goals, subgoals
        return inputs
    if frame != "subgoal":
        raise ValueError(f"input frame {frame!r} is unknown: expected one of {INPUT_FRAMES}")
    _turn_and_mirror(scans.astype(np.float32), goals, subgoals, inputs)
    return inputs


@njit(cache=True, nogil=True)
def _turn_and_mirror(
    scans: NDArray[np.float32], goals: NDArray[np.float64], subgoals: NDArray[np.float64], inputs: NDArray[np.float32]
) -> None:
    """Fill ``inputs`` [N, 260]; of ``scans``, ``goals`` and ``subgoals`` each has N rows or one that serves all."""
    for row in range(inputs.shape[0]):
        scan, goal, subgoal = scans[row % len(scans)], goals[row % len(goals)], subgoals[row % len(subgoals)]
        bearing = np.arctan2(subgoal[1], subgoal[0])  # 0 for a subgoal under the robot: it has none
        cosine, sine = np.cos(bearing), np.sin(bearing)
        left = cosine * goal[1] - sine * goal[0]
        beam = int(np.rint(bearing * (BEAMS / (2.0 * np.pi))))
        turn = -1 if left < 0.0 else 1
        for place in range(BEAMS):
            inputs[row, place] = scan[(beam + turn * place) % BEAMS]
        inputs[row, BEAMS] = cosine * goal[0] + sine * goal[1]
        inputs[row, BEAMS + 1] = abs(left)
        inputs[row, BEAMS + 2] = cosine * subgoal[0] + sine * subgoal[1]  # its distance
        inputs[row, BEAMS + 3] = 0.0
