"""How wide the openings of a floor are: marked doors where a source has them, else an estimate from the free space."""

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.ndimage import find_objects, label

from pipeline.errors import PlanError
from pipeline.floorplans.passages import grid_passage_width, passage_width
from pipeline.floorplans.plan import FREE, Door, FloorPlan, GridPlan, Location

Mask = NDArray[np.bool_]

NARROWEST_DOOR_M = 0.6  # a marked patch below this is a splinter of the drawing: no person passes it
_MOST_DOORS = 10_000


def narrowest_opening(plan: FloorPlan | GridPlan) -> float | None:
    """Return the width of the narrowest door, or passage where no door is marked [m]; None without a floor."""
    widths = [door.width for door in plan.doors if door.width >= NARROWEST_DOOR_M]
    if widths:
        return min(widths)
    if isinstance(plan, FloorPlan):
        return passage_width(plan.free)
    return grid_passage_width(plan.cells == FREE, plan.resolution)


def doors_from(marked: Mask, resolution: float, origin: Location) -> tuple[Door, ...]:
    """Return one door per 4-connected patch of ``marked`` [rows, cols]: its middle and the longer side [m].

    The longer side of a patch is the clear width of the opening, as long as walls are thinner than doors are wide;
    it is taken from the smallest rectangle, at any angle, around the patch.

    Raises:
        PlanError: there are far too many patches.
    """
    patches, count = label(marked)
    if count > _MOST_DOORS:
        raise PlanError(f"{count:,} patches are marked as doors, at most {_MOST_DOORS:,} are read. Is it noise?")
    doors = []
    for number, window in enumerate(find_objects(patches), start=1):
        rows, cols = np.nonzero(patches[window] == number)
        rows, cols = rows + window[0].start, cols + window[1].start
        outline = shapely.oriented_envelope(shapely.union_all(shapely.box(cols, rows, cols + 1, rows + 1)))
        corners = shapely.get_coordinates(outline)
        width = np.hypot(*np.diff(corners[:3], axis=0).T).max()
        x, y = (float(np.mean(cols) + 0.5), float(np.mean(rows) + 0.5))
        doors.append(Door(origin.x + x * resolution, origin.y + y * resolution, round(float(width) * resolution, 3)))
    return tuple(doors)
