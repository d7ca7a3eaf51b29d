"""OpenStreetMap indoor mapping (Simple Indoor Tagging) as GeoJSON: all levels of a building in one file, degrees.

Polygons with ``indoor`` = room, area or corridor make the floor; ``level`` is a number, a list or a range ("0;1",
"-1-3", "0.5"), to which ``repeat_on`` adds others. Rooms touch without a wall between them and doors are points or
lines on their outlines: walls of ``wall_m`` and openings of ``door_width_m`` (or the door's own ``width``, or the
length of its line) are cut. Areas and corridors that touch are one space. Walls and columns mapped inside a room are
taken off its floor, save at their doors. One plan per level; what has no ``indoor`` and is no door is passed over.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import MultiLineString, Point
from shapely.ops import nearest_points

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, Door, FloorPlan, GridPlan, Room
from pipeline.floorplans.projection import frame_around
from pipeline.floorplans.readers.geojson_features import (
    Opening,
    lines_of,
    load_features,
    mentions,
    openings_of,
    outline_of,
    polygons_of,
    say_repaired,
)
from pipeline.floorplans.readers.indoor_features import OPEN, IndoorMap, Mapped, levels_of, map_of, placed, quoted
from pipeline.floorplans.readers.json_file import short_name
from pipeline.floorplans.readers.osm_values import metres_in
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.rooms import Passage, free_from_rooms, only_polygons, say_count
from pipeline.floorplans.walls import check_lines

_MOST_LEVELS = 200
_ON_WALL_M = 0.05
_STEEPEST = 0.25
_WIDTHS = ("width", "door:width", "entrance:width")


@dataclass(frozen=True)
class IndoorGeoJson:
    """Reader of GeoJSON with OpenStreetMap's indoor tags."""

    name: str = "indoor_geojson"
    patterns: tuple[str, ...] = ("*.geojson", "*.json")
    uses: tuple[str, ...] = ("levels", "wall_m", "door_width_m")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a GeoJSON collection with indoor tags."""
        return mentions(path, "indoor")

    def accompanies(self, path: Path) -> bool:
        """Return False: a venue is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield one plan for each level with rooms, or the error that refuses it; see `Reader.read`."""
        found = load_features(path)
        mapped = map_of(found)
        levels = mapped.levels()
        if not levels:
            texts = [levels_of(feature)[0] for feature in found.features if feature.text("indoor")]
            raise PlanError(
                f"{path}: no room, area or corridor with a level, expected indoor=... and level=... tags, levels as 0, "
                f"-1, 0.5, 0;1 or 0-2{quoted(texts, before='; the levels are ')}."
            )
        if len(levels) > _MOST_LEVELS:
            raise PlanError(f"{path}: {len(levels)} levels, at most {_MOST_LEVELS} are read. Check the level tags.")
        try:
            rooms = [*mapped.rooms, *mapped.maybe]
            mapped = placed(mapped, frame_around(room.metres() for room in rooms))
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem
        for level in mapped.levels():
            if options.levels and level not in options.levels:
                continue
            try:
                yield _plan(path, level, mapped, options, (*found.remarks(), *mapped.remarks))
            except PlanError as problem:
                yield PlanError(f"{path}, level {level}: {problem}")


def _plan(path: Path, level: str, mapped: IndoorMap, options: ReadOptions, remarks: tuple[str, ...]) -> FloorPlan:
    rooms: list[Room] = []
    open_rooms: set[int] = set()
    repaired = 0
    for each in _on(level, mapped.rooms):
        outline = outline_of(each.metres())
        if outline is None:
            continue
        if each.feature.text("indoor").lower() in OPEN:
            open_rooms.add(len(rooms))
        repaired += outline[1]
        rooms.append(Room(outline[0], _label(each)))
    solids = _on(level, mapped.walls)
    check_lines(np.array([line for each in solids for line in lines_of(each.metres())], dtype=object), "the walls")
    walls = [_wall(each, options.wall_m) for each in solids]
    boundaries = shapely.boundary([room.outline for room in rooms])
    passages, unread = _passages(_on(level, mapped.doors), shapely.STRtree([*boundaries, *walls]))
    outlines = shapely.union_all(boundaries)
    solid = shapely.union_all(walls)
    inner = [each for each in passages if _stands_in(solid, each) and outlines.distance(_spot(each)) > _ON_WALL_M]
    joined = free_from_rooms(
        rooms,
        [each for each in passages if each not in inner],
        wall_m=options.wall_m,
        door_width_m=options.door_width_m,
        open_rooms=frozenset(open_rooms),
    )
    gaps = [_spot(each).buffer((each.width or options.door_width_m) / 2) for each in passages]
    boxes = np.array([room.outline.bounds for room in rooms])
    stem = short_name(path.stem)
    said = say_repaired(repaired)
    said += (f"{say_count(len(walls), 'wall')} mapped inside rooms taken off the floor",) if walls else ()
    said += _say_widths(unread)
    return FloorPlan(
        plan_id=f"{stem}.{level}",
        building=stem,
        floor=f"{stem}.{level}",
        environment="osm_indoor",
        source=path.name,
        free=only_polygons(joined.free.difference(shapely.difference(solid, shapely.union_all(gaps)))),
        bounds=Bounds(*boxes[:, :2].min(axis=0).tolist(), *boxes[:, 2:].max(axis=0).tolist()),
        rooms=tuple(rooms),
        doors=(*joined.doors, *(Door(each.x, each.y, each.width or options.door_width_m, each.leaf) for each in inner)),
        remarks=(*remarks, *said, *joined.remarks),
    )


def _on(level: str, mapped: list[Mapped]) -> list[Mapped]:
    return [each for each in mapped if level in each.levels]


def _label(room: Mapped) -> str:
    said = (room.feature.text(key) for key in ("room", "amenity", "shop", "indoor"))
    return next(filter(None, said), "")


def _wall(mapped: Mapped, wall_m: float) -> shapely.Geometry:
    """Return the area [m] of a wall or column that is mapped by itself; a line is ``wall_m`` thick."""
    shape = mapped.metres()
    lines = MultiLineString(lines_of(shape)).buffer(wall_m / 2, cap_style="flat")
    outline = outline_of(shape) if polygons_of(shape) else None
    return shapely.union_all([lines, outline[0]]) if outline is not None else lines


def _passages(doors: list[Mapped], walls: shapely.STRtree) -> tuple[list[Passage], list[str]]:
    """Return the doors, and their widths that are none: a line without a width is as wide as it is long."""
    passages, unread = [], []
    for each in doors:
        text = next(filter(None, map(each.feature.said, _WIDTHS)), "")
        width = metres_in(text)
        unread += [text] if text and width is None else []
        leaf = each.feature.text("door").lower() != "no"
        for opening in openings_of(each.metres()):
            spot, length = _on_wall(opening, walls)
            passages.append(Passage(spot.x, spot.y, width=width or length, leaf=leaf))
    return passages, unread


def _on_wall(opening: Opening, walls: shapely.STRtree) -> tuple[Point, float | None]:
    """Return where an opening is and how wide; a line that runs through a wall, not along it, has no width.

    Such a line is a way through the door: an end lies further from all walls than its middle, or nearer, by a quarter
    of its length. The door is where it meets the wall nearest to its middle.
    """
    if opening.line is None:
        return opening.middle, opening.length
    spots = [opening.middle, *shapely.points(shapely.get_coordinates(opening.line)[[0, -1]])]
    _, away = walls.query_nearest(spots, all_matches=False, return_distance=True)
    if len(away) < len(spots) or (np.abs(away[1:] - away[0]) <= _STEEPEST * opening.line.length).all():
        return opening.middle, opening.length
    crossed = shapely.union_all(walls.geometries[walls.query(opening.line, predicate="intersects")])
    met = shapely.intersection(opening.line, crossed)
    return (opening.middle if met.is_empty else nearest_points(met, opening.middle)[0]), None


def _say_widths(unread: list[str]) -> tuple[str, ...]:
    if not unread:
        return ()
    theirs = "has a width that is no door's or" if len(unread) == 1 else "have widths that are no door's or"
    return (f"{say_count(len(unread), 'door')} {theirs} cannot be read{quoted(unread)}: the usual one is taken",)


def _stands_in(solid: shapely.Geometry, passage: Passage) -> bool:
    return bool(shapely.dwithin(solid, _spot(passage), _ON_WALL_M))


def _spot(passage: Passage) -> Point:
    return Point(passage.x, passage.y)
