"""ROS map_server maps, both ways: a YAML file beside a PGM or PNG picture.

The format is described at https://wiki.ros.org/map_server. Occupancy of a pixel is p = (255 - grey) / 255, or
grey / 255 with ``negate: 1``; above ``occupied_thresh`` it is occupied, below ``free_thresh`` free, else unknown.

- ``trinary`` (default) and ``scale``: as above. In ``scale`` the shades between the thresholds are graded; a cell that
  is not surely free or occupied counts as unknown here. A transparent pixel is unknown in both.
- ``raw``: the grey value itself is the occupancy in per cent; above 100 it is unknown.

``origin`` is the pose of the lower-left pixel: x, y [m], yaw [rad]. Picture row 0 is the top, so rows are turned over.
A yaw within 1 degree of a quarter turn is rounded to it and the grid is turned; any other yaw is refused, because
turning a grid by it would resample the walls.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import degrees, isfinite, pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from pipeline.errors import PlanError
from pipeline.files import replacing, write_text
from pipeline.floorplans.plan import CLUTTER, FREE, OCCUPIED, UNKNOWN, Cells, FloorPlan, GridPlan, Location
from pipeline.floorplans.readers.picture import Grey, read_picture, write_picture
from pipeline.floorplans.readers.reader import ReadOptions, building_in_manifest

_QUARTER = pi / 2
_YAW_TOLERANCE_DEG = 1.0
_MODES = ("trinary", "scale", "raw")
_GREY_OF = {FREE: 254, OCCUPIED: 0, UNKNOWN: 205, CLUTTER: 0}
_OCCUPIED_THRESH, _FREE_THRESH = (
    0.65,
    0.196,
)  # grey 205 is p = 0.19608: with 0.25, as some tools write, it would be free


class MapHeader(NamedTuple):
    """The YAML of a map. resolution: metres per pixel; origin: x, y [m] and yaw [rad] of the lower-left pixel."""

    image: Path
    resolution: float
    origin: tuple[float, float, float]
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: str


@dataclass(frozen=True)
class RosMapServer:
    """Reader of YAML + PGM/PNG maps; a map belongs to the building of its manifest line, else of its folder."""

    name: str = "ros_map_server"
    patterns: tuple[str, ...] = ("*.yaml", "*.yml")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a YAML mapping with an image."""
        try:
            content = yaml.safe_load(path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, yaml.YAMLError):
            return False
        return isinstance(content, dict) and "image" in content

    def accompanies(self, path: Path) -> bool:
        """Return False: pictures are found through their YAML."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the map; see `Reader.read`. The YAML states scale and thresholds: no option is used."""
        header = read_header(path)
        cells = np.ascontiguousarray(classify(read_picture(header.image), header)[::-1])
        turned, origin = turn(cells, header, path)
        building = building_in_manifest(path) or building_in_manifest(path.parent / header.image.name)
        plan_id = f"{path.parent.name}.{path.stem}"
        yield GridPlan(
            plan_id=plan_id,
            building=building or path.parent.name,
            floor=plan_id,
            environment="ros_maps",
            source=f"{path.parent.name}/{path.name}",
            cells=turned,
            resolution=header.resolution,
            origin=origin,
        )


def read_header(path: Path) -> MapHeader:
    """Read and check the YAML of a map.

    Raises:
        PlanError: not YAML, a key is missing or has an impossible value; names the file and the key.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as problem:
        raise PlanError(f"{path}: not a readable YAML file ({' '.join(str(problem).split())}).") from problem
    if not isinstance(content, dict):
        raise PlanError(f"{path}: expected a mapping with image, resolution and origin, got {type(content).__name__}.")
    missing = [key for key in ("image", "resolution", "origin") if key not in content]
    if missing:
        raise PlanError(f"{path}: {' and '.join(missing)} missing. A map needs image, resolution and origin.")
    return _header(path, content)


def classify(grey: Grey, header: MapHeader) -> Cells:
    """Return the cells of a picture, in the picture's row order: [rows, cols] uint8 of FREE, OCCUPIED, UNKNOWN."""
    value = 255.0 - grey.values if header.negate else grey.values
    if header.mode == "raw":
        occupancy = value / 100.0
        unknown = value > 100
    else:
        occupancy = (255.0 - value) / 255.0
        unknown = grey.transparent
    cells = np.full(value.shape, UNKNOWN, dtype=np.uint8)
    cells[occupancy > header.occupied_thresh] = OCCUPIED
    cells[occupancy < header.free_thresh] = FREE
    cells[unknown] = UNKNOWN
    return cells


