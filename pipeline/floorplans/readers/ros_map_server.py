"""ROS map_server maps: a YAML file beside a PGM or PNG picture.

The format is described at https://wiki.ros.org/map_server. Occupancy of a pixel is p = (255 - grey) / 255, or
grey / 255 with ``negate: 1``; above ``occupied_thresh`` it is occupied, below ``free_thresh`` free, else unknown.

- ``trinary`` (default) and ``scale``: as above. In ``scale`` the shades between the thresholds are graded; a cell that
  is not surely free or occupied counts as unknown here. A transparent pixel is unknown in both.
- ``raw``: the grey value itself is the occupancy in per cent; above 100 it is unknown.

``origin`` is the pose of the lower-left pixel: x, y [m], yaw [rad]. Picture row 0 is the top, so rows are turned over.
A yaw within 1 degree of a quarter turn is rounded to it and the grid is turned; any other yaw is refused, because
turning a grid by it would resample the walls.

Thresholds that a person gives replace those of the file. Map savers write grey 205 for what was not seen, and some of
them free_thresh = 0.25 beside it, with which it is free: this is read as it stands, and remarked.

Masks have a YAML of their own, but no floor: where a robot must not go, or only slowly, is drawn over a map that lies
beside it. Their names say so: keepout, nogo, limit or mask, after an underscore, a point or alone.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from math import degrees, isfinite, pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, UNKNOWN, Cells, FloorPlan, GridPlan, Location
from pipeline.floorplans.readers.json_file import short_text, sniff_text
from pipeline.floorplans.readers.map_pictures import YAML_ENDINGS, find_picture
from pipeline.floorplans.readers.map_yaml import NOT_YAML, is_meant_as_map, load_map_yaml
from pipeline.floorplans.readers.picture import Grey, read_picture
from pipeline.floorplans.readers.reader import FREE_THRESH, OCCUPIED_THRESH, ReadOptions

_QUARTER = pi / 2
_YAW_TOLERANCE_DEG = 1.0
_LARGEST_YAW = 1e3  # beyond, a float does not tell quarter turns apart for long
_MODES = ("trinary", "scale", "raw")
_MASK = re.compile(r"(^|[._-])(keepout|nogo|limit|mask)$", re.IGNORECASE)
_UNSEEN = 205.0  # the grey of map savers
_MOST_BYTES = 50_000  # of the YAML, which has some 200


class MapHeader(NamedTuple):
    """The YAML of a map. resolution: metres per pixel; origin: x, y [m] and yaw [rad] of the lower-left pixel.

    remarks: what in it had to be mended.
    """

    image: Path
    resolution: float
    origin: tuple[float, float, float]
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: str
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class RosMapServer:
    """Reader of YAML + PGM/PNG maps; a map belongs to the building of its manifest line, else of its folder."""

    name: str = "ros_map_server"
    patterns: tuple[str, ...] = ("*.yaml", "*.yml")
    uses: tuple[str, ...] = ("free_thresh", "occupied_thresh", "paper")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a YAML mapping with an image, or damaged YAML with the keys of a map."""
        text = sniff_text(path, _MOST_BYTES + 1)
        if "image" not in text or len(text) > _MOST_BYTES:
            return False
        try:
            content, _ = load_map_yaml(text)
        except NOT_YAML:
            return is_meant_as_map(text)
        return isinstance(content, dict) and "image" in content

    def accompanies(self, path: Path) -> bool:
        """Return whether ``path`` is a mask of a map beside it, or a YAML file with its doors, places, connections."""
        if path.suffix.lower() not in YAML_ENDINGS or (self.sniff(path) and not _MASK.search(path.stem)):
            return False
        others = (other for other in path.parent.glob(f"*{path.suffix}") if not _MASK.search(other.stem))
        return any(self.sniff(other) for other in others)

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the map; see `Reader.read`. Thresholds that are given replace the stated ones."""
        stated = read_header(path)
        header = _with_thresholds(path, stated, options)
        try:
            grey = read_picture(header.image)
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem
        cells = np.ascontiguousarray(classify(grey, header)[::-1])
        turned, origin = turn(cells, header, path)
        folder = path.absolute().parent.name
        plan_id = f"{folder}.{path.stem}"
        yield GridPlan(
            plan_id=plan_id,
            building=folder,
            floor=plan_id,
            environment="ros_maps",
            source=f"{folder}/{path.name}",
            cells=turned,
            resolution=header.resolution,
            origin=origin,
            remarks=(*header.remarks, *_on_thresholds(grey, stated, header)),
        )


def read_header(path: Path) -> MapHeader:
    """Read and check the YAML of a map.

    Raises:
        PlanError: not YAML, a key is missing or has an impossible value; names the file and the key.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise PlanError(f"{path}: more than {_MOST_BYTES:,} bytes, expected the few lines of a map's YAML.")
        content, remarks = load_map_yaml(path.read_text(encoding="utf-8-sig"))
    except NOT_YAML as problem:
        raise PlanError(
            f"{path}: not a readable YAML file ({_where(problem)}{short_text(str(problem))}). Mend it in an editor."
        ) from problem
    if not isinstance(content, dict):
        raise PlanError(f"{path}: expected a mapping with image, resolution and origin, got {type(content).__name__}.")
    missing = [key for key in ("image", "resolution", "origin") if key not in content]
    if missing:
        raise PlanError(f"{path}: {' and '.join(missing)} missing. A map needs image, resolution and origin.")
    return _header(path, content)._replace(remarks=remarks)


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


