"""HouseExpo: houses as JSON, one per file or one per line, each the closed outline ``verts`` of its free floor [m].

The reference reader of the data draws y **downwards**; each house is turned over here within its own height. Walls are
thin dents of the outline, doors the gaps between them; there is neither door nor wall to read. ``room_category`` holds
the boxes of rooms by type; boxes overlap, and a box may have several types.

About 4 % of the outlines cross themselves. They are repaired by even-odd filling (`shapely.make_valid`), as the
reference reader fills them. A line that is no house is yielded as the error that says why, and the next one is read.
"""

import re
from codecs import BOM_UTF8
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.errors import GEOSException
from shapely.geometry import MultiPolygon

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, FloorPlan, GridPlan, Room
from pipeline.floorplans.readers.json_file import (
    MOST_LINE_BYTES,
    finite_points,
    load_json,
    read_json_lines,
    short_name,
    short_text,
    sniff_text,
)
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.walls import Area, repaired

_OUTLINE = re.compile(r'"verts"\s*:\s*\[\s*\[')
_OTHER_KEYS = ('"room_category"', '"room_num"', '"bbox"')
_MOST_CORNERS = 50_000  # the largest published house has 6,335
_MOST_ROOMS = 10_000
_SPLINTER_M2 = 1e-4


@dataclass(frozen=True)
class HouseExpo:
    """Reader of houses; each house is its own building."""

    name: str = "houseexpo"
    patterns: tuple[str, ...] = ("*.json", "*.jsonl")
    uses: tuple[str, ...] = ()

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` begins with a house."""
        text = sniff_text(path)
        keys = _OUTLINE.search(text) is not None or all(key in text for key in _OTHER_KEYS)
        return keys and text.lstrip()[:1] in ("{", "[")

    def accompanies(self, path: Path) -> bool:
        """Return False: a house carries everything with it."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the houses; see `Reader.read`. The format is in metres and needs no option."""
        found = False
        for name, record in _records(path):
            found = True
            try:
                yield _house(path, name, record)
            except PlanError as problem:
                yield problem
        if not found:
            raise PlanError(f'{path}: no house in it, expected JSON with "verts", one house per file or per line.')


def _records(path: Path) -> Iterator[tuple[str, object]]:
    """Yield each house with a name for errors: line by line, or all of a file that is one document."""
    if path.suffix == ".jsonl" or _one_per_line(path):
        yield from read_json_lines(path)
        return
    content = load_json(path)
    if not isinstance(content, list):
        yield str(path), content
        return
    for number, house in enumerate(content, start=1):
        yield f"{path}, house {number}", house


def _one_per_line(path: Path) -> bool:
    """Return whether a house ends on the first line that is not blank, and another thing follows."""
    try:
        with path.open("rb") as stream:
            head = stream.read(MOST_LINE_BYTES + 1000)
    except OSError:
        return False  # load_json says what is wrong
    first, _, second = (part.strip() for part in head.removeprefix(BOM_UTF8).lstrip().partition(b"\n"))
    return first.startswith(b"{") and bool(second) and (first.endswith(b"}") or second.startswith(b'{"'))


def _house(path: Path, name: str, record: object) -> FloorPlan:
    if isinstance(record, PlanError):
        raise record
    if not isinstance(record, dict) or "verts" not in record:
        raise PlanError(f'{name}: {short_text(record)}, expected a house with "id" and "verts" in metres.')
    key = short_name(record.get("id") or "") or path.stem
    corners = finite_points(record["verts"], f"{name}: verts", most=_MOST_CORNERS)
    if len(corners) < 3:
        raise PlanError(f"{name}: {len(corners)} corners, expected an outline of at least 3. Repair the house.")
    low, high = corners.min(axis=0), corners.max(axis=0)
    extent = Bounds(float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    outline, crossed = _outline(corners * (1.0, -1.0) + (0.0, extent.min_y + extent.max_y), name)
    rooms, left_out = _rooms(record.get("room_category"), name, extent)
    remarks = ["the outline crossed itself and was repaired"] if crossed else []
    if left_out:
        boxes = "room box is" if left_out == 1 else "room boxes are"
        remarks.append(f"{left_out} {boxes} damaged or mostly outside the house, and left out")
    plan_id = key if key == path.stem else f"{path.stem}.{key}"
    return FloorPlan(
        plan_id=plan_id,
        building=key,
        floor=plan_id,
        environment="houseexpo_houses",
        source=path.name,
        free=outline,
        bounds=extent,
        rooms=rooms,
        remarks=tuple(remarks),
    )


def _outline(corners: NDArray[np.float64], name: str) -> tuple[Area, bool]:
    """Return the floor inside the outline, and whether it had to be repaired."""
    drawn = shapely.polygons(corners)
    try:
        crossed = not drawn.is_valid
        with np.errstate(all="ignore"):  # crossings beyond a float are none
            parts = shapely.get_parts(repaired(drawn, name))
        outline = MultiPolygon(parts[shapely.area(parts) > _SPLINTER_M2].tolist())
    except GEOSException as problem:
        raise PlanError(f"{name}: the outline cannot be repaired ({problem}). Draw it anew.") from problem
    if outline.area <= 0:
        raise PlanError(f"{name}: the outline encloses no floor. Repair the house.")
    return outline, crossed


def _rooms(boxes_of: object, name: str, extent: Bounds) -> tuple[tuple[Room, ...], int]:
    """Return the boxes of ``room_category`` as rooms with y up, and how many boxes are left out.

    Some boxes of the data reach 50 m beyond their house: of a room, at least half lies within the ``extent`` of it.
    """
    if boxes_of is None:
        return (), 0
    if not isinstance(boxes_of, dict):
        raise PlanError(f"{name}: room_category is {short_text(boxes_of)}, expected boxes by room type.")
    named = [(short_text(kind), box) for kind, boxes in boxes_of.items() if isinstance(boxes, list) for box in boxes]
    if len(named) > _MOST_ROOMS:
        raise PlanError(f"{name}: {len(named):,} room boxes, at most {_MOST_ROOMS:,} are read.")
    height = extent.min_y + extent.max_y
    rooms = [
        Room(shapely.box(min(x1, x2), height - max(y1, y2), max(x1, x2), height - min(y1, y2)), kind)
        for kind, (x1, y1, x2, y2) in ((kind, box) for kind, box in named if _is_box(box))
    ]
    within = [room for room in rooms if shapely.clip_by_rect(room.outline, *extent).area >= room.outline.area / 2]
    return tuple(within), len(named) - len(within)


def _is_box(box: object) -> bool:
    if not isinstance(box, list) or len(box) != 4 or not all(type(side) in (int, float) for side in box):
        return False
    return all(-1e6 < side < 1e6 for side in box) and box[0] != box[2] and box[1] != box[3]
