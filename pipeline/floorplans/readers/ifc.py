"""IFC building models: every storey cut 1.1 m above its own floor. Needs the extra ``ifc`` (ifcopenshell).

Walls, columns and windows are cut without their openings, and each door takes its box out of the walls, so that
windows stay closed and doors are open; an opening down to the floor with nothing in it is a passage. Spaces are the
rooms; their names become labels. Where they fill most of what the walls enclose, the floor is theirs alone: porches and
terraces stay outside. A storey without walls at that height, such as a roof, is passed over and said in the remarks of
the others.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely.errors import GEOSException
from shapely.geometry import MultiPolygon
from shapely.geometry.base import BaseGeometry

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, FloorPlan, GridPlan, Room
from pipeline.floorplans.readers.ifc_cuts import CUT_M, Storey, cut_storeys
from pipeline.floorplans.readers.json_file import short_name, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.walls import Area, as_area, door_of, free_from_walls

_MOST_NAMED = 10  # storeys in a remark
_THICKEST_M = 0.7  # spaces no further apart are neighbours
_MOSTLY = 0.6  # of the enclosed floor lies in spaces, where a model has them all


@dataclass(frozen=True)
class Ifc:
    """Reader of IFC files in STEP form; the building is the file."""

    name: str = "ifc"
    patterns: tuple[str, ...] = ("*.ifc",)
    uses: tuple[str, ...] = ("levels", "wall_m")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a STEP file with an IFC schema."""
        head = sniff_text(path)
        return head.lstrip().startswith("ISO-10303-21") and "FILE_SCHEMA" in head and "IFC" in head

    def accompanies(self, path: Path) -> bool:
        """Return False: a model is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield one plan for each storey with walls; see `Reader.read`. Uses ``levels``; the model states its units."""
        storeys = cut_storeys(path)
        without = [storey.name for storey in storeys if not storey.walls]
        if len(without) == len(storeys):
            raise PlanError(f"{path}: no wall stands {CUT_M} m above any of {len(storeys)} storeys. Check the model.")
        for storey in storeys:
            level = short_name(storey.name)
            if storey.walls and (not options.levels or level in options.levels):
                try:
                    yield _plan(path, level, storey, without, options)
                except PlanError as problem:
                    yield problem


def _plan(path: Path, level: str, storey: Storey, without: list[str], options: ReadOptions) -> FloorPlan:
    name = f"{path}, storey {level}"
    outlines = [area for area, _ in storey.spaces]
    stem = short_name(path.stem)
    try:
        solid = shapely.union_all(storey.walls)
        passages, doorways = _in_walls(storey.passages, solid), _in_walls(storey.doorways, solid)
        doors = [*(_through(door) for door in storey.doors), *passages, *doorways]
        free = free_from_walls(storey.walls, None, doors, wall_m=options.wall_m, name=name)
        rooms = as_area(_with_gaps(outlines))
        in_rooms = shapely.intersection(free, rooms).area >= _MOSTLY * free.area
    except GEOSException as problem:
        raise PlanError(
            f"{name}: walls and spaces cannot be combined ({problem}). Export the model again."
        ) from problem
    if outlines and in_rooms:
        free = free_from_walls(storey.walls, rooms, doors, wall_m=options.wall_m, name=name)
    return FloorPlan(
        plan_id=f"{stem}.{level}",
        building=stem,
        floor=f"{stem}.{level}",
        environment="ifc_storeys",
        source=path.name,
        free=free,
        bounds=Bounds(*shapely.total_bounds([*storey.walls, *outlines]).tolist()),
        rooms=tuple(Room(area, label) for area, label in storey.spaces),
        doors=(*map(door_of, storey.doors), *(door_of(area, leaf=False) for area in passages)),
        remarks=tuple(_remarks(storey, without, in_rooms=in_rooms)),
    )


def _in_walls(openings: list[Area], solid: BaseGeometry) -> list[Area]:
    """Return what openings take out of walls; their bodies reach beyond them."""
    areas = [as_area(shapely.intersection(area, solid)) for area in openings]
    return [area for area in areas if not area.is_empty]


def _remarks(storey: Storey, without: list[str], *, in_rooms: bool) -> Iterator[str]:
    if without:
        named = ", ".join(without[:_MOST_NAMED]) + (" and others" if len(without) > _MOST_NAMED else "")
        yield f"storeys without walls {CUT_M} m above them were passed over: {named}"
    if storey.left_out:
        yield f"{storey.left_out} bodies of the model could not be built and were left out"
    if not storey.spaces:
        yield "the storey has no spaces: rooms are not known"
    elif not in_rooms:
        yield "spaces fill only a part of the storey: its floor is what the walls enclose"


def _with_gaps(outlines: list[Area]) -> BaseGeometry:
    """Return spaces with what lies between neighbours: walls, and the gaps in them that are ways."""
    grown = shapely.union_all(shapely.buffer(outlines, _THICKEST_M / 2, join_style="mitre"))
    return shapely.buffer(grown, -_THICKEST_M / 2, join_style="mitre")


def _through(door: Area) -> Area:
    """Return the box of a door grown across the thickness of its wall, so that it opens the wall from face to face."""
    corners = shapely.get_coordinates(door)[:4]
    sides = np.diff(np.vstack([corners, corners[:1]]), axis=0)
    lengths = np.hypot(*sides.T)
    across = sides[int(np.argmin(lengths))] / max(float(lengths.min()), 1e-9)
    grown = MultiPolygon([door, *(shapely.affinity.translate(door, *(across * step)) for step in (-0.25, 0.25))])
    return as_area(shapely.convex_hull(grown))
