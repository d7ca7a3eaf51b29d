"""Schools and offices in the XML of Luperto and co-workers: labelled rooms, walls, and portals that join two rooms.

Units are pixels of a drawing, x to the right, y **down**; it is turned over here. ``represented_distance`` pixels are
``real_distance`` cm; both were measured on one door, so that sizes are good to 5 to 10 %. ``metres_per_unit`` replaces
that scale where a person knows better.

Rooms share one wall line without thickness, and a portal is a segment of zero length on it that names the two rooms:
it is cut open to ``door_width_m``, to twice as much where the file says DOUBLE. IMPLICIT portals have no door leaf.
The file's name names the building: 50 of the 70 published files have a path of somebody's computer as building name.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError

from defusedxml import ElementTree
from defusedxml.common import DefusedXmlException
from shapely.geometry import Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, FloorPlan, GridPlan, Room
from pipeline.floorplans.readers.json_file import LARGEST_NUMBER, MOST_COORDINATES, short_text, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.rooms import Passage, free_from_rooms, say_count

_MOST_BYTES = 10_000_000  # the largest published file has half a million
_MOST_ROOMS = 5_000
_SMALLEST_SCALE, _LARGEST_SCALE = 0.001, 10.0  # metres per pixel; published files have 0.03 to 0.18
_FLOOR_OF = re.compile(r"(?:[_-]P?|(?<!\d))\d$")  # "Valleceppi_P0", "Sabadell2", but not the end of "plan-51605"
_METRES_OF = {"mm": 0.001, "cm": 0.01, "m": 1.0}
_GIVE_IT = "Give it: plans.read.metres_per_unit=0.09"
_ABOUT = "the scale was measured on one door: sizes are good to 5 to 10 %"


@dataclass(frozen=True)
class Luperto:
    """Reader of one floor per XML file."""

    name: str = "luperto"
    patterns: tuple[str, ...] = ("*.xml",)
    uses: tuple[str, ...] = ("metres_per_unit", "wall_m", "door_width_m")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` begins as a building with the scale of its drawing."""
        text = sniff_text(path)
        return "<building" in text and "<represented_distance" in text

    def accompanies(self, path: Path) -> bool:
        """Return False: a floor is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the file; see `Reader.read`. Uses the width of doors, the walls and the scale."""
        building = _parse(path)
        stated = options.metres_per_unit is None
        scale = _scale(path, building) if options.metres_per_unit is None else options.metres_per_unit
        spaces = building.findall("floor/spaces/space")[: _MOST_ROOMS + 1]
        if not spaces or len(spaces) > _MOST_ROOMS:
            raise PlanError(
                f"{path}: {len(spaces)} spaces, expected 1 to {_MOST_ROOMS} in floor/spaces. Check the file."
            )
        rooms, number_of, skipped = _rooms(path, spaces, scale)
        passages, unclear = _passages(path, spaces, scale, number_of, options.door_width_m)
        try:
            joined = free_from_rooms(rooms, passages, wall_m=options.wall_m, door_width_m=options.door_width_m)
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem
        said = [f"{say_count(skipped, 'space')} without an outline left out"] if skipped else []
        said += [f"{say_count(unclear, 'portal')} without two rooms or a place left closed"] if unclear else []
        boxes = [room.outline.bounds for room in rooms]
        stem = path.stem.removesuffix("_updated")
        yield FloorPlan(
            plan_id=stem,
            building=_FLOOR_OF.sub("", stem).rstrip("_-") or stem,
            floor=stem,
            environment=f"luperto_{_kind(building)}",
            source=path.name,
            free=joined.free,
            bounds=Bounds(*(pick(box[side] for box in boxes) for side, pick in enumerate((min, min, max, max)))),
            rooms=rooms,
            doors=joined.doors,
            remarks=(*((_ABOUT,) if stated else ()), *joined.remarks, *said),
        )


def _parse(path: Path) -> Element:
    """Parse the file; entities, external files and oversized documents are refused."""
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise PlanError(f"{path}: more than {_MOST_BYTES:,} bytes, at most that many are read. Split the file.")
        root = ElementTree.parse(path, forbid_dtd=True).getroot()
    except DefusedXmlException as problem:
        raise PlanError(f"{path}: holds entities or a DTD ({problem}), which are not read. Remove them.") from problem
    except (ParseError, ValueError, LookupError, OSError, RecursionError) as problem:
        raise PlanError(f"{path}: not readable XML ({short_text(str(problem))}). Get the file again.") from problem
    if root is None or root.tag != "building":
        tag = short_text(root.tag) if root is not None else ""
        raise PlanError(f"{path}: begins with <{tag}>, expected <building>. Is it such a floor?")
    return root


