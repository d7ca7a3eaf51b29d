"""Grids drawn on paper: which free space around a house is the sheet, or open ground, and no floor.

Outside is what a square of `GAP_M` can be pushed over from beyond the border. So it comes close to the walls, but not
in by a door that stands open. The corners and niches that it cannot reach count as outside as well, as long as they
are no larger than a closet. What else is joined to the sheet by an opening narrower than the square stays floor.
"""

from dataclasses import replace
from math import ceil

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label, maximum_filter, minimum_filter

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, GridPlan
from pipeline.floorplans.walls import SMALLEST_ROOM_M2

GAP_M = 2.0  # wider than a double door

Mask = NDArray[np.bool_]


def without_paper(plan: GridPlan) -> GridPlan:
    """Return the plan with the free space around the house occupied, and a remark that says how much that is.

    Raises:
        PlanError: nothing free is left.
    """
    free = plan.cells == FREE
    outside = _outside(free, ceil(GAP_M / 2 / plan.resolution))
    outside |= _niches(free & ~outside, outside, SMALLEST_ROOM_M2 / plan.resolution**2)
    if free.any() and not (free & ~outside).any():
        raise PlanError(
            f"{plan.source}: no floor is left within the free space that reaches the border. Are the outer walls open "
            f"by more than {GAP_M:g} m, or is there none? Close them, or leave plans.read.paper away."
        )
    area = np.count_nonzero(outside) * plan.resolution**2
    remark = f"{area:.1f} m2 of free space that reaches the border count as paper around the house"
    cells = np.where(outside, np.uint8(OCCUPIED), plan.cells)
    return replace(plan, cells=cells, remarks=(*plan.remarks, remark))


def _outside(free: Mask, reach: int) -> Mask:
    """Return the ``free`` cells [rows, cols] below a square of 2 ``reach`` + 1 cells pushed around the house."""
    ring = reach + 1
    size = 2 * reach + 1
    around = np.pad(free, ring, constant_values=True).view(np.uint8)
    fits, _ = label(minimum_filter(around, size=size, mode="nearest"))
    from_border = (fits == fits[0, 0]).view(np.uint8)  # the ring is one patch
    covered: Mask = maximum_filter(from_border, size=size, mode="constant").view(np.bool_)
    return covered[ring:-ring, ring:-ring]


def _niches(left: Mask, outside: Mask, most_cells: float) -> Mask:
    """Return the patches of ``left`` [rows, cols] that adjoin the ``outside`` and have at most ``most_cells``."""
    patches, count = label(left)
    padded = np.pad(outside, 1, constant_values=True)  # a niche may lie at the border itself
    beside = padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:]
    taken = np.zeros(count + 1, dtype=np.bool_)
    taken[np.unique(patches[beside & left])] = True
    taken &= np.bincount(patches.ravel(), minlength=count + 1) <= most_cells
    taken[0] = False
    niches: Mask = taken[patches]
    return niches
