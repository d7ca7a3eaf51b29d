"""What a robot knows of a building, as arrays that scans update in place.

``known`` holds what was seen of each cell; ``status`` holds whether the robot's centre may be there:

- CLEAR: seen free, and no seen obstacle within the robot's radius;
- UNSEEN: not seen, and no seen obstacle within the robot's radius;
- BLOCKED: a seen obstacle lies within the robot's radius (or the cell is on the outermost ring).

Travel through known space is ``status <= CLEAR``; with the unknown taken as free it is ``status <= UNSEEN``.
"""

from typing import NamedTuple

import numpy as np

from pipeline.grids.occupancy import UNKNOWN, Cells

CLEAR = 0
UNSEEN = 1
BLOCKED = 2


class PartialMap(NamedTuple):
    """A partly seen map.

    known: [rows, cols] uint8 of FREE, OCCUPIED, UNKNOWN; row 0 is the lowest y.
    status: [rows, cols] uint8 of CLEAR, UNSEEN, BLOCKED for the robot's centre.
    """

    known: Cells
    status: Cells


def unseen_map(rows: int, cols: int) -> PartialMap:
    """Return the map of a robot that has not yet sensed anything."""
    known = np.full((rows, cols), UNKNOWN, dtype=np.uint8)
    status = np.full((rows, cols), UNSEEN, dtype=np.uint8)
    status[0], status[-1], status[:, 0], status[:, -1] = BLOCKED, BLOCKED, BLOCKED, BLOCKED
    return PartialMap(known, status)
