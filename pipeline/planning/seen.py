"""All that a planner may know. The floor plan is not in it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.grids.occupancy import Cell
from pipeline.grids.partial_map import PartialMap


class Pose(NamedTuple):
    """Where the robot stands: the centre of a cell, facing along ``heading`` [rad], 0 along +x, counter-clockwise."""

    row: int
    col: int
    heading: float


class Seen(NamedTuple):
    """The belief of a robot at one step.

    map: what was seen so far.
    pose: the robot's cell and heading.
    goal: the goal's cell; its position is known, the way there is not.
    ranges: [beams] float32, the last scan in the robot frame [m]; beam 0 ahead, counter-clockwise.
    resolution: side of a cell [m].
    step: number of scans taken before this one.
    widen: how far [cells] frontiers are widened before those that then touch become one subgoal.
    """

    map: PartialMap
    pose: Pose
    goal: Cell
    ranges: NDArray[np.float32]
    resolution: float
    step: int
    widen: int = 0
