"""Features of a GeoJSON file (RFC 7946), shapes in degrees, checked; what is damaged is counted, not guessed."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely
from shapely.geometry import (
    GeometryCollection,
    LineString,
    MultiLineString,
    MultiPoint,
    MultiPolygon,
    Point,
    Polygon,
)

from pipeline.errors import PlanError
from pipeline.floorplans.projection import LocalFrame
from pipeline.floorplans.readers.json_file import (
    MOST_COORDINATES,
    contains_all,
    finite_points,
    load_json,
    short_text,
    sniff_text,
)
from pipeline.floorplans.readers.osm_values import tags_in
from pipeline.floorplans.rooms import only_polygons, repair_outline, say_count
from pipeline.floorplans.walls import check_outline

_MOST_FEATURES = 100_000
_MOST_PARTS = 100_000  # of one feature
_DEEPEST = 16  # collections inside collections
_PACKED = ("tags", "other_tags")  # where osmtogeojson and GDAL put OpenStreetMap's tags
_ON_LINE_M = 0.05
_NARROWEST_M, _WIDEST_M = 0.3, 30.0  # of an opening: a line beyond is a symbol


class Feature(NamedTuple):
    """One feature. shape: in degrees (longitude, latitude); None where it has none. identity: its id or empty."""

    shape: shapely.Geometry | None
    properties: Mapping[str, Any]
    identity: str
    members: Mapping[str, Any]

    def said(self, key: str) -> str:
        """Return what stands at ``key`` as short clean text, whatever it is; empty where it is missing or null."""
        value = self.properties.get(key)
        return "" if value is None else short_text(value)

    def text(self, key: str) -> str:
        """Return a property as short clean text; empty where it is missing or null."""
        value = self.properties.get(key)
        return "" if value is None or isinstance(value, bool | list | dict) else short_text(value)


class Features(NamedTuple):
    """The features of a file; ``members`` are those of the collection itself, ``damaged`` counts features left out."""

    features: list[Feature]
    members: Mapping[str, Any]
    damaged: int

    def remarks(self) -> tuple[str, ...]:
        """Say how many features were left out."""
        return (f"{say_count(self.damaged, 'feature')} with a damaged shape left out",) if self.damaged else ()


def mentions(path: Path, *words: str) -> bool:
    """Return whether ``path`` is a GeoJSON collection in which all ``words`` stand in quotes, however far behind."""
    if not sniff_text(path, 64).lstrip().startswith(("{", "[")):
        return False
    return contains_all(path, [rf'"{re.escape(word)}\\?"' for word in ("FeatureCollection", *words)])


def load_features(path: Path) -> Features:
    """Return the features of a GeoJSON file.

    Raises:
        PlanError: no JSON, no FeatureCollection, too many features or coordinates, or all shapes are damaged.
    """
    content = load_json(path)
    listed = content.get("features") if isinstance(content, dict) else None
    if not isinstance(content, dict) or not isinstance(listed, list):
        raise PlanError(f"{path}: no list of features, expected a GeoJSON FeatureCollection. Is it such a file?")
    if len(listed) > _MOST_FEATURES:
        raise PlanError(f"{path}: {len(listed):,} features, at most {_MOST_FEATURES:,} are read. Cut out the building.")
    found, damaged, budget = [], 0, MOST_COORDINATES
    for number, record in enumerate(listed):
        if not isinstance(record, dict):
            damaged += 1
            continue
        try:
            shape = _shape(record.get("geometry"), name := f"{path}, feature {number}")
            if shape is not None and (areas := _areas(shape)):
                check_outline(MultiPolygon(areas), name)
        except PlanError:
            damaged += 1
            continue
        budget -= 0 if shape is None else int(shapely.get_num_coordinates(shape))
        if budget < 0:
            raise PlanError(f"{path}: more than {MOST_COORDINATES:,} coordinates, at most that many are read.")
        identity = short_text(record["id"]) if isinstance(record.get("id"), str | int) else ""
        found.append(Feature(shape, _properties(record), identity, record))
    if damaged and not found:
        raise PlanError(f"{path}: all {say_count(damaged, 'feature')} are damaged. Get the file again.")
    return Features(found, content, damaged)


def outline_of(shape: shapely.Geometry | None) -> tuple[Polygon | MultiPolygon, bool] | None:
    """Return the polygons of ``shape`` and whether they had to be repaired; None where it encloses no floor.

    Without polygons, closed lines count as the polygons they run around, rings inside rings as holes. Polygons that
    touch, such as the two halves of a room that a map was cut through, are put together, which is no repair.
    """
    if shape is None:
        return None
    polygons = _areas(shape)
    if not polygons:
        return None
    if len(polygons) == 1:
        outline, repaired = repair_outline(polygons[0])
    else:
        outline, repaired = _put_together(polygons, drawn=not polygons_of(shape))
    return None if outline.is_empty else (outline, repaired)


def _put_together(polygons: Sequence[Polygon], *, drawn: bool) -> tuple[Polygon | MultiPolygon, bool]:
    """Return several polygons as one outline, and whether it had to be repaired; of ``drawn`` rings some are holes.

    Raises:
        PlanError: they are a scribble.
    """
    whole = MultiPolygon(polygons)
    check_outline(whole, "the outline of a room")
    if whole.is_valid or not shapely.is_valid(polygons).all():
        return repair_outline(whole)
    return only_polygons(shapely.make_valid(whole) if drawn else shapely.union_all(polygons)), False


def polygons_of(shape: shapely.Geometry | None) -> list[Polygon]:
    """Return the polygons that ``shape`` is made of."""
    return [part for part in shapely.get_parts(shape) if isinstance(part, Polygon)] if shape is not None else []


def lines_of(shape: shapely.Geometry | None) -> list[LineString]:
    """Return the lines that ``shape`` is made of, open and closed; lines that are a point only are none."""
    parts = shapely.get_parts(shape) if shape is not None else []
    return [part for part in parts if isinstance(part, LineString) and part.length > 0]


def encloses(shape: shapely.Geometry | None) -> bool:
    """Return whether ``shape`` has a polygon or a closed line, without a look at what it encloses."""
    return bool(polygons_of(shape) or _closed_lines(lines_of(shape)))


class Opening(NamedTuple):
    """Where a feature marks a door or an opening [m].

    length: that of its line or of the longer side of its area, None for a point or a symbol. line: where it is an open
    one.
    """

    middle: Point
    length: float | None
    line: LineString | None = None


def openings_of(shape: shapely.Geometry | None) -> list[Opening]:
    """Return what ``shape`` [m] marks: points, the middles of its lines, and of areas the middles and longer sides.

    Lines that continue each other are one; a point on a line of the same shape says nothing more.
    """
    if shape is None:
        return []
    lines = lines_of(shape)
    drawn = [*shapely.get_parts(shapely.line_merge(MultiLineString(lines)))] if lines else []
    found = []
    for part in (*drawn, *(polygon for polygon in polygons_of(shape) if not polygon.is_empty)):
        line = part if isinstance(part, LineString) and not part.is_closed else None
        if line is None:
            corners = shapely.get_coordinates(shapely.oriented_envelope(part))
            length = float(np.hypot(*np.diff(corners[:3], axis=0).T).max(initial=0.0))
            middle = part.centroid
        else:
            length, middle = line.length, line.interpolate(0.5, normalized=True)
        found.append(Opening(middle, length if _NARROWEST_M <= length <= _WIDEST_M else None, line))
    on_lines = MultiLineString(drawn)
    points = [part for part in shapely.get_parts(shape) if isinstance(part, Point) and not part.is_empty]
    return [*found, *(Opening(spot, None) for spot in points if not drawn or spot.distance(on_lines) > _ON_LINE_M)]


def metres_of(feature: Feature, frame: LocalFrame) -> shapely.Geometry | None:
    """Return the shape of a feature in metres, None where it has none.

    Raises:
        PlanError: it lies too far from the rest; names the feature.
    """
    try:
        return None if feature.shape is None else frame.to_metres(feature.shape)
    except PlanError as problem:
        raise PlanError(f"feature {feature.identity or 'without an id'}: {problem}") from problem


def say_repaired(count: int) -> tuple[str, ...]:
    """Say how many outlines had to be repaired, for remarks; nothing where none had."""
    many = "crossed itself and was repaired" if count == 1 else "crossed themselves and were repaired"
    return (f"{say_count(count, 'outline')} {many}",) if count else ()


def say_left_out(shapes: Iterable[shapely.Geometry | None], noun: str, lacking: str) -> tuple[str, ...]:
    """Say how many features were left out for their shapes, such as "2 units without an outline (Point) left out"."""
    kinds = Counter("no geometry" if shape is None else shape.geom_type for shape in shapes)
    return (
        (f"{say_count(kinds.total(), noun)} without {lacking} left out ({', '.join(sorted(kinds))})",) if kinds else ()
    )


def _properties(record: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the properties of a feature; tags that stand packed in one of them count as if they stood beside it."""
    properties = record.get("properties")
    if not isinstance(properties, dict):
        return {}
    packed = [tags_in(properties[key]) for key in _PACKED if properties.get(key)]
    return {key: value for tags in (*packed, properties) for key, value in tags.items()} if packed else properties