def _with_thresholds(path: Path, header: MapHeader, options: ReadOptions) -> MapHeader:
    """Return ``header`` with the thresholds that a person gives instead of its own."""
    free, occupied = options.thresholds(header.free_thresh, header.occupied_thresh)
    if free > occupied:
        raise PlanError(
            f"{path}: free_thresh = {free:g} is above occupied_thresh = {occupied:g}, of which one is given and one is "
            "the file's. Give both: plans.read.free_thresh and plans.read.occupied_thresh."
        )
    return header._replace(free_thresh=free, occupied_thresh=occupied)


def _on_thresholds(grey: Grey, stated: MapHeader, used: MapHeader) -> Iterator[str]:
    for key in ("free_thresh", "occupied_thresh"):
        before, now = getattr(stated, key), getattr(used, key)
        if before != now:
            yield f"{key} = {before:g} of the file was replaced by {now:g}"
    value = 255.0 - grey.values if used.negate else grey.values
    unseen = np.count_nonzero((value == _UNSEEN) & ~grey.transparent)
    if used.mode != "raw" and unseen and used.free_thresh > (255.0 - _UNSEEN) / 255.0:
        yield (
            f"grey 205 counts as free with free_thresh = {used.free_thresh:g}: {unseen:,} of {value.size:,} pixels. "
            "Map savers write it for what was not seen, some with 0.25 beside it by mistake. To make it unknown, give "
            f"plans.read.free_thresh={FREE_THRESH:g}, or --free-thresh {FREE_THRESH:g}"
        )


def _where(problem: BaseException) -> str:
    """Return the line of a fault in YAML, before its text, which may be cut."""
    mark = getattr(problem, "problem_mark", None)
    return f"line {mark.line + 1}: " if mark is not None else ""


def turn(cells: Cells, header: MapHeader, path: Path) -> tuple[Cells, Location]:
    """Turn ``cells`` [rows, cols], row 0 lowest, by the yaw of the origin; return them with the new lower-left corner.

    Raises:
        PlanError: the yaw is not a multiple of 90 degrees, within 1 degree.
    """
    x, y, yaw = header.origin
    quarters = round(yaw / _QUARTER)
    if abs(degrees(yaw - quarters * _QUARTER)) > _YAW_TOLERANCE_DEG or abs(yaw) > _LARGEST_YAW:
        raise PlanError(
            f"{path}: origin has a yaw of {degrees(yaw):.3g} degrees; only multiples of 90 (within "
            f"{_YAW_TOLERANCE_DEG:g}) can be read without resampling. Turn the picture and set the yaw to 0."
        )
    width, height = cells.shape[1] * header.resolution, cells.shape[0] * header.resolution
    corner = [(x, y), (x - height, y), (x - width, y - height), (x, y - width)][quarters % 4]
    # With row 0 at the bottom a turn to the left in the world is np.rot90 to the right.
    return np.ascontiguousarray(np.rot90(cells, -quarters)), Location(*corner)


def _header(path: Path, content: dict[str, Any]) -> MapHeader:
    resolution = _number(path, "resolution", content["resolution"])
    if resolution <= 0:
        raise PlanError(f"{path}: resolution = {resolution:g}, expected metres per pixel above 0.")
    origin = content["origin"]
    if not isinstance(origin, list) or len(origin) not in (2, 3):
        raise PlanError(f"{path}: origin = {short_text(repr(origin))}, expected [x, y, yaw] in m, m, rad.")
    x, y, yaw = (_number(path, "origin", value) for value in [*origin, 0.0][:3])
    occupied = _number(path, "occupied_thresh", content.get("occupied_thresh", OCCUPIED_THRESH))
    free = _number(path, "free_thresh", content.get("free_thresh", FREE_THRESH))
    if not 0 <= free <= occupied <= 1:
        raise PlanError(
            f"{path}: free_thresh = {free:g}, occupied_thresh = {occupied:g}; expected 0 <= free <= occupied <= 1."
        )
    mode = str(content.get("mode", "trinary")).lower()
    if mode not in _MODES:
        raise PlanError(f"{path}: mode = {short_text(mode)}, expected one of {', '.join(_MODES)}.")
    image = find_picture(path, str(content["image"]).strip())
    if image is None:
        raise PlanError(
            f"{path}: image = {short_text(str(content['image']))}: no such picture beside the YAML file. Put it there."
        )
    negate = bool(_number(path, "negate", content.get("negate", 0)))
    return MapHeader(image, resolution, (x, y, yaw), negate, occupied, free, mode)


def _number(path: Path, key: str, value: object) -> float:
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if not isfinite(number):
        raise PlanError(f"{path}: {key} = {short_text(repr(value))}, expected a finite number.")
    return number
