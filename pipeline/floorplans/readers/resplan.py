"""ResPlan: homes with their rooms, doors and walls as WKT polygons, in units that differ from record to record.

A record's scale is, in this order: ``plans.read.metres_per_unit``; or what makes the rooms as large as its ``net_area``
[m2], where the record has one. Else the record is refused, with the scale at which its doors would have the width
``door_width_m``: a guess is worth saying, not worth using silently, for doors of 0.7 m and of 1 m are both common.

The floor is rooms and inner doors without the walls. Rooms of a home are drawn up to the inner face of its walls, and
doors as patches in them. A front door and windows lead outside, and stay closed. y is taken as pointing up.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from math import sqrt
from pathlib import Path

import numpy as np
import shapely
from shapely.errors import GEOSException
from shapely.geometry import MultiPolygon, Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers.drawing import LARGEST_UNIT, Drawing, plan_of, scale_of
from pipeline.floorplans.readers.json_file import finite_number, load_json, short_name, short_text, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.rooms import say_repaired
from pipeline.floorplans.walls import check_outline, door_of

_NOT_ROOMS = ("door", "window", "front_door", "wall", "inner", "land", "garden", "parking")
_NOT_NET = ("balcony",)
_MOST_LETTERS = 2_000_000  # of the WKT of one shape
_MOST_SHAPES = 20_000
# Collections and curves: GEOS crashes on deep ones.
_NESTED = re.compile(r"\s*(?:GEOMETRYCOLLECTION|\w*CURVE|\w*SURFACE|CIRCULARSTRING)", re.IGNORECASE)
_NARROW_M, _WIDE_M = 0.4, 2.5  # of the doors of homes, in the median


@dataclass(frozen=True)
class ResPlan:
    """Reader of homes; each record is its own building."""

    name: str = "resplan"
    patterns: tuple[str, ...] = ("*.json",)
    uses: tuple[str, ...] = ("metres_per_unit", "wall_m")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` begins with a record of WKT polygons by class."""
        text = sniff_text(path)
        return '"geometries"' in text and "POLYGON" in text and text.lstrip()[:1] in ("{", "[")

    def accompanies(self, path: Path) -> bool:
        """Return False: a record carries everything with it."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the homes; see `Reader.read`. Uses the scale; the width of doors only to propose one."""
        content = load_json(path)
        records = content if isinstance(content, list) else [content]
        if not records:
            raise PlanError(f'{path}: no record in it, expected homes with "geometries". Check the file.')
        for number, record in enumerate(records):
            try:
                yield _home(path, number, record, options)
            except PlanError as problem:
                yield problem


def _home(path: Path, number: int, record: object, options: ReadOptions) -> FloorPlan:
    geometries = record.get("geometries") if isinstance(record, dict) else None
    if not isinstance(record, dict) or not isinstance(geometries, dict):
        raise PlanError(f'{path}, record {number}: {short_text(record)}, expected a home with "geometries" by class.')
    key = short_name(record.get("id", number))
    name = f"{path}, home {key}"
    shapes = {str(kind): _polygons(f"{name}: {short_text(kind)}", texts) for kind, texts in geometries.items()}
    drawing = Drawing(
        walls=[*shapes.get("wall", []), *shapes.get("window", [])],
        openings=[*shapes.get("door", [])],
        rooms=[(shape, short_text(kind)) for kind in shapes if kind not in _NOT_ROOMS for shape in shapes[kind]],
        remarks=["the file does not say where y points: it was taken as up"],
    )
    if not drawing.rooms:
        raise PlanError(f"{name}: no room in it, expected polygons of living, bedroom and others.")
    scale = _scale(name, record, drawing, options)
    used = [*drawing.walls, *drawing.openings, *(outline for outline, _ in drawing.rooms)]
    if crossed := sum(not shape.is_valid for shape in used):
        drawing.remarks.append(say_repaired(crossed))
    plan_id = f"{path.stem}.{key}"
    return plan_of(drawing, scale, options, plan_id=plan_id, building=plan_id, environment="resplan_homes", path=path)


def _scale(name: str, record: dict[str, object], drawing: Drawing, options: ReadOptions) -> float:
    """Return the scale that a person or the net area gives [m per unit], if doors have the width of doors at it."""
    scale = _given_scale(name, record, drawing, options)
    width = float(np.median([door_of(opening).width for opening in drawing.openings])) if drawing.openings else None
    if width is not None and not _NARROW_M <= width * scale <= _WIDE_M:
        raise PlanError(
            f"{name}: at {scale:.3g} m per unit its doors are {width * scale:.3g} m wide, expected {_NARROW_M:g} to "
            f"{_WIDE_M:g}. They are {options.door_width_m:g} m wide at plans.read.metres_per_unit="
            f"{options.door_width_m / max(width, 1e-9):.3g}, which may need a file of its own."
        )
    return scale


def _given_scale(name: str, record: dict[str, object], drawing: Drawing, options: ReadOptions) -> float:
    drawn = sum(shape.area for shape, kind in drawing.rooms if kind not in _NOT_NET)
    if options.metres_per_unit is None and record.get("net_area") is not None and drawn > 0:
        net = finite_number(record["net_area"], f"{name}: net_area", largest=1e5)
        if net > 0:
            drawing.remarks.append(f"the scale was set so that the rooms have the net area of {net:g} m2")
            return sqrt(net / drawn)
    return scale_of(name, drawing, options)


def _polygons(name: str, texts: object) -> list[Polygon | MultiPolygon]:
    """Return the areas in a list of WKT texts."""
    if not isinstance(texts, list) or len(texts) > _MOST_SHAPES:
        raise PlanError(f"{name} is {short_text(texts)}, expected a list of at most {_MOST_SHAPES:,} WKT polygons.")
    found = []
    for text in texts:
        if not isinstance(text, str) or len(text) > _MOST_LETTERS:
            raise PlanError(f"{name} holds {short_text(text)}, expected WKT polygons.")
        if _NESTED.match(text):
            raise PlanError(f"{name}: {short_text(text[:40])!r} is no polygon. Repair the record.")
        try:
            with np.errstate(all="ignore"):  # numbers beyond a float are refused below
                shape = shapely.from_wkt(text)
        except (GEOSException, UnicodeEncodeError) as problem:
            raise PlanError(f"{name}: {short_text(text[:40])!r} is not WKT ({short_text(str(problem))}).") from problem
        if not isinstance(shape, Polygon | MultiPolygon):
            raise PlanError(f"{name}: {short_text(text[:40])!r} is no polygon. Repair the record.")
        if not (np.abs(shapely.get_coordinates(shape)) <= LARGEST_UNIT).all():
            raise PlanError(f"{name}: a coordinate is not finite or beyond {LARGEST_UNIT:g}. Repair the record.")
        check_outline(shape, name)
        if not shape.is_empty:
            found.append(shapely.force_2d(shape))
    return found
