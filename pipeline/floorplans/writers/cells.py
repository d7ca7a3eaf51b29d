"""What writers of grids have in common."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import PlanError
from pipeline.floorplans.plan import CLUTTER, FloorPlan, GridPlan


def as_grid(plan: FloorPlan | GridPlan, format_name: str) -> GridPlan:
    """Return ``plan``, which must be a grid.

    Raises:
        PlanError: it is geometry, or a cell holds no value of a plan.
    """
    if isinstance(plan, FloorPlan):
        raise PlanError(f"plan {plan.plan_id}: is geometry, and {format_name} holds cells alone. Rasterize it first.")
    if plan.cells.ndim != 2 or plan.cells.size == 0 or plan.cells.max() > CLUTTER:
        raise PlanError(f"plan {plan.plan_id}: expected cells [rows, cols] with values up to {CLUTTER}. Repair it.")
    return plan


def coded(plan: GridPlan, code_of: Mapping[int, int]) -> NDArray[np.uint8]:
    """Return the code of each cell, as pictures have it: [rows, cols] uint8, row 0 the top."""
    codes = np.zeros(max(code_of) + 1, dtype=np.uint8)
    codes[list(code_of)] = list(code_of.values())
    picture: NDArray[np.uint8] = codes[plan.cells[::-1]]
    return picture
