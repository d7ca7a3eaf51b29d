"""The project's own GeoJSON, in local metres: see `pipeline.floorplans.writers.geojson`, which writes it."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPoint, MultiPolygon, Point, Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.cell_areas import CellRaster
from pipeline.floorplans.manifest import SPLITS
from pipeline.floorplans.plan import (
    CLUTTER,
    FREE,
    OCCUPIED,
    UNKNOWN,
    Bounds,
    Door,
    FloorPlan,
    GridPlan,
    Layer,
    Location,
    Room,
)
from pipeline.floorplans.readers.geojson_features import Feature, Features, load_features, outline_of, say_repaired
from pipeline.floorplans.readers.json_file import contains_all, finite_number, short_name, short_text, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.rooms import say_count

MEMBER = "hinterland"
VERSION = 1
FRAME = "local metres, x to the right, y up; not longitude and latitude"
CELL_KINDS = {FREE: "free", UNKNOWN: "unknown", CLUTTER: "clutter"}

_MARKS = ("door", "start", "goal")
_GEOMETRY_KINDS = ("free", "room")
_GRID_KINDS = (*CELL_KINDS.values(), "layer")
_MOST_CELLS = 100_000_000
_MOST_WORK = 20_000_000_000  # areas times cells: a minute
_MOST_LAYERS = 16
_HIGHEST_VALUE = 0xFFFF
_LONGEST_REMARK = 2000

_Properties: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True)
class PlanGeoJson:
    """Reader of plans that the project wrote as GeoJSON; one plan for each file."""

    name: str = "plan_geojson"
    patterns: tuple[str, ...] = ("*.geojson", "*.json")
    uses: tuple[str, ...] = ("paper",)

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a GeoJSON collection with the member that says what the plan is."""
        # Other tools put the member behind the features: the whole file is looked through.
        return sniff_text(path, 64).lstrip().startswith("{") and contains_all(
            path, [rf'"{MEMBER}"\s{{0,99}}:\s{{0,99}}\{{']
        )

    def accompanies(self, path: Path) -> bool:
        """Return False: a plan is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the file; see `Reader.read`. The file says all itself: no option is used."""
        found = load_features(path)
        try:
            yield _plan(path, found)
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem


def _plan(path: Path, found: Features) -> FloorPlan | GridPlan:
    about = _about(found)
    if found.damaged:
        raise PlanError(f"{say_count(found.damaged, 'feature')} with a damaged shape. Write the plan again.")
    points = {kind: _location(found, kind) for kind in ("start", "goal")}
    start, goal = points["start"], points["goal"]
    if (start is None) != (goal is None):
        raise PlanError(f"a {'start' if goal is None else 'goal'} without the other end, expected both or none.")
    split = about.get("split")
    shared: dict[str, Any] = {
        "plan_id": short_name(about.get("plan_id") or path.stem),
        "building": short_text(about.get("building") or path.stem),
        "floor": short_text(about.get("floor") or path.stem),
        "environment": short_text(about.get("environment") or "plan_geojson"),
        "source": path.name,
        "split": split if split in SPLITS else None,
        "doors": tuple(door for number, each in enumerate(_of_kind(found, "door")) for door in _doors(each, number)),
        "endpoints": None if start is None or goal is None else (start, goal),
    }
    listed = about.get("remarks")
    remarks = tuple(_line(remark) for remark in listed) if isinstance(listed, list) else ()
    is_grid = about["form"] == "grid"
    remarks += _say_others(found, (*_MARKS, *(_GRID_KINDS if is_grid else _GEOMETRY_KINDS)))
    return (_grid if is_grid else _geometry)(about, found, shared, remarks)


def _say_others(found: Features, kinds: Sequence[str]) -> tuple[str, ...]:
    """Say how many features are of a kind that no plan of this form has."""
    others = Counter(kind for each in found.features if (kind := each.text("kind")) not in kinds)
    listed = ", ".join(f"{count} of kind {kind!r}" for kind, count in others.most_common(3))
    return (f"{say_count(others.total(), 'feature')} not read: {listed}",) if others else ()


def _about(found: Features) -> _Properties:
    """Return what the file says of the whole plan, its version and form checked."""
    about = found.members.get(MEMBER)
    if not isinstance(about, dict):
        raise PlanError(f'no member "{MEMBER}", expected what the writer plan_geojson adds. Is it another GeoJSON?')
    if about.get("version") != VERSION:
        raise PlanError(f"version {short_text(about.get('version'))}, expected {VERSION}. Write the plan again.")
    if about.get("units") != "m":
        raise PlanError(f"units {short_text(about.get('units'))!r}, expected 'm'. Scale the coordinates to metres.")
    if about.get("form") not in ("geometry", "grid"):
        raise PlanError(f"form {short_text(about.get('form'))!r}, expected 'geometry' or 'grid'.")
    return about


def _geometry(about: _Properties, found: Features, shared: dict[str, Any], remarks: tuple[str, ...]) -> FloorPlan:
    free = [each.shape for each in _of_kind(found, "free")]
    if len(free) != 1:
        raise PlanError(f"{len(free)} features of kind free, expected the one that is the floor.")
    if free[0] is not None and not isinstance(free[0], Polygon | MultiPolygon):
        raise PlanError(f"the feature of kind free is a {free[0].geom_type}, expected a Polygon or MultiPolygon.")
    floor, crossed = outline_of(free[0]) or (MultiPolygon(), False)
    rooms, repaired = [], int(crossed)
    for number, each in enumerate(_of_kind(found, "room")):
        outline = outline_of(each.shape)
        if outline is None and each.shape is not None:
            raise PlanError(f"room {number} is no area, expected a Polygon or MultiPolygon. Draw its outline.")
        rooms.append(Room(outline[0] if outline else Polygon(), each.text("label")))
        repaired += outline[1] if outline else 0
    said = (*remarks, *say_repaired(repaired))
    return FloorPlan(**shared, free=floor, bounds=_bounds(about), rooms=tuple(rooms), remarks=said)


