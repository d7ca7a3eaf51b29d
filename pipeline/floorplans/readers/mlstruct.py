"""MLSTRUCT-FP: structural walls of apartment buildings as rectangles in metres, with the slab of each floor.

``rect`` holds walls by four corners ``x``, ``y``; ``slab`` the outline of the floor; both name their ``floorID``, so
that one file may hold many floors. y points up: the pictures' rows were counted downwards from 0, and are negative.
There are neither doors nor rooms, and partitions between rooms are missing: only load-bearing walls are drawn.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.errors import GEOSException
from shapely.geometry import Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, FloorPlan, GridPlan
from pipeline.floorplans.readers.json_file import finite_points, load_json, short_name, short_text, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.rooms import say_repaired
from pipeline.floorplans.walls import Area, as_area, free_from_walls, repaired

_MOST_CORNERS = 10_000
_STRUCTURE_ONLY = "only load-bearing walls are drawn: partitions and doors are missing"


@dataclass(frozen=True)
class MlStruct:
    """Reader of floors with their walls and slabs; each floor is its own building, as the file names none."""

    name: str = "mlstruct"
    patterns: tuple[str, ...] = ("*.json",)
    uses: tuple[str, ...] = ("levels", "wall_m")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` begins with a table of floors and their scale, or of wall rectangles."""
        text = sniff_text(path)
        keys = '"floor"' in text and '"image"' in text and '"scale"' in text
        return text.lstrip().startswith("{") and (keys or ('"rect"' in text and '"wallID"' in text))

    def accompanies(self, path: Path) -> bool:
        """Return False: a file holds everything of its floors."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the floors; see `Reader.read`. Uses the levels, as ids of floors. The file is in metres."""
        content = load_json(path)
        if not isinstance(content, dict) or not isinstance(content.get("rect"), dict) or not content["rect"]:
            raise PlanError(f'{path}: no wall in it, expected "rect" with rectangles by id. Check the file.')
        walls = _by_floor(content["rect"])
        slabs = _by_floor(content["slab"]) if isinstance(content.get("slab"), dict) else {}
        for floor in sorted(walls):
            if options.levels and floor not in options.levels:
                continue
            try:
                yield _floor(path, floor, walls[floor], slabs.get(floor, []), options, lone=len(walls) == 1)
            except PlanError as problem:
                yield problem


def _by_floor(entries: Mapping[str, object]) -> dict[str, list[tuple[str, object]]]:
    found: dict[str, list[tuple[str, object]]] = {}
    for key, entry in entries.items():
        floor = short_name(entry.get("floorID", "")) if isinstance(entry, dict) else ""
        found.setdefault(floor, []).append((short_text(key), entry))
    return found


def _floor(
    path: Path,
    floor: str,
    walls: list[tuple[str, object]],
    slabs: list[tuple[str, object]],
    options: ReadOptions,
    *,
    lone: bool,
) -> FloorPlan:
    name = f"{path}, floor {floor}" if floor else str(path)
    solid = [_outline(f"{name}: wall {key}", entry) for key, entry in walls]
    slab = [_outline(f"{name}: slab {key}", entry) for key, entry in slabs]
    remarks = [_STRUCTURE_ONLY]
    try:
        crossed = sum(not shape.is_valid for shape in [*solid, *slab])
        inside: Area | None = as_area(shapely.union_all([repaired(shape, name) for shape in slab])) if slab else None
    except GEOSException as problem:
        raise PlanError(f"{name}: the slab cannot be repaired ({problem}). Draw it anew.") from problem
    if crossed:
        remarks.append(say_repaired(crossed))
    if inside is None:
        remarks.append("the file has no slab: the floor is what the walls enclose")
    plan_id = path.stem if lone else f"{path.stem}.{floor}"
    return FloorPlan(
        plan_id=plan_id,
        building=f"mlstruct-{floor}" if floor else plan_id,
        floor=plan_id,
        environment="mlstruct_floors",
        source=path.name,
        free=free_from_walls(solid, inside, wall_m=options.wall_m, name=name),
        bounds=Bounds(*(float(side) for side in shapely.total_bounds([*solid, *slab]))),
        remarks=tuple(remarks),
    )


def _outline(name: str, entry: object) -> Polygon:
    """Return the polygon of an entry with its corners in the lists ``x`` and ``y``."""
    x, y = (entry.get("x"), entry.get("y")) if isinstance(entry, dict) else (None, None)
    if not isinstance(x, list) or not isinstance(y, list) or len(x) != len(y) or len(x) < 3:
        raise PlanError(f'{name}: expected lists "x" and "y" of the same length, at least 3 corners in metres.')
    corners: NDArray[np.float64] = finite_points([[*pair] for pair in zip(x, y, strict=True)], name, most=_MOST_CORNERS)
    return Polygon(corners)
