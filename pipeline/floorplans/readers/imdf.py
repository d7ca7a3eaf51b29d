"""IMDF, the Indoor Mapping Data Format of Apple and OGC: a venue as a folder or archive of GeoJSON files, degrees.

``unit.geojson`` outlines the spaces of all levels and is the file that is read; ``level.geojson`` stacks the levels,
``opening.geojson`` has the doors as lines along the walls, ``fixture.geojson`` and ``kiosk.geojson`` what stands on the
floor. These and the other files of the venue accompany the units. One plan per indoor level, all in one frame.

Units touch without a wall between them: walls of ``wall_m`` are cut, and openings as wide as their line is long.
Walkways and the like have no walls towards each other. Units of a building material, and those open to the level
below, are no floor; fixtures and kiosks are taken off it.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import shapely

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, FloorPlan, GridPlan, Room
from pipeline.floorplans.projection import LocalFrame, frame_around
from pipeline.floorplans.readers.geojson_features import (
    Feature,
    Features,
    Opening,
    load_features,
    mentions,
    metres_of,
    openings_of,
    outline_of,
    say_left_out,
    say_repaired,
)
from pipeline.floorplans.readers.json_file import finite_number, short_name, short_text, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.rooms import Passage, free_from_rooms, only_polygons, say_count

_UNITS = "unit.geojson"
_MANIFEST = "manifest.json"
_KINDS = "address amenity anchor building detail fixture footprint geofence kiosk level occupant opening"
_COMPANIONS = (_MANIFEST, *(f"{kind}.geojson" for kind in f"{_KINDS} relationship section venue".split()))
_NO_FLOOR = frozenset(("brick", "column", "concrete", "drywall", "glass", "opentobelow", "structure", "wood"))
_STANDING = ("fixture", "kiosk")
_WALKWAYS = ("walkway", "walkway.island")
_OPEN = frozenset(("footbridge", "movingwalkway", "platform", "ramp", "road", "terrace", "unenclosedarea", *_WALKWAYS))
_MOST_LEVELS = 200
_SNIFFED_BYTES = 1 << 16


class _Level(NamedTuple):
    """A level of the venue. names: what a person may call it; the first goes into the name of the plan."""

    identity: str
    names: tuple[str, ...]
    building: str
    outdoor: bool


@dataclass(frozen=True)
class Imdf:
    """Reader of IMDF venues; a venue is one building unless each of its levels belongs to one of several."""

    name: str = "imdf"
    patterns: tuple[str, ...] = (_UNITS,)
    uses: tuple[str, ...] = ("levels", "wall_m", "door_width_m")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a GeoJSON collection of units on levels."""
        return mentions(path, "feature_type", "unit", "level_id")

    def accompanies(self, path: Path) -> bool:
        """Return whether ``path`` lies beside the units of a venue and is another of its files."""
        if path.name not in _COMPANIONS or not path.with_name(_UNITS).is_file():
            return False
        head = sniff_text(path, _SNIFFED_BYTES)
        if path.name == _MANIFEST:
            return '"version"' in head and '"language"' in head
        return mentions(path, "feature_type") or re.search(r'"features"\s*:\s*\[\s*\]', head) is not None

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield one plan for each indoor level with units, or the error that refuses it; see `Reader.read`."""
        found = load_features(path)
        on_level: dict[str, list[Feature]] = {}
        for unit in found.features:
            if outline_of(unit.shape) is not None:
                on_level.setdefault(unit.text("level_id"), []).append(unit)
        known = {*on_level}
        if not on_level:
            raise PlanError(f"{path}: no unit has an outline, expected IMDF units as polygons. Get the file again.")
        if len(on_level) > _MOST_LEVELS:
            raise PlanError(f"{path}: {len(on_level)} levels, at most {_MOST_LEVELS} are read. Check level_id.")
        try:
            frame = frame_around(unit.shape for units in on_level.values() for unit in units if unit.shape is not None)
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem
        others = {kind: _load(path, kind) for kind in ("opening", *_STANDING)}
        shapeless = [unit.shape for unit in found.features if outline_of(unit.shape) is None]
        said = (*found.remarks(), *say_left_out(shapeless, "unit", "an outline"), *_say_others(others, known))
        venue = _Venue(path, frame, others["opening"], tuple(others[kind] for kind in _STANDING), said)
        for level in _levels(path, on_level):
            units = on_level.pop(level.identity, [])
            if not units or level.outdoor or (options.levels and not {*level.names} & {*options.levels}):
                continue
            try:
                yield venue.plan(level, units, options)
            except PlanError as problem:
                yield PlanError(f"{path}, level {level.names[0]}: {problem}")
        for identity, units in on_level.items():
            yield PlanError(
                f"{path}: {say_count(len(units), 'unit')} on level {identity!r}, expected a level of level.geojson. "
                "Correct level_id."
            )


@dataclass(frozen=True)
class _Venue:
    """The files of a venue, shapes in degrees; ``openings`` is None where the venue has no such file.

    said: remarks on what of the venue was left out, whatever its level.
    """

    path: Path
    frame: LocalFrame
    openings: Features | None
    standing: tuple[Features | None, ...]
    said: tuple[str, ...]

    def plan(self, level: _Level, units: list[Feature], options: ReadOptions) -> FloorPlan:
        """Return the plan of one level.

        Raises:
            PlanError: no unit of the level is floor, or the outlines are too tangled.
        """
        outlined = [
            (outline, unit) for unit in units if (outline := outline_of(metres_of(unit, self.frame))) is not None
        ]
        closed = shapely.union_all([outline for (outline, _), unit in outlined if unit.text("category") in _NO_FLOOR])
        rooms = [Room(outline, unit.text("category")) for (outline, _), unit in outlined]
        rooms = [room for room in rooms if room.label not in _NO_FLOOR]
        marked = [(shape, each) for shape, each in self._on_level(self.openings, level)]
        passages = [passage for shape, each in marked for passage in _passages(shape, each)]
        try:
            joined = free_from_rooms(
                [Room(only_polygons(shapely.difference(room.outline, closed)), room.label) for room in rooms],
                passages,
                wall_m=options.wall_m,
                door_width_m=options.door_width_m,
                open_rooms=frozenset(number for number, room in enumerate(rooms) if room.label in _OPEN),
            )
            standing = [shape for kind in self.standing for shape, _ in self._on_level(kind, level)]
            obstacles = [outline[0] for shape in standing if (outline := outline_of(shape)) is not None]
            flat = [shape for shape in standing if outline_of(shape) is None]
            free = only_polygons(shapely.difference(joined.free, shapely.union_all(obstacles)))
        except shapely.errors.GEOSException as problem:
            raise PlanError(f"the outlines are too tangled ({problem}). Repair the drawing.") from problem
        said = say_repaired(sum(crossed for (_, crossed), _ in outlined))
        said += (f"{say_count(len(obstacles), 'fixture')} taken off the floor",) if obstacles else ()
        said += say_left_out(flat, "fixture", "an outline")
        said += _say_symbols([each for shape, _ in marked for each in openings_of(shape)])
        said += ("the venue has no opening.geojson: its rooms stay closed",) if self.openings is None else ()
        boxes = np.array([outline.bounds for (outline, _), _ in outlined])
        floor = f"{_stem(self.path)}.{level.names[0]}"
        return FloorPlan(
            plan_id=floor,
            building=level.building,
            floor=floor,
            environment="imdf_venues",
            source=self.path.name,
            free=free,
            bounds=Bounds(*boxes[:, :2].min(axis=0).tolist(), *boxes[:, 2:].max(axis=0).tolist()),
            rooms=tuple(rooms),
            doors=joined.doors,
            remarks=(*self.said, *said, *joined.remarks),
        )

    def _on_level(self, found: Features | None, level: _Level) -> Iterator[tuple[shapely.Geometry, Feature]]:
        """Yield the shapes [m] of the features of one level."""
        for feature in found.features if found is not None else ():
            if feature.text("level_id") == level.identity:
                shape = metres_of(feature, self.frame)
                if shape is not None:
                    yield shape, feature


def _passages(shape: shapely.Geometry, opening: Feature) -> list[Passage]:
    """Return the passages that an opening marks: the middle of each of its lines, as wide as that is long."""
    door = opening.properties.get("door")
    leaf = not (isinstance(door, dict) and door.get("type") == "open")
    marked = openings_of(shape)
    return [Passage(each.middle.x, each.middle.y, width=each.length, leaf=leaf) for each in marked]


def _say_symbols(openings: Sequence[Opening]) -> tuple[str, ...]:
    """Say how many openings have no length that is a width."""
    count = sum(each.length is None for each in openings)
    theirs = "is a point or a symbol and gets" if count == 1 else "are points or symbols and get"
    return (f"{say_count(count, 'opening')} {theirs} the usual width",) if count else ()


def _say_others(others: Mapping[str, Features | None], known: set[str]) -> tuple[str, ...]:
    """Say what of the openings, fixtures and kiosks is damaged, has no shape, or is on a level without units."""
    said: list[str] = []
    for kind, found in others.items():
        if found is None:
            continue
        on_level = [each for each in found.features if each.text("level_id") in known]
        lost = len(found.features) - len(on_level)
        said += [f"{kind}.geojson: {remark}" for remark in found.remarks()]
        said += [f"{say_count(lost, kind)} on a level without units left out"] if lost else []
        said += say_left_out((each.shape for each in on_level if each.shape is None), kind, "a shape")
    return tuple(said)


def _levels(path: Path, on_level: Mapping[str, list[Feature]]) -> list[_Level]:
    """Return the levels of the venue from the lowest up; named by their ids where it has no level.geojson."""
    stem = _stem(path)
    found = _load(path, "level")
    if found is None:
        return [_Level(each, (short_name(each) or "level",), stem, outdoor=False) for each in on_level]
    buildings = _buildings(found, stem)
    ordinals = {each.identity: _ordinal(path, each) for each in found.features}
    levels, seen = [], set()
    for each in sorted(found.features, key=lambda each: ordinals[each.identity]):
        name = f"{ordinals[each.identity]:g}"
        names = (name if name not in seen else f"{name}.{short_name(each.identity)}", name, *_labels(each))
        seen.add(name)
        levels.append(_Level(each.identity, names, buildings[each.identity], each.properties.get("outdoor") is True))
    return levels


def _buildings(levels: Features, stem: str) -> dict[str, str]:
    """Return the building of each level: the venue, unless it has several and no level belongs to two of them."""
    listed = {each.identity: each.properties.get("building_ids") for each in levels.features}
    ids = {level: [short_name(one) for one in many] if isinstance(many, list) else [] for level, many in listed.items()}
    several = len({one for many in ids.values() for one in many}) > 1 and all(len(many) < 2 for many in ids.values())
    return {level: ".".join((stem, *many)) if several else stem for level, many in ids.items()}


def _ordinal(path: Path, level: Feature) -> float:
    name = f"{path.with_name('level.geojson')}, level {level.identity}: ordinal"
    return finite_number(level.properties.get("ordinal"), name, largest=1000)


def _labels(level: Feature) -> Iterator[str]:
    """Yield what a level is called in any language, such as "GF" and "Ground floor"."""
    for key in ("short_name", "name"):
        labels = level.properties.get(key)
        yield from (short_text(label) for label in labels.values()) if isinstance(labels, dict) else ()


def _load(path: Path, kind: str) -> Features | None:
    """Return the features of another file of the venue, None where it has none."""
    beside = path.with_name(f"{kind}.geojson")
    return load_features(beside) if beside.is_file() else None


def _stem(path: Path) -> str:
    """Return the name of the venue: that of its folder or archive."""
    return short_name(path.absolute().parent.name) or "venue"