def _grid(about: _Properties, found: Features, shared: dict[str, Any], remarks: tuple[str, ...]) -> GridPlan:
    resolution = finite_number(about.get("resolution"), f"{MEMBER}.resolution")
    origin = Location(*_numbers(about, "origin", 2))
    height, width = _numbers(about, "shape", 2)
    rows, cols = int(height), int(width)
    whole = (rows, cols) == (height, width) and min(rows, cols) >= 1 and rows * cols <= _MOST_CELLS
    if resolution <= 0 or not whole:
        raise PlanError(
            f"{MEMBER}: {height:g} x {width:g} cells of {resolution:g} m, expected 1 to {_MOST_CELLS:,} cells larger "
            "than 0 m. Correct shape or resolution."
        )
    if rows * cols * len(found.features) > _MOST_WORK:
        raise PlanError(f"{len(found.features):,} areas of {rows} x {cols} cells are too much. Write fewer layers.")
    raster = CellRaster(resolution, origin, rows, cols)
    cells = np.full((rows, cols), OCCUPIED, dtype=np.uint8)
    for value, kind in CELL_KINDS.items():
        for each in _of_kind(found, kind):
            marked = _cells_in(each, raster, f"area {kind}")
            if (cells[marked] != OCCUPIED).any():
                raise PlanError(f"the area {kind} overlaps another, expected each cell in one area. Draw it anew.")
            cells[marked] = value
    layers = _layers(about, found, raster)
    return GridPlan(**shared, cells=cells, resolution=resolution, origin=origin, layers=layers, remarks=remarks)


def _layers(about: _Properties, found: Features, raster: CellRaster) -> dict[str, Layer]:
    named = about.get("layers")
    if isinstance(named, dict) and len(named) > _MOST_LAYERS:
        raise PlanError(f"{MEMBER}.layers has {len(named)} layers, at most {_MOST_LAYERS} are read. Leave some out.")
    layers: dict[str, Layer] = {}
    for name, labels in named.items() if isinstance(named, dict) else ():
        known = labels.items() if isinstance(labels, dict) else ()
        of_value = {int(value): short_text(label) for value, label in known if re.fullmatch(r"[0-9]{1,5}", value)}
        layers[name] = Layer(np.zeros((raster.rows, raster.cols), dtype=np.uint16), of_value)
    for each in _of_kind(found, "layer"):
        name = short_text(each.properties.get("layer"))
        value = finite_number(each.properties.get("value"), f"the value of an area of layer {name}")
        if name not in layers or not 0 < value <= _HIGHEST_VALUE:
            raise PlanError(f"an area of layer {name!r} with value {value:g} that {MEMBER}.layers does not list.")
        layers[name].values[_cells_in(each, raster, f"area of layer {name}")] = int(value)
    return layers


def _cells_in(feature: Feature, raster: CellRaster, name: str) -> NDArray[np.bool_]:
    if not isinstance(feature.shape, Polygon | MultiPolygon):
        if feature.shape is None:
            return np.zeros((raster.rows, raster.cols), dtype=bool)
        raise PlanError(f"{name}: a {feature.shape.geom_type}, expected a Polygon or MultiPolygon.")
    try:
        return raster.cells_in(feature.shape)
    except PlanError as problem:
        raise PlanError(f"{name}: {problem}") from problem


def _of_kind(found: Features, kind: str) -> list[Feature]:
    return [feature for feature in found.features if feature.text("kind") == kind]


def _doors(feature: Feature, number: int) -> Iterator[Door]:
    """Yield the door of a point, or those of several points in one feature."""
    if not isinstance(feature.shape, Point | MultiPoint):
        raise PlanError(f"door {number} is no Point, expected its middle. Draw it as a point.")
    width = finite_number(feature.properties.get("width"), f"the width of door {number}")
    if width < 0:
        raise PlanError(f"the width of door {number} is {width:g} m, expected metres from 0. Correct it.")
    for spot in shapely.get_parts(feature.shape):
        yield Door(spot.x, spot.y, width, feature.properties.get("leaf") is not False)


def _location(found: Features, kind: str) -> Location | None:
    marked = _of_kind(found, kind)
    spots = [each.shape for each in marked if isinstance(each.shape, Point)]
    if len(spots) < len(marked) or len(spots) > 1:
        raise PlanError(f"{len(marked)} features of kind {kind}, expected one Point or none. Remove the others.")
    return Location(spots[0].x, spots[0].y) if spots else None


def _bounds(about: _Properties) -> Bounds:
    bounds = Bounds(*_numbers(about, "bounds", 4))
    if bounds.min_x > bounds.max_x or bounds.min_y > bounds.max_y:
        raise PlanError(f"{MEMBER}.bounds is {list(bounds)}, expected [min x, min y, max x, max y] in metres.")
    return bounds


def _numbers(about: _Properties, key: str, count: int) -> list[float]:
    listed = about.get(key)
    if not isinstance(listed, list) or len(listed) != count:
        raise PlanError(f"{MEMBER}.{key} is {short_text(listed)}, expected a list of {count} numbers.")
    return [finite_number(number, f"{MEMBER}.{key}") for number in listed]


def _line(value: object) -> str:
    """Return a remark as clean text of one line, which may be a long one."""
    text = value if isinstance(value, str) else short_text(value)
    words = text[:_LONGEST_REMARK].split()
    return " ".join(short_text(word) for word in words)
