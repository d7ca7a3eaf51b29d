"""Floor plans as a source gives them: geometry where it is geometry, a grid where it is a grid.

World frame of a plan: metres, x to the right, y up. Row 0 of a grid is the lowest y; its origin is the outer
corner of ``cells[0, 0]``.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPolygon, Polygon

from pipeline.errors import PlanError

# What a cell of a plan may hold. The first three are the values of an occupancy grid; a plan also keeps furniture
# apart from walls, so that the choice to count it as an obstacle is made later, at rasterize.
FREE = 0
OCCUPIED = 1
UNKNOWN = 2
CLUTTER = 3

Cells = NDArray[np.uint8]


class Location(NamedTuple):
    """A position in the world frame of a plan [m]."""

    x: float
    y: float


class Bounds(NamedTuple):
    """An axis-parallel box in the world frame of a plan [m]."""

    min_x: float
    min_y: float
    max_x: float
    max_y: float


class Door(NamedTuple):
    """An opening that the source marks as a door: its middle and the width of the passage [m].

    leaf: False for an opening without a door leaf, such as a passage between two halls.
    """

    x: float
    y: float
    width: float
    leaf: bool = True


class Room(NamedTuple):
    """A room as its source outlines it [m]; ``label`` is what the source calls it, such as OFFICE, or empty."""

    outline: Polygon | MultiPolygon
    label: str


class Layer(NamedTuple):
    """What a grid says of its cells beside their occupancy.

    values: [rows, cols] uint16, row 0 the lowest y. labels: the name of each value that has one.
    """

    values: NDArray[np.uint16]
    labels: Mapping[int, str]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What every plan carries, whatever its form.

    plan_id: unique name. building: the key by which plans are split; floors and variants of one building share it.
    floor: variants of one floor (same walls, other furniture) share it. environment: class of places, "mit_floors".
    source: the file or generator it came from. split: the split it was drawn for, None when still to be decided.
    doors: where the source marks them. endpoints: the start and goal the plan was drawn for [m].
    remarks: sentences of the reader on what it repaired, assumed or left out.
    """

    plan_id: str
    building: str
    floor: str
    environment: str
    source: str
    split: str | None = None
    doors: tuple[Door, ...] = ()
    endpoints: tuple[Location, Location] | None = None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class FloorPlan(Plan):
    """A plan as geometry.

    free: the navigable floor [m]; holes are walls. It alone decides where a robot may be.
    bounds: the extent of the drawing [m]. rooms: as the source outlines and labels them; they may overlap walls.
    """

    free: Polygon | MultiPolygon
    bounds: Bounds
    rooms: tuple[Room, ...] = ()


@dataclass(frozen=True, kw_only=True)
class GridPlan(Plan):
    """A plan as cells.

    cells: [rows, cols] uint8 of FREE, OCCUPIED, UNKNOWN, CLUTTER, row 0 the lowest y. resolution: side of a cell [m].
    origin: outer corner of ``cells[0, 0]`` in the world frame [m]. layers: what else the source says of each cell, by
    name, such as "rooms" or "semantics".
    """

    cells: Cells
    resolution: float
    origin: Location
    layers: Mapping[str, Layer] = field(default_factory=dict)


def bounds_of(plan: FloorPlan | GridPlan) -> Bounds:
    """Return the extent of the plan [m]."""
    if isinstance(plan, FloorPlan):
        return plan.bounds
    rows, cols = plan.cells.shape
    return Bounds(
        plan.origin.x, plan.origin.y, plan.origin.x + cols * plan.resolution, plan.origin.y + rows * plan.resolution
    )


def without_margins(plan: FloorPlan | GridPlan) -> FloorPlan | GridPlan:
    """Return a grid without the unknown cells around what is known of it, which most of a laser map may be."""
    if isinstance(plan, FloorPlan):
        return plan
    known = plan.cells != UNKNOWN
    rows, cols = (np.flatnonzero(known.any(axis=axis)) for axis in (1, 0))
    if not rows.size:
        return plan
    window = (slice(rows[0], rows[-1] + 1), slice(cols[0], cols[-1] + 1))
    return replace(
        plan,
        cells=plan.cells[window],
        origin=Location(plan.origin.x + int(cols[0]) * plan.resolution, plan.origin.y + int(rows[0]) * plan.resolution),
        layers={name: layer._replace(values=layer.values[window]) for name, layer in plan.layers.items()},
    )


def polygon_from(points: Iterable[tuple[float, float]], *, name: str) -> Polygon:
    """Return the polygon with the corners ``points`` [m]; ``name`` says in an error which plan it belongs to.

    Raises:
        PlanError: a coordinate is not finite, there are fewer than three corners, or the outline crosses itself.
    """
    corners = [(float(x), float(y)) for x, y in points]
    if not all(isfinite(x) and isfinite(y) for x, y in corners):
        raise PlanError(f"{name}: a corner is not a finite number, expected metres. Repair the plan.")
    if len(corners) < 3:
        raise PlanError(f"{name}: a polygon needs at least 3 corners, got {len(corners)}. Repair the plan.")
    polygon = Polygon(corners)
    if not polygon.is_valid:
        raise PlanError(f"{name}: {shapely.is_valid_reason(polygon)}. Repair the outline.")
    return polygon
