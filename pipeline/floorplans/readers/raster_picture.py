"""A picture of a floor with a known size of its pixels: scans of drawings, vacuum maps, segmentation benchmarks.

A picture says nothing of its scale, so ``metres_per_unit`` must be given, unless the project wrote it: a PNG then holds
a note of its scale and place, which counts as long as the picture still has the size that the note says. A scale that
is given wins over the note. The darkness of a pixel, 0 for white and 1 for black and turned over by ``invert``, is
compared with the two thresholds: below ``free_thresh`` it is free, above ``occupied_thresh`` occupied, between them
unknown, as is a transparent pixel. Row 0 of a picture is its top.

A picture that a YAML file names is part of that map, whichever folder of the source each lies in. So are masks and
ground truth beside a picture: files whose name ends in keepout, nogo, limit, localization or groundtruth, after an
underscore or a point.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, UNKNOWN, Cells, FloorPlan, GridPlan, Location
from pipeline.floorplans.readers.json_file import finite_number, finite_points, parse_json, short_text
from pipeline.floorplans.readers.map_pictures import YAML_ENDINGS, pictures_named_by
from pipeline.floorplans.readers.picture import Grey, read_picture
from pipeline.floorplans.readers.reader import ReadOptions

NOTE = "hinterland"
"""Key of the text in a PNG that says its scale and place; see `note_of`."""

_MASK = re.compile(r"[._-](keepout|nogo|limit|localization|groundtruth)$", re.IGNORECASE)
_BEGINNINGS = (b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"GIF8", b"II*\x00", b"MM\x00*", b"II+\x00", b"MM\x00+")
_PORTABLE = re.compile(rb"P[1-6][ \t\r\n#]")
_PARTS_OF_OTHERS = ("floor_info.json", "geojson_map.json")  # beside these a picture shows what they describe


class _Place(NamedTuple):
    """resolution: metres per pixel. origin: outer corner of the lowest left pixel [m]."""

    resolution: float
    origin: Location


@dataclass(frozen=True)
class RasterPicture:
    """Reader of pictures; the plan's building is the name before the first point."""

    name: str = "raster_picture"
    patterns: tuple[str, ...] = ("*.png", "*.pgm", "*.jpg", "*.jpeg", "*.bmp", "*.gif", "*.tif", "*.tiff")
    uses: tuple[str, ...] = ("metres_per_unit", "invert", "free_thresh", "occupied_thresh", "paper")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` begins as a picture does."""
        try:
            with path.open("rb") as stream:
                head = stream.read(16)
        except (OSError, ValueError):
            return False
        # "BM" alone begins many a text; a bitmap has four zero bytes at 6.
        bitmap = head[:2] == b"BM" and head[6:10] == b"\0\0\0\0"
        return head.startswith(_BEGINNINGS) or _PORTABLE.match(head) is not None or bitmap

    def accompanies(self, path: Path) -> bool:
        """Return whether ``path`` is a picture of another plan, or a mask of one."""
        if not self.sniff(path):
            return False
        if _MASK.search(path.stem) or any((path.parent / name).is_file() for name in _PARTS_OF_OTHERS):
            return True
        try:
            return path.resolve() in _pictures_of_maps(path.parent, path.parent.stat().st_mtime_ns)
        except (OSError, RuntimeError):  # RuntimeError: links in a circle
            return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the picture; see `Reader.read`."""
        grey = read_picture(path)
        place = _place(path, grey, options)
        building = path.name.partition(".")[0] or path.stem
        yield GridPlan(
            plan_id=path.stem,
            building=building,
            floor=building,
            environment="pictures",
            source=path.name,
            cells=np.ascontiguousarray(classify(grey, options)[::-1]),
            resolution=place.resolution,
            origin=place.origin,
        )


def note_of(plan: GridPlan) -> str:
    """Return what a PNG shall hold under the key `NOTE`, so that it is read back with its scale and place."""
    rows, cols = plan.cells.shape
    origin = [float(plan.origin.x), float(plan.origin.y)]
    return json.dumps({"metres_per_pixel": float(plan.resolution), "origin_m": origin, "rows": rows, "cols": cols})


def _place(path: Path, grey: Grey, options: ReadOptions) -> _Place:
    """Return the scale that a person gives, else the scale and place that the picture notes."""
    if options.metres_per_unit is not None:
        return _Place(options.metres_per_unit, Location(0.0, 0.0))
    why = "a picture has no scale"
    if NOTE in grey.notes:
        name = f"{path}: its note {NOTE!r}"
        note = parse_json(grey.notes[NOTE].encode(errors="replace"), name)
        if not isinstance(note, dict):
            raise PlanError(f"{name} is {short_text(note)!r}, expected a mapping. Write the picture again.")
        if [note.get("rows"), note.get("cols")] == list(grey.values.shape):
            origin = finite_points([note.get("origin_m")], f"{name}: origin_m")[0]
            resolution = finite_number(note.get("metres_per_pixel"), f"{name}: metres_per_pixel")
            return _Place(resolution, Location(*origin.tolist()))
        why = "its note of the scale is of a picture of another size"
    raise PlanError(
        f"{path}: {why}, expected the size of a pixel. Give it: plans.read.metres_per_unit=0.05, or --scale 0.05"
    )


@lru_cache(maxsize=32)
def _pictures_of_maps(folder: Path, _changed_ns: int) -> frozenset[Path]:
    """Return the pictures that a YAML file in ``folder`` names as its image."""
    return pictures_named_by(file for file in folder.iterdir() if file.suffix.lower() in YAML_ENDINGS)


def classify(grey: Grey, options: ReadOptions) -> Cells:
    """Return the cells of a picture, in its row order: [rows, cols] uint8 of FREE, OCCUPIED, UNKNOWN."""
    darkness = (grey.values if options.invert else 255.0 - grey.values) / 255.0
    cells = np.full(darkness.shape, UNKNOWN, dtype=np.uint8)
    free, occupied = options.thresholds()
    cells[darkness < free] = FREE
    cells[darkness > occupied] = OCCUPIED
    cells[grey.transparent] = UNKNOWN
    return cells
