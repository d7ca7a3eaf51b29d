"""What the features of an indoor map are (rooms, walls, doors), and on which levels each of them stands.

What a map leaves out is taken from what it says elsewhere: a door or a wall without a level stands on those of the
rooms that it belongs to, and an area that is only said to be indoors is a room where no other floor lies. Whatever is
left out or taken so is counted.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.projection import LocalFrame
from pipeline.floorplans.readers.geojson_features import (
    Feature,
    Features,
    encloses,
    metres_of,
    openings_of,
    outline_of,
    say_left_out,
)
from pipeline.floorplans.readers.osm_values import Levels, levels_in
from pipeline.floorplans.rooms import say_count

FLOORS = ("room", "area", "corridor")
OPEN = ("area", "corridor")
_SOLID = ("wall", "column")
_NO_ROOM = ("building", "building:part", "highway", "area:highway", "railway", "furniture", "barrier", "man_made")
_ROOM, _WALL, _DOOR, _MAYBE_ROOM = "room", "wall", "door", "indoor area"
_LACKING = {_ROOM: "an outline", _MAYBE_ROOM: "an outline", _WALL: "a line or outline", _DOOR: "a shape"}
_REACH_M = 0.6  # as far from an outline a door may stand that says no level
_NEARLY_M = 0.05  # what is as near as the nearest
_MOSTLY = 0.5
_MOST_PAIRS = 100_000
_MOST_QUOTED = 3
_ONLY_LEVEL = ("0",)  # of a map in which nothing has a level


class Mapped(NamedTuple):
    """A feature that is read. levels: where it stands; shape: in degrees, or in metres once it is placed."""

    feature: Feature
    levels: tuple[str, ...]
    shape: shapely.Geometry | PlanError

    def metres(self) -> shapely.Geometry:
        """Return the shape [m] of a feature that is placed.

        Raises:
            PlanError: it lies too far from the rest.
        """
        if isinstance(self.shape, PlanError):
            raise self.shape
        return self.shape


class IndoorMap(NamedTuple):
    """The rooms, walls and doors of all levels; ``remarks`` say what was left out or taken from elsewhere.

    maybe: areas with indoor=yes, before they are placed.
    """

    rooms: list[Mapped]
    walls: list[Mapped]
    doors: list[Mapped]
    maybe: list[Mapped]
    remarks: tuple[str, ...]

    def levels(self) -> list[str]:
        """Return the levels on which there are rooms, from the lowest up."""
        return sorted({level for room in (*self.rooms, *self.maybe) for level in room.levels}, key=float)


def map_of(found: Features) -> IndoorMap:
    """Return what the features are, shapes in degrees; rooms without a level that can be read are left out."""
    of_kind: dict[str, list[Mapped]] = {_ROOM: [], _WALL: [], _DOOR: [], _MAYBE_ROOM: []}
    shapeless: dict[str, list[shapely.Geometry | None]] = {kind: [] for kind in of_kind}
    lost: dict[str, list[str]] = {kind: [] for kind in of_kind}
    with_comma: list[str] = []
    in_part: list[str] = []
    unread: Counter[str] = Counter()
    bare = not any(feature.said(key) for feature in found.features for key in ("level", "repeat_on"))
    for feature in found.features:
        kind = _kind_of(feature)
        if kind is None:
            unread[feature.text("indoor")] += 1
            continue
        text, said = levels_of(feature)
        said = said._replace(found=_ONLY_LEVEL) if bare and kind in (_ROOM, _MAYBE_ROOM) else said
        with_comma += said.with_comma
        in_part += said.unread if said.found else ()
        if feature.shape is None or not _is_usable(feature.shape, kind):
            shapeless[kind].append(feature.shape)
        elif said.found or (not text and kind in (_WALL, _DOOR)):
            of_kind[kind].append(Mapped(feature, said.found, feature.shape))
        else:
            lost[kind].append(text)
    remarks = ["no feature has a level: all rooms are taken as one level, 0"] if bare else []
    remarks += [remark for kind, texts in lost.items() for remark in _say_lost(kind, texts)]
    remarks += [line for kind, shapes in shapeless.items() for line in say_left_out(shapes, kind, _LACKING[kind])]
    remarks += [*_say_commas(with_comma), *_say_in_part(in_part), *_say_unread(unread)]
    return IndoorMap(of_kind[_ROOM], of_kind[_WALL], of_kind[_DOOR], of_kind[_MAYBE_ROOM], tuple(remarks))


def levels_of(feature: Feature) -> tuple[str, Levels]:
    """Return the levels of a feature as it says them, and read; ``repeat_on`` adds those on which it stands again."""
    text = ";".join(filter(None, (feature.said("level"), feature.said("repeat_on"))))
    return text, levels_in(text)


def placed(found: IndoorMap, frame: LocalFrame) -> IndoorMap:
    """Return the map in metres: what says no level stands on those of its rooms, indoor=yes is a room where none is."""
    rooms = [_in_metres(room, frame) for room in found.rooms]
    maybe = [_in_metres(area, frame) for area in found.maybe]
    taken, objects = _rooms_among(maybe, rooms)
    rooms += taken
    remarks = [*found.remarks]
    if taken:
        remarks.append(f"{say_count(len(taken), 'area')} with indoor=yes taken as rooms")
    if objects:
        remarks.append(f"{say_count(objects, 'area')} with indoor=yes inside or around rooms left out")
    ground = _Ground(rooms)
    resolved: list[list[Mapped]] = []
    for kind, mapped in ((_WALL, found.walls), (_DOOR, found.doors)):
        listed = [_in_metres(each, frame) for each in mapped]
        standing = [each._replace(levels=each.levels or ground.levels_at(each, kind)) for each in listed]
        resolved.append([each for each in standing if not ground.levels.isdisjoint(each.levels)])
        remarks += _say_resolved(kind, listed, standing, ground.levels)
    return IndoorMap(rooms, resolved[0], resolved[1], [], tuple(remarks))


class _Ground:
    """The rooms of all levels, to find those that a door or wall belongs to."""

    def __init__(self, rooms: Sequence[Mapped]) -> None:
        self._rooms = [room for room in rooms if not isinstance(room.shape, PlanError)]
        self.levels = {level for room in rooms for level in room.levels}
        outlines = np.array([_outline(room) for room in self._rooms], dtype=object)
        self._walls = shapely.boundary(outlines)
        self._tree = shapely.STRtree(outlines)
        self._at_corner: dict[tuple[float, float], set[int]] | None = None

    def levels_at(self, mapped: Mapped, kind: str) -> tuple[str, ...]:
        """Return the levels of the rooms to which a door or wall belongs; empty where it stands in none."""
        if isinstance(mapped.shape, PlanError):
            return ()
        if kind == _WALL:
            rooms = self._tree.query(mapped.shape, predicate="intersects").tolist()
        else:
            rooms = sorted(self._sharing_nodes(mapped.feature)) or self._near(mapped.shape)
        return tuple(dict.fromkeys(level for room in rooms for level in self._rooms[room].levels))

    def _sharing_nodes(self, feature: Feature) -> set[int]:
        """Return the rooms of which each node of the door is a corner."""
        if self._at_corner is None:
            self._at_corner = {}
            for number, room in enumerate(self._rooms):
                for corner in _corners(room.feature):
                    self._at_corner.setdefault(corner, set()).add(number)
        shared = [self._at_corner.get(corner, set()) for corner in _corners(feature)]
        return set.intersection(*shared) if shared else set()

    def _near(self, shape: shapely.Geometry) -> list[int]:
        """Return the rooms on whose outline the middle of a door lies, or lies nearest."""
        spot = openings_of(shape)[0].middle
        near = self._tree.query(spot, predicate="dwithin", distance=_REACH_M)
        away = shapely.distance(self._walls[near], spot)
        kept: list[int] = near[away <= min(away.min(initial=_REACH_M) + _NEARLY_M, _REACH_M)].tolist()
        return kept


def _corners(feature: Feature) -> list[tuple[float, float]]:
    """Return the corners of a feature [degrees], to a tenth of a millimetre."""
    listed = shapely.get_coordinates(feature.shape).round(9)
    return [(float(x), float(y)) for x, y in listed]


def _kind_of(feature: Feature) -> str | None:
    """Return what a feature is, None for what is not read."""
    indoor = feature.text("indoor").lower()
    if indoor in FLOORS:
        return _ROOM
    if indoor in _SOLID:
        return _WALL
    is_door = bool(feature.text("door")) or feature.text("entrance").lower() not in ("", "no")
    is_area, is_object = encloses(feature.shape), any(key in feature.properties for key in _NO_ROOM)
    if indoor == "door" or (is_door and not (is_area and (is_object or indoor == "yes"))):
        return _DOOR
    return _MAYBE_ROOM if indoor == "yes" and is_area and not is_object else None


def _is_usable(shape: shapely.Geometry, kind: str) -> bool:
    if kind == _WALL:
        return bool((shapely.length(shapely.get_parts(shape)) > 0).any())
    return outline_of(shape) is not None if kind != _DOOR else bool(openings_of(shape))


def _in_metres(mapped: Mapped, frame: LocalFrame) -> Mapped:
    try:
        return mapped._replace(shape=metres_of(mapped.feature, frame) or Polygon())
    except PlanError as problem:
        return mapped._replace(shape=problem)


def _rooms_among(maybe: Sequence[Mapped], rooms: Sequence[Mapped]) -> tuple[list[Mapped], int]:
    """Return the areas that lie where no room is, and the number of the others: objects in rooms, or around them."""
    if not maybe:
        return [], 0
    outlines = [_outline(room) for room in rooms]
    areas = [_outline(area) for area in maybe]
    first, second = shapely.STRtree(outlines).query(areas)
    if len(first) > _MOST_PAIRS:
        raise PlanError(f"{len(first):,} pairs of rooms and areas overlap; this is no floor. Check the drawing.")
    near: dict[int, list[int]] = {}
    for area, room in zip(first.tolist(), second.tolist(), strict=True):
        if not set(rooms[room].levels).isdisjoint(maybe[area].levels):
            near.setdefault(area, []).append(room)
    taken = []
    for number, area in enumerate(areas):
        floor = shapely.union_all([outlines[room] for room in near.get(number, [])])
        if not area.is_empty and shapely.intersection(area, floor).area < _MOSTLY * area.area:
            taken.append(maybe[number])
    return taken, len(maybe) - len(taken)


def _outline(mapped: Mapped) -> shapely.Geometry:
    """Return the outline of a placed area [m]; empty where it has none or lies too far away."""
    outline = None if isinstance(mapped.shape, PlanError) else outline_of(mapped.shape)
    return Polygon() if outline is None else outline[0]


def quoted(texts: Iterable[str], before: str = "") -> str:
    """Return the commonest of ``texts``: " ('B1', 'ground')", or behind ``before``; empty where none says anything."""
    listed = ", ".join(repr(text) for text, _ in Counter(filter(None, texts)).most_common(_MOST_QUOTED))
    if not listed:
        return ""
    return f"{before}{listed}" if before else f" ({listed})"


def _say_lost(kind: str, texts: Sequence[str]) -> Iterator[str]:
    if texts:
        yield f"{say_count(len(texts), kind)} without a level that can be read left out{quoted(texts)}"


def _say_commas(texts: Sequence[str]) -> list[str]:
    taken = "is taken as a number" if len(texts) == 1 else "are taken as numbers"
    return [f"{say_count(len(texts), 'level')} with a comma {taken}, not as a list{quoted(texts)}"] if texts else []


def _say_in_part(texts: Sequence[str]) -> list[str]:
    """Say which levels cannot be read of features that name others beside them."""
    return (
        [f"{say_count(len(texts), 'level')} beside others that cannot be read left out{quoted(texts)}"] if texts else []
    )


def _say_unread(unread: Counter[str]) -> list[str]:
    listed = [
        f"{count} {f'with indoor={kind}' if kind else 'without indoor=...'}" for kind, count in unread.most_common(5)
    ]
    others = unread.total() - sum(count for _, count in unread.most_common(5))
    listed += [f"{others} others"] if others else []
    return [f"{say_count(unread.total(), 'feature')} not read: {', '.join(listed)}"] if listed else []


def _say_resolved(kind: str, before: Sequence[Mapped], after: Sequence[Mapped], levels: set[str]) -> list[str]:
    """Say which doors or walls said no level, which of them stand in no room, and which on a level without rooms."""
    found = sum(not old.levels and bool(new.levels) for old, new in zip(before, after, strict=True))
    lone = sum(not each.levels for each in after)
    elsewhere = sum(bool(each.levels) and levels.isdisjoint(each.levels) for each in after)
    theirs = "its room" if found == 1 else "their rooms"
    said = [
        (found, f"without a level taken on that of {theirs}"),
        (lone, "without a level in no room left out"),
        (elsewhere, "on levels without a room left out"),
    ]
    return [f"{say_count(count, kind)} {text}" for count, text in said if count]
