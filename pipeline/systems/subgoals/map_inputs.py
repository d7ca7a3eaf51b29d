"""What a view of the map holds, and the network's input made of it: by this one function for training and planning.

Rather few buildings can be harvested, so a view holds what carries over from one to the next: how much farther than
the best way this one is, how wide the boundary is, whether space that was never seen leads on to the goal, and how
open the surroundings are in 32 directions. `pipeline.systems.subgoals.map_view` makes it.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.systems.subgoals.inputs import INPUT_FRAMES

Values = NDArray[np.float64]

DIRECTIONS: Final = 32
SIGHT_M: Final = 15.0  # how far a view looks in each direction
CLEARANCES_M: Final = (0.0, 0.45, 0.9)  # distance kept from known obstacles on the way through unseen space
FARTHEST_M: Final = 999.0  # stands for "no way"
NUMBERS: Final = (
    "reach_m",  # travel distance from the robot to the frontier, at the cell where the optimistic way crosses it
    "onward_m",  # optimistic travel distance from there to the goal
    "straight_m",  # straight distance from the subgoal to the goal
    "detour_m",  # onward_m - straight_m
    "behind_m",  # by how much the optimistic way through this frontier is longer than the shortest through any
    "lead_m",  # the same, against the shortest through any other: negative for the best
    "nearer",  # number of subgoals with a shorter optimistic way
    "rivals",  # number of subgoals
    "cells",  # size of the frontier
    "extent",  # its longer side in cells
    "facing",  # cosine of the angle between where the frontier faces and the goal
    "aside",  # absolute sine of that angle
    "depth",  # unseen cells around the frontier that lie to one side of it, for each of its cells
    *(f"beyond_{clearance}_m" for clearance in CLEARANCES_M),  # way to the goal through unseen space alone
    *(f"rival_beyond_{clearance}_m" for clearance in CLEARANCES_M),  # the shortest such way from another frontier
)
_PLAIN = slice(10, 13)  # numbers that are used as they are; of the others the logarithm
_STRAIGHT = NUMBERS.index("straight_m")
_BEYOND, _RIVAL = slice(13, 16), slice(16, 19)
MAP_VIEW: Final = len(NUMBERS) + 3 * DIRECTIONS  # numbers in a view; the datum table stores as many
MAP_INPUTS: Final = MAP_VIEW + 2 * len(CLEARANCES_M)

INPUT_KINDS: Final = (*INPUT_FRAMES, "map")  # what train.input_frame allows


def map_inputs(views: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return the network's input [N, MAP_INPUTS] float32 for ``views`` [N, MAP_VIEW].

    Distances and counts enter as logarithms, since a metre matters less the farther off it is; three detours and
    three leads of the ways through unseen space are added.
    """
    values = np.array(views, dtype=np.float64, ndmin=2)
    count = len(NUMBERS)
    numbers = _signed_log(values[:, :count])
    numbers[:, _PLAIN] = values[:, _PLAIN]
    detours = np.maximum(values[:, _BEYOND] - values[:, [_STRAIGHT]], 0.0)
    leads = values[:, _BEYOND] - values[:, _RIVAL]
    parts = [numbers, _signed_log(detours), _signed_log(leads), values[:, count:]]
    return np.concatenate(parts, axis=1).astype(np.float32)


def _signed_log(values: Values) -> Values:
    logs: Values = np.sign(values) * np.log1p(np.abs(values))
    return logs
