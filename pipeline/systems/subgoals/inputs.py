"""The network's input, built by this one function for training and for planning alike.

260 numbers: 256 ranges, the goal's (x, y), the subgoal's (x, y), all in metres (Stein et al. 2018, section 4).
"""

from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

BEAMS: Final = 256
INPUTS: Final = BEAMS + 4
INPUT_FRAMES: Final = ("subgoal", "robot")

InputFrame = Literal["subgoal", "robot"]

GOAL: Final = slice(BEAMS, BEAMS + 2)
SUBGOAL: Final = slice(BEAMS + 2, BEAMS + 4)

# [2, 256, 256]: row f of the first holds the beams counter-clockwise from beam f; of the second clockwise, mirrored.
_ORDERS: Final[NDArray[np.intp]] = (
    np.array([np.add.outer(np.arange(BEAMS), turn * np.arange(BEAMS)) for turn in (1, -1)], dtype=np.intp) % BEAMS
)


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
    bearing = np.arctan2(subgoals[:, 1], subgoals[:, 0])  # 0 for a subgoal under the robot: it has none
    cosine, sine = np.cos(bearing), np.sin(bearing)
    left = cosine * goals[:, 1] - sine * goals[:, 0]
    first = np.rint(bearing * (BEAMS / (2.0 * np.pi))).astype(np.intp)
    beams = _ORDERS[(left < 0.0).astype(np.intp), first]  # a negative bearing counts from the last beam down
    inputs[:, :BEAMS] = scans[0].take(beams) if len(scans) == 1 else np.take_along_axis(scans, beams, axis=1)
    inputs[:, BEAMS] = cosine * goals[:, 0] + sine * goals[:, 1]
    inputs[:, BEAMS + 1] = np.abs(left)
    inputs[:, BEAMS + 2] = cosine * subgoals[:, 0] + sine * subgoals[:, 1]  # its distance
    inputs[:, BEAMS + 3] = 0.0
    return inputs
