"""OpenStreetMap indoor mapping (Simple Indoor Tagging) as GeoJSON: all levels of a building in one file, degrees.

Polygons with ``indoor`` = room, area or corridor make the floor; ``level`` is a number, a list or a range ("0;1",
"-1-3", "0.5"), to which ``repeat_on`` adds others. Rooms touch without a wall between them and doors are points on
their outlines: walls of ``wall_m`` and openings of ``door_width_m`` (or the door's own ``width``) are cut. Areas and
corridors that touch are one space. Walls and columns mapped inside a room are taken off its floor, save at their doors.
One plan per level; outdoor features have no ``indoor`` and are passed over.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import LineString, Point

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, Door, FloorPlan, GridPlan, Room
from pipeline.floorplans.projection import LocalFrame, frame_around
from pipeline.floorplans.readers.geojson_features import (
    Feature,
    Features,
    load_features,
    mentions,
    metres_in,
    metres_of,
    outline_of,
    say_repaired,
)
from pipeline.floorplans.readers.json_file import short_name
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.rooms import Passage, free_from_rooms, only_polygons, say_count

_FLOORS = ("room", "area", "corridor")
_OPEN = ("area", "corridor")
_SOLID = ("wall", "column")
_MOST_LEVELS = 200
_HIGHEST = 200
_NUMBER = r"-?[0-9]+(?:\.[0-9]+)?"
_RANGE = re.compile(rf"({_NUMBER})(?:\s*-\s*({_NUMBER}))?")
_ON_WALL_M = 0.05


@dataclass(frozen=True)
class IndoorGeoJson:
    """Reader of GeoJSON with OpenStreetMap's indoor tags."""

    name: str = "indoor_geojson"
    patterns: tuple[str, ...] = ("*.geojson", "*.json")
    uses: tuple[str, ...] = ("levels", "wall_m", "door_width_m")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a GeoJSON collection with indoor and level tags."""
        return mentions(path, "indoor", "level")

    def accompanies(self, path: Path) -> bool:
        """Return False: a venue is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield one plan for each level with rooms, or the error that refuses it; see `Reader.read`."""
        found = load_features(path)
        outlined = [each for each in found.features if each.text("indoor") in _FLOORS and outline_of(each.shape)]
        floors = [feature for feature in outlined if levels_of(feature)]
        if not floors:
            raise PlanError(f"{path}: no room, area or corridor with a level, expected indoor=... and level=... tags.")
        levels = sorted({level for feature in floors for level in levels_of(feature)}, key=float)
        if len(levels) > _MOST_LEVELS:
            raise PlanError(f"{path}: {len(levels)} levels, at most {_MOST_LEVELS} are read. Check the level tags.")
        try:
            frame = frame_around(feature.shape for feature in floors if feature.shape is not None)
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem
        lost = len(outlined) - len(floors)
        said = (f"{say_count(lost, 'room')} without a level that can be read left out",) if lost else ()
        for level in levels:
            if options.levels and level not in options.levels:
                continue
            try:
                yield _plan(path, level, found, frame, options, (*found.remarks(), *said))
            except PlanError as problem:
                yield PlanError(f"{path}, level {level}: {problem}")


def levels_of(feature: Feature) -> tuple[str, ...]:
    """Return the levels of a feature, written as "0", "-1" or "0.5"; empty where it has none that can be read.

    A range stands for its whole numbers. ``repeat_on`` adds the levels on which the feature stands once more.
    """
    found: list[str] = []
    for part in re.split(r"[;,]", f"{feature.text('level')};{feature.text('repeat_on')}"):
        span = _RANGE.fullmatch(part.strip())
        if span is None:
            continue
        low, high = float(span[1]), float(span[2] or span[1])
        if -_HIGHEST <= low <= high <= _HIGHEST:
            found += [f"{low + step + 0.0:g}" for step in range(int(high - low) + 1)]  # + 0.0: "-0" is "0"
    return tuple(dict.fromkeys(found))


def _plan(
    path: Path, level: str, found: Features, frame: LocalFrame, options: ReadOptions, remarks: tuple[str, ...]
) -> FloorPlan:
    here = [feature for feature in found.features if level in levels_of(feature)]
    rooms: list[Room] = []
    open_rooms: set[int] = set()
    repaired = 0
    for feature in here:
        outline = outline_of(metres_of(feature, frame)) if feature.text("indoor") in _FLOORS else None
        if outline is None:
            continue
        if feature.text("indoor") in _OPEN:
            open_rooms.add(len(rooms))
        repaired += outline[1]
        label = feature.text("room") or feature.text("amenity") or feature.text("shop") or feature.text("indoor")
        rooms.append(Room(outline[0], label))
    walls = [wall for feature in here if (wall := _wall(feature, frame, options.wall_m)) is not None]
    passages = [passage for feature in here if (passage := _passage(feature, frame)) is not None]
    outlines = shapely.union_all([shapely.boundary(room.outline) for room in rooms])
    inner = [each for each in passages if _stands_in(walls, each) and outlines.distance(_spot(each)) > _ON_WALL_M]
    joined = free_from_rooms(
        rooms,
        [each for each in passages if each not in inner],
        wall_m=options.wall_m,
        door_width_m=options.door_width_m,
        open_rooms=frozenset(open_rooms),
    )
    gaps = [_spot(each).buffer((each.width or options.door_width_m) / 2) for each in passages]
    solid = shapely.difference(shapely.union_all(walls), shapely.union_all(gaps))
    boxes = np.array([room.outline.bounds for room in rooms])
    stem = short_name(path.stem)
    said = say_repaired(repaired)
    said += (f"{say_count(len(walls), 'wall')} mapped inside rooms taken off the floor",) if walls else ()
    return FloorPlan(
        plan_id=f"{stem}.{level}",
        building=stem,
        floor=f"{stem}.{level}",
        environment="osm_indoor",
        source=path.name,
        free=only_polygons(joined.free.difference(solid)),
        bounds=Bounds(*boxes[:, :2].min(axis=0).tolist(), *boxes[:, 2:].max(axis=0).tolist()),
        rooms=tuple(rooms),
        doors=(*joined.doors, *(Door(each.x, each.y, each.width or options.door_width_m, each.leaf) for each in inner)),
        remarks=(*remarks, *said, *joined.remarks),
    )


def _wall(feature: Feature, frame: LocalFrame, wall_m: float) -> shapely.Geometry | None:
    """Return the area [m] of a wall or column that is mapped by itself; a line is ``wall_m`` thick."""
    if feature.text("indoor") not in _SOLID:
        return None
    shape = metres_of(feature, frame)
    if isinstance(shape, LineString):
        return shape.buffer(wall_m / 2, cap_style="flat")
    outline = outline_of(shape)
    return None if outline is None else outline[0]


def _passage(feature: Feature, frame: LocalFrame) -> Passage | None:
    """Return the door that a point marks, None where it marks none."""
    kind, entrance = feature.text("door"), feature.text("entrance")
    if not isinstance(feature.shape, Point) or not (kind or entrance not in ("", "no")):
        return None
    spot = metres_of(feature, frame)
    return None if spot is None else Passage(spot.x, spot.y, width=metres_in(feature.text("width")), leaf=kind != "no")


def _stands_in(walls: list[shapely.Geometry], passage: Passage) -> bool:
    return any(wall.distance(_spot(passage)) <= _ON_WALL_M for wall in walls)


def _spot(passage: Passage) -> Point:
    return Point(passage.x, passage.y)
