"""Plans as GeoJSON that any map tool can show; `pipeline.floorplans.readers.plan_geojson` reads it back unchanged.

RFC 7946 wants longitude and latitude, but a plan has no place on earth: its coordinates are local metres, x to the
right and y up, and the foreign member ``hinterland`` of the collection says so. It also holds what belongs to the whole
plan. Each feature says in ``kind`` what it is:

- geometry: ``free`` (the floor), ``room`` with its label, ``door`` with width and leaf, ``start`` and ``goal``;
- a grid: one area for all cells of a value, ``free``, ``unknown`` and ``clutter``, each with resolution, origin and
  shape [rows, cols]; what is in none of them is occupied. ``layer`` areas hold the other values of a cell.

A feature stands on a line of its own, so that two versions of a plan can be compared.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Point, Polygon
from shapely.geometry.polygon import orient

from pipeline.errors import PlanError
from pipeline.files import write_text
from pipeline.floorplans.cell_areas import CellRaster
from pipeline.floorplans.plan import FloorPlan, GridPlan, bounds_of
from pipeline.floorplans.readers.json_file import MOST_COORDINATES
from pipeline.floorplans.readers.plan_geojson import CELL_KINDS, FRAME, MEMBER, VERSION

_Record: TypeAlias = dict[str, Any]


class _Part(NamedTuple):
    """A feature to be: its shape [m] and its properties."""

    shape: shapely.Geometry
    properties: _Record


@dataclass(frozen=True)
class GeoJson:
    """Writer of plans as GeoJSON in local metres."""

    name: str = "plan_geojson"
    ending: str = ".geojson"
    needs_cells: bool = False

    def write(self, plan: FloorPlan | GridPlan, path: Path) -> list[Path]:
        """Write ``plan`` to ``path``; see `Writer.write`."""
        parts = list(_of_geometry(plan) if isinstance(plan, FloorPlan) else _of_grid(plan))
        parts += list(_doors_and_endpoints(plan))
        corners = sum(int(shapely.get_num_coordinates(part.shape)) for part in parts)
        if corners > MOST_COORDINATES:
            raise PlanError(
                f"plan {plan.plan_id}: its outlines have {corners:,} corners, at most {MOST_COORDINATES:,} are written "
                "as GeoJSON. Write it as a picture."
            )
        head = {"type": "FeatureCollection", MEMBER: _about(plan)}
        try:
            lines = ",\n".join(json.dumps(_feature(part), allow_nan=False) for part in parts)
            text = f'{json.dumps(head, allow_nan=False)[:-1]}, "features": [\n{lines}\n]}}\n'
        except ValueError as problem:
            raise PlanError(f"plan {plan.plan_id}: a number is not finite, expected metres. Repair it.") from problem
        write_text(path, text)
        return [path]


def _about(plan: FloorPlan | GridPlan) -> _Record:
    """Return what belongs to the whole plan."""
    about: _Record = {"version": VERSION, "units": "m", "frame": FRAME}
    about |= {key: getattr(plan, key) for key in ("plan_id", "building", "floor", "environment", "source", "split")}
    about |= {"bounds": [float(number) for number in bounds_of(plan)], "remarks": list(plan.remarks)}
    if isinstance(plan, FloorPlan):
        return about | {"form": "geometry"}
    named = {name: {str(value): label for value, label in layer.labels.items()} for name, layer in plan.layers.items()}
    return about | {"form": "grid", **_raster(plan), "layers": named}


def _raster(plan: GridPlan) -> _Record:
    origin = [float(plan.origin.x), float(plan.origin.y)]
    return {"resolution": float(plan.resolution), "origin": origin, "shape": list(plan.cells.shape)}


def _of_geometry(plan: FloorPlan) -> Iterator[_Part]:
    yield _Part(plan.free, {"kind": "free"})
    for room in plan.rooms:
        yield _Part(room.outline, {"kind": "room", "label": room.label})


def _of_grid(plan: GridPlan) -> Iterator[_Part]:
    raster = CellRaster(plan.resolution, plan.origin, *plan.cells.shape)
    try:
        for value, kind in CELL_KINDS.items():
            yield _Part(raster.area_of(plan.cells == value), {"kind": kind, **_raster(plan)})
        for name, layer in plan.layers.items():
            for value in np.unique(layer.values[layer.values > 0]).tolist():
                said = {"layer": name, "value": value, "label": layer.labels.get(value, "")}
                yield _Part(raster.area_of(layer.values == value), {"kind": "layer", **said})
    except PlanError as problem:
        raise PlanError(f"plan {plan.plan_id}: {problem}. Write it as a picture.") from problem


def _doors_and_endpoints(plan: FloorPlan | GridPlan) -> Iterator[_Part]:
    for door in plan.doors:
        yield _Part(Point(door.x, door.y), {"kind": "door", "width": float(door.width), "leaf": bool(door.leaf)})
    if plan.endpoints is not None:
        for kind, spot in zip(("start", "goal"), plan.endpoints, strict=True):
            yield _Part(Point(spot.x, spot.y), {"kind": kind})


def _feature(part: _Part) -> _Record:
    """Return the feature; an empty shape has no geometry, as GeoJSON says it.

    Outlines run counterclockwise and holes clockwise, as RFC 7946 wants them.
    """
    shape = part.shape
    if isinstance(shape, Polygon):
        shape = orient(shape)
    elif isinstance(shape, MultiPolygon):
        shape = MultiPolygon([orient(polygon) for polygon in shape.geoms])
    geometry = None if shape.is_empty else shapely.geometry.mapping(shape)
    return {"type": "Feature", "properties": part.properties, "geometry": geometry}
