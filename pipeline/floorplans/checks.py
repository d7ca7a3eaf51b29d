"""Checks at import: is this a floor at a plausible scale, with finite geometry and connected free space?"""

from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.ndimage import label
from shapely.errors import GEOSException

from pipeline.errors import PlanError
from pipeline.floorplans.openings import NARROWEST_DOOR_M, narrowest_opening
from pipeline.floorplans.plan import CLUTTER, FREE, OCCUPIED, UNKNOWN, Bounds, FloorPlan, GridPlan, bounds_of

SMALLEST_M, LARGEST_M = 2.0, 2000.0
FINEST_M, COARSEST_M = 0.01, 1.0
_PAPER = 0.8  # of the border of a grid that is free: no house is that open
_WELL_CONNECTED = 0.9


@dataclass(frozen=True, kw_only=True)
class PlanReport:
    """What was found in a plan that may be used.

    width_m, height_m: extent of the drawing [m]. free_components: 4-connected parts of the free space.
    largest_free_share: area of the largest part over all free area. narrowest_door_m: see `narrowest_opening` [m].
    warnings: sentences for a person; none of them stops the plan. What the reader did stands in `Plan.remarks`.
    """

    width_m: float
    height_m: float
    free_components: int
    largest_free_share: float
    narrowest_door_m: float | None
    warnings: tuple[str, ...]


class Checked(NamedTuple):
    """A plan that may be used, and what was found in it."""

    plan: FloorPlan | GridPlan
    report: PlanReport


def inspect(plan: FloorPlan | GridPlan) -> PlanReport:
    """Check a plan and report what was found.

    Raises:
        PlanError: not finite, not a floor at a plausible scale, no free space, or an endpoint outside it.
    """
    bounds = bounds_of(plan)
    _check_scale(plan, bounds)
    _check_endpoints(plan)
    areas = _polygon_parts(plan) if isinstance(plan, FloorPlan) else _grid_parts(plan)
    if not areas.size or areas.sum() <= 0:
        raise PlanError(
            f"{_name(plan)}: the plan is empty, it has no free space. Check polarity, layers and thresholds."
        )
    share = float(areas.max() / areas.sum())
    return PlanReport(
        width_m=bounds.max_x - bounds.min_x,
        height_m=bounds.max_y - bounds.min_y,
        free_components=int(areas.size),
        largest_free_share=share,
        narrowest_door_m=_narrowest(plan),
        warnings=_warnings(plan, share),
    )


def _narrowest(plan: FloorPlan | GridPlan) -> float | None:
    try:
        return narrowest_opening(plan)
    except (GEOSException, MemoryError) as problem:
        raise PlanError(f"{_name(plan)}: the floor is too tangled to be measured. Simplify its outline.") from problem


def _check_scale(plan: FloorPlan | GridPlan, bounds: Bounds) -> None:
    numbers = list(bounds)
    if isinstance(plan, FloorPlan):
        numbers += shapely.get_coordinates(plan.free).ravel().tolist()
    if not all(isfinite(number) for number in numbers):
        raise PlanError(f"{_name(plan)}: a coordinate is not a finite number, expected metres. Repair the plan.")
    if isinstance(plan, GridPlan) and not FINEST_M <= plan.resolution <= COARSEST_M:
        raise PlanError(
            f"{_name(plan)}: resolution {plan.resolution:g} m per cell, expected {FINEST_M:g} to {COARSEST_M:g}. "
            "Correct it at the source."
        )
    for side, size in (("wide", bounds.max_x - bounds.min_x), ("high", bounds.max_y - bounds.min_y)):
        if not SMALLEST_M <= size <= LARGEST_M:
            raise PlanError(
                f"{_name(plan)}: the plan is {size:g} m {side}, expected {SMALLEST_M:g} to {LARGEST_M:g} m. "
                "Check its scale (metres, or metres per cell)."
            )


def _check_endpoints(plan: FloorPlan | GridPlan) -> None:
    if plan.endpoints is None or isinstance(plan, GridPlan):
        return
    for name, spot in zip(("start", "goal"), plan.endpoints, strict=True):
        if not shapely.contains_xy(plan.free, spot.x, spot.y):
            raise PlanError(f"{_name(plan)}: the {name} ({spot.x:g}, {spot.y:g}) m is not on free floor. Move it.")


def _polygon_parts(plan: FloorPlan) -> NDArray[np.float64]:
    if not plan.free.is_valid:
        raise PlanError(f"{_name(plan)}: {shapely.is_valid_reason(plan.free)}. Repair the outline.")
    areas: NDArray[np.float64] = shapely.area(shapely.get_parts(plan.free))
    return areas


def _grid_parts(plan: GridPlan) -> NDArray[np.float64]:
    if plan.cells.max(initial=FREE) > CLUTTER:
        raise PlanError(f"{_name(plan)}: cells hold {plan.cells.max()}, expected values up to {CLUTTER}.")
    parts, _ = label(plan.cells == FREE)
    return np.bincount(parts.ravel())[1:].astype(np.float64) * plan.resolution**2


def _warnings(plan: FloorPlan | GridPlan, share: float) -> tuple[str, ...]:
    found = []
    if share < _WELL_CONNECTED:
        found.append(f"only {share:.0%} of the free floor is one connected part: sealed rooms or doors drawn as walls")
    splinters = sum(door.width < NARROWEST_DOOR_M for door in plan.doors)
    if splinters:
        found.append(f"{splinters} of {len(plan.doors)} marked doors are below {NARROWEST_DOOR_M} m and not counted")
    if isinstance(plan, GridPlan):
        unknown, occupied = ((plan.cells == value).mean() for value in (UNKNOWN, OCCUPIED))
        if occupied == 0:
            found.append("no cell is occupied: walls may be missing, or the thresholds are wrong")
        edge = np.concatenate([plan.cells[0], plan.cells[-1], plan.cells[:, 0], plan.cells[:, -1]]) == FREE
        if edge.mean() > _PAPER:
            found.append(
                f"{edge.mean():.0%} of the border is free: if that is paper around the house and no floor, say "
                "plans.read.paper=true"
            )
        if unknown > 0.9:
            found.append(f"{unknown:.0%} of the cells are unknown")
    return tuple(found)


def _name(plan: FloorPlan | GridPlan) -> str:
    return f"plan {plan.plan_id} ({plan.source})"
