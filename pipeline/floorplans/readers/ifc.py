"""IFC building models: every storey cut 1.1 m above its own floor. Needs the extra ``ifc`` (ifcopenshell).

A storey is cut through its own bodies, and through those of others of its building that reach into it; a building of
several in one model is a building of its own. See `ifc_floors` for storeys that are one floor together.

Walls, columns and windows are cut without their openings, and each door takes its box out of the walls, so that
windows stay closed and doors are open; an opening down to the floor with nothing in it is a passage. Spaces are the
rooms; their names become labels. Where they fill most of what the walls enclose, the floor is theirs alone: porches and
terraces stay outside. A storey without walls at that height, such as a roof, is passed over and said in the remarks of
the others, as is what stands in the cut and is of a class that is not read.
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
from pipeline.floorplans.readers.ifc_bodies import CUT_M
from pipeline.floorplans.readers.ifc_cuts import Storey, cut_storeys
from pipeline.floorplans.readers.json_file import short_name, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.walls import Area, as_area, door_of, free_from_walls

_MOST_NAMED = 10  # storeys in a remark
_THICKEST_M = 0.7  # spaces no further apart are neighbours
_MOSTLY = 0.6  # of the enclosed floor lies in spaces, where a model has them all


@dataclass(frozen=True)
class Ifc:
    """Reader of IFC files in STEP form; the building is the file, or the IfcBuilding where a file has several."""

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
        floors = [storey for storey in storeys if storey.walls]
        if not floors:
            raise PlanError(f"{path}: no wall stands {CUT_M} m above any of {len(storeys)} storeys. Check the model.")
        several = len({storey.building for storey in floors}) > 1
        for storey in floors:
            names = {short_name(name) for name in (storey.name, *storey.read_with)}
            if not options.levels or names & {*options.levels}:
                without = [each.name for each in storeys if not each.walls and each.building == storey.building]
                try:
                    yield _plan(path, storey, without, options, several=several)
                except PlanError as problem:
                    yield problem


def _plan(path: Path, storey: Storey, without: list[str], options: ReadOptions, *, several: bool) -> FloorPlan:
    level = short_name(storey.name)
    named = [short_name(path.stem), short_name(storey.building)] if several else [short_name(path.stem)]
    building = ".".join(filter(None, named))
    name = f"{path}, storey {'.'.join([*named[1:], level])}"
    outlines = [area for area, _ in storey.spaces]
    try:
        solid = shapely.union_all(storey.walls)
        passages, doorways = _in_walls(storey.passages, solid), _in_walls(storey.doorways, solid)
        doors = [*(_through(door) for door in storey.doors), *passages, *doorways]
        free = free_from_walls(storey.walls, None, doors, wall_m=options.wall_m, name=name)
        elsewhere = shapely.union_all(storey.elsewhere)
        free = as_area(shapely.difference(free, elsewhere))
        rooms = as_area(_with_gaps(outlines))
        in_rooms = shapely.intersection(free, rooms).area >= _MOSTLY * free.area
    except GEOSException as problem:
        raise PlanError(
            f"{name}: walls and spaces cannot be combined ({problem}). Export the model again."
        ) from problem
    if outlines and in_rooms:
        free = free_from_walls(storey.walls, rooms, doors, wall_m=options.wall_m, name=name)
    return FloorPlan(
        plan_id=f"{building}.{level}",
        building=building,
        floor=f"{building}.{level}",
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
        yield f"storeys without walls {CUT_M} m above them were passed over: {_listed(without)}"
    if storey.read_with:
        yield f"storeys at the height of this floor were read with it: {_listed(storey.read_with)}"
    if storey.as_walls:
        yield f"read as walls, though of classes that need not be: {_counted(storey.as_walls)}"
    if storey.unread:
        yield f"what stands {CUT_M} m above the floor and is not read: {_counted(storey.unread)}"
    if storey.unseen:
        yield f"{storey.unseen:,} elements of the model are of classes that are not read, and were not looked at"
    if storey.left_out:
        yield f"{storey.left_out} bodies of the model could not be built, or are not closed, and were left out"
    if not storey.spaces:
        yield "the storey has no spaces: rooms are not known"
    elif not in_rooms:
        yield "spaces fill only a part of the storey: its floor is what the walls enclose"


def _listed(names: list[str]) -> str:
    return ", ".join(names[:_MOST_NAMED]) + (" and others" if len(names) > _MOST_NAMED else "")


def _counted(kinds: dict[str, int]) -> str:
    return _listed([f"{count} {kind}" for kind, count in sorted(kinds.items())])


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
