"""What drawings in units of their own have in common: walls, openings and rooms by layer or class, and a scale."""

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.errors import GEOSException
from shapely.geometry.base import BaseGeometry

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, Door, FloorPlan, Room
from pipeline.floorplans.readers.json_file import MOST_COORDINATES
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.walls import Area, as_area, door_of, free_from_walls, openings_as_area, repaired

LARGEST_UNIT = 1e10  # of a coordinate in drawing units: millimetres of a national grid have nearly as many
# What the libraries that parse drawings raise on damaged text, beside errors of their own. Lack of memory is not among
# them: `read_plans` says what to do about that.
PARSER_ERRORS = (
    *(ArithmeticError, AssertionError, AttributeError, LookupError, RuntimeError, TypeError, ValueError),
    *(struct.error, GEOSException),
)
_NARROW_M, _WIDE_M = 0.5, 3.0  # of doors, in the median
_SEAM_M = 0.02
_NEAR_M = 0.1


@dataclass(kw_only=True)
class Drawing:
    """Shapes of one floor in drawing units, y up.

    walls: lines and areas. openings: areas cut through the walls. rooms: outline and label. remarks: as in `Plan`.
    """

    walls: list[BaseGeometry] = field(default_factory=list)
    openings: list[BaseGeometry] = field(default_factory=list)
    rooms: list[tuple[BaseGeometry, str]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)


def scale_of(name: str, drawing: Drawing, options: ReadOptions) -> float:
    """Return the size of a drawing unit that a person gave [m]; ``name`` says in an error what has none.

    Raises:
        PlanError: none was given; proposes the one at which the doors have the width ``door_width_m``.
    """
    if options.metres_per_unit is not None:
        return options.metres_per_unit
    widths = [door_of(opening).width for opening in drawing.openings]
    width = float(np.median(widths)) if widths else 0.0
    wide = max(width, 1e-9)
    hint = f" Its doors are {width:.3g} units wide: {options.door_width_m:g} m at {options.door_width_m / wide:.3g}."
    raise PlanError(
        f"{name}: the file does not say how many metres a unit of it has. Set plans.read.metres_per_unit."
        f"{hint if width > 0 else ''}"
    )


def is_any_of(name: str, patterns: Iterable[str]) -> bool:
    """Return whether ``name`` fits a pattern with * and ?, whatever the case of its letters."""
    return any(fnmatchcase(name.lower(), pattern.lower()) for pattern in patterns)


def plan_of(
    drawing: Drawing, scale: float, options: ReadOptions, *, plan_id: str, building: str, environment: str, path: Path
) -> FloorPlan:
    """Return the plan of a drawing whose unit is ``scale`` metres.

    Where rooms are outlined, the floor is rooms and openings without the walls; else what the walls enclose.

    Raises:
        PlanError: there is no wall and no room, too many coordinates, or geometry that cannot be combined.
    """
    name = f"{path} ({plan_id})"
    _check(drawing, name)
    walls = _scaled(drawing.walls, scale)
    openings = _scaled(drawing.openings, scale)
    outlines = _scaled([outline for outline, _ in drawing.rooms], scale)
    try:
        rooms = [repaired(outline, name) for outline in outlines]
        inside = _floor_of(rooms, openings) if rooms else None
        everything = shapely.total_bounds(np.concatenate([walls, openings, outlines]))
        free = free_from_walls(walls, inside, openings, wall_m=options.wall_m, name=name)
    except GEOSException as problem:
        raise PlanError(f"{name}: the rooms cannot be combined ({problem}). Simplify the drawing.") from problem
    labels = (label for _, label in drawing.rooms)
    doors = tuple(door_of(opening) for opening in openings)
    return FloorPlan(
        plan_id=plan_id,
        building=building,
        floor=plan_id,
        environment=environment,
        source=path.name,
        free=free,
        bounds=Bounds(*(float(side) for side in everything)),
        rooms=tuple(Room(room, label) for room, label in zip(rooms, labels, strict=True) if room.area > 0),
        doors=doors,
        remarks=(*drawing.remarks, *_odd_widths(doors)),
    )


def _odd_widths(doors: Sequence[Door]) -> list[str]:
    """Return a remark where most doors are too narrow or wide for people: the scale is wrong."""
    width = float(np.median([door.width for door in doors])) if doors else 1.0
    if _NARROW_M <= width <= _WIDE_M:
        return []
    return [f"half of its doors are {width:.2g} m wide or {'more' if width > _WIDE_M else 'less'}: check the scale"]


def _floor_of(rooms: Sequence[Area], openings: NDArray[np.object_]) -> Area:
    """Return rooms and the openings between them; an opening that meets only one room leads outside, and is no floor.

    Without that, the front door would be a niche in the facade.
    """
    doors = shapely.STRtree(rooms).query(openings, predicate="dwithin", distance=_NEAR_M)[0]
    inner = openings[np.bincount(doors, minlength=len(openings)) >= 2]
    through = openings_as_area(inner, wall_m=0.0)
    # The rooms of an open plan just touch: without a seam, rounding would part them.
    seams = shapely.buffer(np.array(rooms, dtype=object), _SEAM_M, join_style="mitre")
    return as_area(shapely.union_all([*seams, through]))


def _scaled(shapes: Iterable[BaseGeometry], scale: float) -> NDArray[np.object_]:
    listed = list(shapes)
    array = np.empty(len(listed), dtype=object)
    array[:] = listed
    scaled: NDArray[np.object_] = shapely.transform(array, lambda points: points * scale)
    return scaled


def _check(drawing: Drawing, name: str) -> None:
    if not drawing.walls and not drawing.rooms:
        raise PlanError(f"{name}: neither walls nor rooms were found. Check its layers or classes.")
    shapes = [*drawing.walls, *drawing.openings, *(outline for outline, _ in drawing.rooms)]
    count = int(np.sum(shapely.get_num_coordinates(shapes)))
    if count > MOST_COORDINATES:
        raise PlanError(f"{name}: {count:,} coordinates, at most {MOST_COORDINATES:,} are read. Simplify the drawing.")
    if not (np.abs(shapely.get_coordinates(shapes)) <= LARGEST_UNIT).all():
        raise PlanError(f"{name}: a coordinate is not finite or beyond {LARGEST_UNIT:g}. Repair the drawing.")
