"""Features of a GeoJSON file (RFC 7946), shapes in degrees, checked; what is damaged is counted, not guessed."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import shapely
from shapely.geometry import LineString, MultiPolygon, Point, Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.projection import LocalFrame
from pipeline.floorplans.readers.json_file import (
    MOST_COORDINATES,
    finite_points,
    load_json,
    short_text,
    sniff_text,
)
from pipeline.floorplans.rooms import repair_outline, say_count
from pipeline.floorplans.walls import check_outline

_MOST_FEATURES = 100_000
_SNIFFED_BYTES = 1 << 20  # an outline with its thousand corners may stand before the first property


class Feature(NamedTuple):
    """One feature. shape: in degrees (longitude, latitude); None where it has none. identity: its id or empty."""

    shape: shapely.Geometry | None
    properties: Mapping[str, Any]
    identity: str
    members: Mapping[str, Any]

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
    """Return whether the first megabyte of ``path`` is a GeoJSON collection in which all ``words`` stand in quotes."""
    head = sniff_text(path, 64).lstrip()
    if not head.startswith(("{", "[")):
        return False
    text = sniff_text(path, _SNIFFED_BYTES)
    return '"FeatureCollection"' in text and all(f'"{word}"' in text for word in words)


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
            if isinstance(shape, Polygon | MultiPolygon):
                check_outline(shape, name)
        except PlanError:
            damaged += 1
            continue
        budget -= 0 if shape is None else int(shapely.get_num_coordinates(shape))
        if budget < 0:
            raise PlanError(f"{path}: more than {MOST_COORDINATES:,} coordinates, at most that many are read.")
        properties = record.get("properties")
        identity = short_text(record["id"]) if isinstance(record.get("id"), str | int) else ""
        found.append(Feature(shape, properties if isinstance(properties, dict) else {}, identity, record))
    if damaged and not found:
        raise PlanError(f"{path}: all {say_count(damaged, 'feature')} are damaged. Get the file again.")
    return Features(found, content, damaged)


def outline_of(shape: shapely.Geometry | None) -> tuple[Polygon | MultiPolygon, bool] | None:
    """Return the polygons of ``shape`` and whether they had to be repaired; None where it encloses no floor.

    A closed line counts as the polygon it runs around.
    """
    if isinstance(shape, LineString) and shape.is_closed and len(shape.coords) > 3:
        shape = Polygon(shape.coords)
    if not isinstance(shape, Polygon | MultiPolygon):
        return None
    polygons, repaired = repair_outline(shape)
    return None if polygons.is_empty else (polygons, repaired)


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


def metres_in(text: str) -> float | None:
    """Return a width such as "0.9" or "1.2 m" [m]; None where it is none or no width of a door."""
    try:
        width = float(text.lower().removesuffix("m").strip())
    except ValueError:
        return None
    return width if math.isfinite(width) and 0.5 <= width <= 20 else None


def _shape(geometry: object, name: str) -> shapely.Geometry | None:
    """Return the shape of a geometry member.

    Raises:
        PlanError: it is damaged.
    """
    if geometry is None:
        return None
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    listed = geometry.get("coordinates") if isinstance(geometry, dict) else None
    if kind == "Point":
        return Point(finite_points([listed], name)[0])
    if kind == "LineString":
        return LineString(_at_least(2, listed, name))
    if kind == "Polygon":
        return _polygon(listed, name)
    if kind == "MultiPolygon":
        if not isinstance(listed, list) or not listed:
            raise PlanError(f"{name}: no list of polygons.")
        return MultiPolygon([_polygon(rings, name) for rings in listed])
    if kind in ("MultiPoint", "MultiLineString", "GeometryCollection"):
        return None  # no plan format uses these for rooms, doors or walls
    raise PlanError(f"{name}: {short_text(kind)!r} is no geometry of GeoJSON.")


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
