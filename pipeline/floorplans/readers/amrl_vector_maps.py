"""Vector maps of the AMRL robots: a list of wall segments ``{"p0": {"x", "y"}, "p1": {"x", "y"}}`` in metres, y up.

Both faces of a wall are drawn, doors are gaps, and facades are not closed; `pipeline.floorplans.walls` says how the
floor is found. A navigation graph ``<floor>.navigation.json`` may lie beside a map: it accompanies the map and is not
used, so that it stays a check of the floor (see the tests).

Each floor is a file. Its building is what stands before the floor number in the name: GHC for GHC6 and GHC3_5. A
closing M or B after three capitals is a floor too: AHGM is the mezzanine of AHG.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, FloorPlan, GridPlan
from pipeline.floorplans.readers.json_file import finite_points, load_json, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.walls import OPEN_FACADE_M, free_from_walls

_FIRST_SEGMENT = re.compile(r'\A\s*\[\s*\{\s*"p[01]"\s*:\s*\{\s*"[xy]"')
_GRAPH_KEYS = ('"s0_id"', '"s1_id"', '"loc"', '"nodes"')
_FLOOR = re.compile(r"(?P<building>.*?[A-Za-z])[-_ ]?(?:\d[\d_.]*|(?<=[A-Z]{3})[MB])")


@dataclass(frozen=True)
class AmrlVectorMaps:
    """Reader of one floor per file."""

    name: str = "amrl_vector_maps"
    patterns: tuple[str, ...] = ("*.vectormap.json",)
    uses: tuple[str, ...] = ("wall_m",)

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` begins with a wall segment."""
        return _FIRST_SEGMENT.match(sniff_text(path)) is not None

    def accompanies(self, path: Path) -> bool:
        """Return whether ``path`` is a navigation graph."""
        if path.suffix != ".json":
            return False
        text = sniff_text(path)
        return text.lstrip().startswith("{") and sum(key in text for key in _GRAPH_KEYS) >= 2

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the map; see `Reader.read`. Uses the thickness of walls."""
        segments = read_segments(path)
        lengths = np.hypot(*(segments[:, 1] - segments[:, 0]).T)
        remarks = [f"the floor is what the walls enclose, with gaps of the facade up to {OPEN_FACADE_M:g} m closed"]
        if not lengths.all():
            remarks.append(f"{np.count_nonzero(lengths == 0)} wall segments without length were left out")
        segments = segments[lengths > 0]
        if not len(segments):
            raise PlanError(f"{path}: no wall segment has a length, expected a map of walls in metres. Check the file.")
        floor = path.name.removesuffix(".json").removesuffix(".vectormap")
        free = free_from_walls(shapely.linestrings(segments), None, wall_m=options.wall_m, name=str(path))
        ends = segments.reshape(-1, 2)
        yield FloorPlan(
            plan_id=floor,
            building=building_of(floor),
            floor=floor,
            environment="amrl_floors",
            source=path.name,
            free=free,
            bounds=Bounds(*(float(end) for end in (*ends.min(axis=0), *ends.max(axis=0)))),
            remarks=tuple(remarks),
        )


def read_segments(path: Path) -> NDArray[np.float64]:
    """Return the wall segments of a map: [segments, end, xy] in metres.

    Raises:
        PlanError: not a list of segments, or a coordinate is not a finite number.
    """
    content = load_json(path)
    if not isinstance(content, list) or not content:
        raise PlanError(f'{path}: expected a list of wall segments {{"p0": {{"x", "y"}}, "p1": ...}} in metres.')
    try:
        corners = [[segment[end]["x"], segment[end]["y"]] for segment in content for end in ("p0", "p1")]
    except (KeyError, TypeError, IndexError) as problem:
        raise PlanError(
            f'{path}: a segment lacks "p0" or "p1" with "x" and "y" in metres. Export it again.'
        ) from problem
    return finite_points(corners, str(path)).reshape(-1, 2, 2)


def building_of(floor: str) -> str:
    """Return the building that the name of a floor begins with, such as GHC of GHC3_5."""
    match = _FLOOR.fullmatch(floor)
    return match["building"] if match else floor