def turn(cells: Cells, header: MapHeader, path: Path) -> tuple[Cells, Location]:
    """Turn ``cells`` [rows, cols], row 0 lowest, by the yaw of the origin; return them with the new lower-left corner.

    Raises:
        PlanError: the yaw is not a multiple of 90 degrees, within 1 degree.
    """
    x, y, yaw = header.origin
    quarters = round(yaw / _QUARTER)
    if abs(degrees(yaw - quarters * _QUARTER)) > _YAW_TOLERANCE_DEG:
        raise PlanError(
            f"{path}: origin has a yaw of {degrees(yaw):.1f} degrees; only multiples of 90 (within "
            f"{_YAW_TOLERANCE_DEG:g}) can be read without resampling. Turn the picture and set the yaw to 0."
        )
    width, height = cells.shape[1] * header.resolution, cells.shape[0] * header.resolution
    corner = [(x, y), (x - height, y), (x - width, y - height), (x, y - width)][quarters % 4]
    # With row 0 at the bottom a turn to the left in the world is np.rot90 to the right.
    return np.ascontiguousarray(np.rot90(cells, -quarters)), Location(*corner)


def write_ros_map(plan: GridPlan, path: Path) -> None:
    """Write ``plan`` as ``path`` (YAML) and a PGM picture of the same name beside it, both atomically.

    Reading them back gives the same grid, resolution and origin; furniture comes back as occupied.
    """
    picture = path.with_suffix(".pgm")
    shades = np.zeros(max(_GREY_OF) + 1, dtype=np.uint8)
    shades[list(_GREY_OF)] = list(_GREY_OF.values())
    with replacing(picture) as scratch:
        write_picture(scratch, shades[plan.cells[::-1]])
    header = {
        "image": picture.name,
        "mode": "trinary",
        "resolution": float(plan.resolution),
        "origin": [float(plan.origin.x), float(plan.origin.y), 0.0],
        "negate": 0,
        "occupied_thresh": _OCCUPIED_THRESH,
        "free_thresh": _FREE_THRESH,
    }
    write_text(path, yaml.safe_dump(header, sort_keys=False))


def _header(path: Path, content: dict[str, Any]) -> MapHeader:
    resolution = _number(path, "resolution", content["resolution"])
    if resolution <= 0:
        raise PlanError(f"{path}: resolution = {resolution:g}, expected metres per pixel above 0.")
    origin = content["origin"]
    if not isinstance(origin, list) or len(origin) not in (2, 3):
        raise PlanError(f"{path}: origin = {origin!r}, expected [x, y, yaw] in m, m, rad.")
    x, y, yaw = (_number(path, "origin", value) for value in [*origin, 0.0][:3])
    occupied = _number(path, "occupied_thresh", content.get("occupied_thresh", _OCCUPIED_THRESH))
    free = _number(path, "free_thresh", content.get("free_thresh", _FREE_THRESH))
    if not 0 <= free <= occupied <= 1:
        raise PlanError(
            f"{path}: free_thresh = {free:g}, occupied_thresh = {occupied:g}; expected 0 <= free <= occupied <= 1."
        )
    mode = str(content.get("mode", "trinary")).lower()
    if mode not in _MODES:
        raise PlanError(f"{path}: mode = {mode}, expected one of {', '.join(_MODES)}.")
    image = path.parent / str(content["image"]).strip()
    if not image.is_file():
        raise PlanError(f"{path}: image = {content['image']}: no such picture beside the YAML file. Put it there.")
    negate = bool(_number(path, "negate", content.get("negate", 0)))
    return MapHeader(image, resolution, (x, y, yaw), negate, occupied, free, mode)


def _number(path: Path, key: str, value: object) -> float:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = float("nan")
    if not isfinite(number):
        raise PlanError(f"{path}: {key} = {value!r}, expected a finite number.")
    return number