def _kind(building: Element) -> str:
    kind = (building.findtext("building_type/main_type") or "").strip().lower()
    return f"{kind}s" if kind in ("school", "office") else "floors"


def _scale(path: Path, building: Element) -> float:
    """Return the metres per pixel."""
    pixels, real = (
        _number(path, f"scale/{key}", (building.findtext(f"scale/{key}/value") or "").strip(), _GIVE_IT)
        for key in ("represented_distance", "real_distance")
    )
    unit = (building.findtext("scale/real_distance/um") or "cm").strip()
    if pixels <= 0 or real <= 0 or unit not in _METRES_OF:
        raise PlanError(
            f"{path}: the scale is {real:g} {short_text(unit)} for {pixels:g} pixels, expected cm and pixels above 0. "
            f"{_GIVE_IT}"
        )
    scale = real * _METRES_OF[unit] / pixels
    if not _SMALLEST_SCALE <= scale <= _LARGEST_SCALE:
        raise PlanError(
            f"{path}: {real:g} {unit} for {pixels:g} pixels is {scale:g} m per pixel, expected {_SMALLEST_SCALE:g} to "
            f"{_LARGEST_SCALE:g}. {_GIVE_IT}"
        )
    return scale


def _rooms(path: Path, spaces: list[Element], scale: float) -> tuple[tuple[Room, ...], dict[str, int], int]:
    """Return the rooms, the number of each by its id, and how many spaces had no outline."""
    rooms: list[Room] = []
    number_of: dict[str, int] = {}
    budget = MOST_COORDINATES
    for space in spaces:
        corners = [_point(path, point, scale) for point in space.findall("bounding_polygon/point")]
        budget -= len(corners)
        if budget < 0:
            raise PlanError(f"{path}: more than {MOST_COORDINATES:,} points, at most that many are read.")
        if len(set(corners)) >= 3:
            number_of[space.get("id", "")] = len(rooms)
            rooms.append(Room(Polygon(corners), short_text((space.findtext("labels/label") or "").strip())))
    if not rooms:
        raise PlanError(f"{path}: no space has an outline of 3 corners or more. Get the file again.")
    return tuple(rooms), number_of, len(spaces) - len(rooms)


def _passages(
    path: Path, spaces: list[Element], scale: float, number_of: dict[str, int], width: float
) -> tuple[list[Passage], int]:
    """Return the portals, and how many of them lack a place or their rooms. Most are listed twice, by both rooms."""
    segments = {
        segment.get("id", ""): segment
        for space in spaces
        for segment in space.findall("space_representation/linesegment")
    }
    passages, unclear = [], 0
    for portal in (portal for space in spaces for portal in space.findall("portals/portal")):
        segment = segments.get((portal.findtext("linesegment") or "").strip())
        ends = [_point(path, point, scale) for point in segment.findall("point")] if segment is not None else []
        targets = [number_of.get((target.text or "").strip()) for target in portal.findall("target/id")]
        rooms: Any = tuple(number for number in dict.fromkeys(targets) if number is not None)
        if not ends or len(rooms) != 2:
            unclear += 1
            continue
        x, y = (sum(values) / len(ends) for values in zip(*ends, strict=True))
        double = "DOUBLE" in (portal.findtext("features") or "")
        leaf = "IMPLICIT" not in (portal.findtext("type") or "")
        passages.append(Passage(x, y, rooms, 2 * width if double else None, leaf))
    return passages, unclear


def _point(path: Path, point: Element, scale: float) -> tuple[float, float]:
    return _number(path, "point/@x", point.get("x")) * scale, -_number(path, "point/@y", point.get("y")) * scale


def _number(path: Path, key: str, value: str | None, help_: str = "Repair the file.") -> float:
    try:
        number = float(value or "")
    except ValueError:
        number = float("nan")
    if not (isfinite(number) and abs(number) <= LARGEST_NUMBER):
        raise PlanError(f"{path}: {key} = {short_text(value or '')!r}, expected a finite number. {help_}")
    return number