def _shape(geometry: object, name: str) -> shapely.Geometry | None:
    """Return the shape of a geometry member: one part, several of one kind, or a flat collection; None where empty.

    Raises:
        PlanError: it is damaged, or nested too deeply.
    """
    parts = list(islice(_parts(geometry, name, _DEEPEST), _MOST_PARTS + 1))
    if len(parts) > _MOST_PARTS:
        raise PlanError(f"{name}: more than {_MOST_PARTS:,} parts.")
    kinds = {type(part) for part in parts}
    if kinds == {Polygon}:
        return parts[0] if len(parts) == 1 else MultiPolygon(parts)
    if len(parts) < 2:
        return parts[0] if parts else None
    if len(kinds) > 1:
        return GeometryCollection(parts)
    return MultiPoint(parts) if kinds == {Point} else MultiLineString(parts)


def _parts(geometry: object, name: str, deepest: int) -> Iterator[Point | LineString | Polygon]:
    """Yield the points, lines and polygons of a geometry member.

    Raises:
        PlanError: one of them is damaged.
    """
    if geometry is None:
        return
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    listed = geometry.get("coordinates") if isinstance(geometry, dict) else None
    if kind == "Point":
        yield Point(finite_points([listed], name)[0])
    elif kind == "MultiPoint":
        yield from shapely.points(finite_points(listed, name))
    elif kind == "LineString":
        yield LineString(_at_least(2, listed, name))
    elif kind == "Polygon":
        yield _polygon(listed, name)
    elif kind in ("MultiLineString", "MultiPolygon"):
        if not isinstance(listed, list) or (kind == "MultiPolygon" and not listed):
            raise PlanError(f"{name}: no list of {'lines' if kind == 'MultiLineString' else 'polygons'}.")
        lines = kind == "MultiLineString"
        yield from (LineString(_at_least(2, each, name)) if lines else _polygon(each, name) for each in listed)
    elif kind == "GeometryCollection" and isinstance(geometry, dict):
        members = geometry.get("geometries")
        if not isinstance(members, list) or not deepest:
            raise PlanError(f"{name}: {'no list of geometries' if deepest else 'nested too deeply'}.")
        for member in members:
            yield from _parts(member, name, deepest - 1)
    else:
        raise PlanError(f"{name}: {short_text(kind)!r} is no geometry of GeoJSON.")


def _areas(shape: shapely.Geometry) -> list[Polygon]:
    """Return the polygons of ``shape``, or else those that its closed lines run around."""
    return polygons_of(shape) or [Polygon(line.coords) for line in _closed_lines(lines_of(shape))]


def _closed_lines(lines: Sequence[LineString]) -> list[LineString]:
    """Return the closed lines among ``lines``, those put together from several included."""
    merged = shapely.get_parts(shapely.line_merge(MultiLineString(lines))) if len(lines) > 1 else lines
    return [line for line in merged if line.is_closed and len(line.coords) > 3]


def _polygon(rings: object, name: str) -> Polygon:
    if not isinstance(rings, list) or not rings:
        raise PlanError(f"{name}: no list of rings.")
    corners = [_at_least(4, ring, name) for ring in rings]
    return Polygon(corners[0], corners[1:])


def _at_least(least: int, listed: object, name: str) -> Any:
    points = finite_points(listed, name)
    if len(points) < least:
        raise PlanError(f"{name}: {len(points)} points, expected at least {least}.")
    return points
