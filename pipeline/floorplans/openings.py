"""How wide the openings of a floor are: marked doors where a source has them, else an estimate from the free space."""

from collections.abc import Callable

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, find_objects, label
from shapely.geometry import MultiPolygon, Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, Door, FloorPlan, GridPlan, Location

Mask = NDArray[np.bool_]

NARROWEST_DOOR_M = 0.6  # a marked patch below this is a splinter of the drawing: no person passes it
_MOST_DOORS = 10_000
_REACH = 0.95  # share of the floor that must stay within reach
_WIDEST_M = 8.0  # wider passages are not told apart
_PRECISION_M = 0.01


def narrowest_opening(plan: FloorPlan | GridPlan) -> float | None:
    """Return the width of the narrowest door, or passage where no door is marked [m]; None without a floor."""
    widths = [door.width for door in plan.doors if door.width >= NARROWEST_DOOR_M]
    if widths:
        return min(widths)
    return (
        passage_width(plan.free)
        if isinstance(plan, FloorPlan)
        else grid_passage_width(plan.cells == FREE, plan.resolution)
    )


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


def passage_width(free: Polygon | MultiPolygon) -> float | None:
    """Return the width of the widest robot that still reaches 95 % of the floor a point reaches [m], to 1 cm.

    A doorway to less than 5 % of the floor is not seen, and passages above 8 m count as 8 m.
    """

    def reach(width: float) -> float:
        core = shapely.buffer(free, -width / 2, join_style="mitre")
        return float(_largest_part(core).buffer(width / 2, join_style="mitre").area)

    return _widest(reach)


def grid_passage_width(free: Mask, resolution: float) -> float | None:
    """Return the same as `passage_width`, for free cells [rows, cols] of ``resolution`` [m]."""
    clearance = distance_transform_edt(np.pad(free, 1)) * resolution

    def reach(width: float) -> float:
        core, count = label(clearance > width / 2)
        if not count:
            return 0.0
        largest = core == 1 + int(np.argmax(np.bincount(core.ravel())[1:]))
        grown = distance_transform_edt(~largest) * resolution < width / 2 if width > 0 else largest
        return float(np.count_nonzero(grown & (clearance > 0)))

    return _widest(reach)


def _widest(reach: Callable[[float], float]) -> float | None:
    """Bisect for the largest width that keeps the reach; the reach falls as the width grows."""
    needed = _REACH * reach(0.0)
    if needed == 0:
        return None
    low, high = 0.0, _WIDEST_M
    while high - low > _PRECISION_M:
        middle = (low + high) / 2
        low, high = (middle, high) if reach(middle) >= needed else (low, middle)
    return round(high, 2) if high == _WIDEST_M else round(low, 2)


def _largest_part(shape: Polygon | MultiPolygon) -> Polygon:
    parts = shapely.get_parts(shape)
    return parts[int(np.argmax(shapely.area(parts)))] if len(parts) else Polygon()
