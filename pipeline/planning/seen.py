"""All that a planner may know. The floor plan is not in it."""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.grids.occupancy import Cell
from pipeline.grids.partial_map import PartialMap

CELLS: Final = "cells"
OCCUPANCY: Final = "occupancy"
RANGES: Final = "ranges"
NO_GOAL: Final = Cell(-1, -1)
"""The goal of a drive that has none, such as an exploration."""


class Pose(NamedTuple):
    """Where the robot stands, facing along ``heading`` [rad], 0 along +x, counter-clockwise.

    row, col: the cell that holds its centre. east, north: from the centre of that cell to the robot's [cells], within
    half a cell; 0 for a robot that goes from cell to cell.
    """

    row: int
    col: int
    heading: float
    east: float = 0.0
    north: float = 0.0


class Labelled(NamedTuple):
    """What was seen of a layer of the world, such as rooms or objects: flat cells [k] int32 and their values [k]."""

    cells: NDArray[np.int32]
    values: NDArray[Any]


class Observation(NamedTuple):
    """One look of a sensor, by named channels.

    Every sensor that maps has CELLS, [k] int32 flat cells it looked at, in the order of looking, some of them twice,
    and OCCUPANCY, [k] uint8, FREE or OCCUPIED, without noise. A lidar has RANGES, [beams] float32 in the robot frame
    [m]. A channel that is `Labelled` holds what was seen of the layer of its name. Others are a sensor's own.
    """

    pose: Pose
    channels: Mapping[str, Any]


class Belief(Protocol):
    """What a mapper makes of all observations so far. Predictions belong into fields of its own, not into the map."""

    @property
    def map(self) -> PartialMap:
        """What was observed of each cell, and nothing else."""
        ...

    @property
    def fresh(self) -> int:
        """How many cells the last observation added to the map: planners are asked when there are any."""
        ...


class Seen(NamedTuple):
    """What the robot knows at one step.

    map: what was seen so far.
    pose: the robot's cell and heading.
    goal: the goal's cell; its position is known, the way there is not. NO_GOAL where there is none.
    ranges: [beams] float32, the last scan in the robot frame [m]; beam 0 ahead, counter-clockwise. Empty without lidar.
    resolution: side of a cell [m].
    step: number of scans taken before this one.
    widen: how far [cells] frontiers are widened before those that then touch become one subgoal.
    travelled: cost so far [m]. observation: all channels of the last look. belief: all that the mapper made, with map.
    """

    map: PartialMap
    pose: Pose
    goal: Cell
    ranges: NDArray[np.float32]
    resolution: float
    step: int
    widen: int = 0
    travelled: float = 0.0
    observation: Observation | None = None
    belief: Belief | None = None
