"""How a plan looks in any picture: free floor white, walls dark, unknown grey, doors orange, cut-off floor tinted.

The largest connected part of the free floor is white. Every other part has a tint of its own, so that a sealed room
or a door drawn as a wall is seen at once.
"""

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.ndimage import label
from shapely.geometry import Polygon

from pipeline.floorplans.plan import CLUTTER, FREE, OCCUPIED, UNKNOWN, FloorPlan, GridPlan
from pipeline.reports.style import BLUE, ORANGE

Pixels = NDArray[np.uint8]

WALL = (43, 54, 69)
FLOOR = (255, 255, 255)
UNSEEN = (201, 206, 213)
FURNITURE = (186, 150, 104)
DOOR = ORANGE
SPLINTER = BLUE
"""A marked door too narrow for a person."""
TINTS = ((255, 214, 153), (176, 224, 198), (186, 214, 245), (240, 196, 222), (224, 214, 160), (205, 196, 236))


def tint(rank: int) -> tuple[int, int, int]:
    """Return the colour of the part of the free floor with this rank by area, 0 the largest."""
    return FLOOR if rank == 0 else TINTS[(rank - 1) % len(TINTS)]


def parts_of(plan: FloorPlan) -> list[Polygon]:
    """Return the connected parts of the free floor, the largest first."""
    parts = [part for part in shapely.get_parts(plan.free) if isinstance(part, Polygon) and not part.is_empty]
    return sorted(parts, key=lambda part: -part.area)


def shades_of(plan: GridPlan) -> Pixels:
    """Return the colour of each cell: [rows, cols, 3], row 0 the lowest y."""
    palette = np.zeros((max(FREE, OCCUPIED, UNKNOWN, CLUTTER) + 1, 3), dtype=np.uint8)
    palette[[FREE, OCCUPIED, UNKNOWN, CLUTTER]] = (FLOOR, WALL, UNSEEN, FURNITURE)
    shades = palette[plan.cells]
    numbers, count = label(plan.cells == FREE)
    if count > 1:
        order = np.argsort(-np.bincount(numbers.ravel(), minlength=count + 1)[1:], kind="stable")
        tints = np.zeros((count + 1, 3), dtype=np.uint8)
        tints[1 + order] = [tint(rank) for rank in range(count)]
        free = numbers > 0
        shades[free] = tints[numbers[free]]
    return np.asarray(shades)
