"""Free floor from walls: what lies inside the building and in no wall.

Inside is decided by a closing of the walls, not by a flood from the border, because real facades are not closed: the
walls are grown by half the widest gap that counts as closed, the holes of the result are filled, and it is shrunk
back. Gaps up to that width are bridged, wide courts stay outside, and a lone pillar in front of the house encloses
nothing but itself. A concave hull would do the same, but its only handle is a ratio of edge lengths, not metres; rings
of segments (polygonize) break at the first gap of a millimetre.

The two faces of one wall enclose a sliver that no robot can be in. Parts of the floor below `SMALLEST_ROOM_M2`, or
nowhere `NARROWEST_ROOM_M` wide, are such cavities, and count as wall.
"""

from collections.abc import Iterable, Sequence
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.errors import GEOSException
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Door

SMALLEST_ROOM_M2 = 2.0
NARROWEST_ROOM_M = 0.35
DEEPEST_DOORWAY_M = 0.5  # a door drawn as a line is cut through a wall this thick
OPEN_FACADE_M = 5.0  # gaps of a facade up to this width count as closed
WIDE_FACADE_M = 8.0  # and up to this one, where that encloses a whole hall
_HALL = 1.25  # how much more must be enclosed to be a hall, and not the corners between pillars
_FILM_M = 0.02  # openings are cut this much deeper than drawn: rounding leaves no film of wall in them
_MOST_SELF_CROSSINGS = 300_000
_MOST_REPAIRS = 4_000  # crossings of an outline with itself, each seen from both sides; real ones have a few hundred
_MOST_PAIRS_AT_ONCE = 5_000_000
_FEW_CORNERS = 5000
_MOST_CROSSINGS = 1_000_000  # pairs of walls whose boxes meet; real floors have a few per wall

Area: TypeAlias = Polygon | MultiPolygon
Shapes: TypeAlias = Iterable[BaseGeometry] | NDArray[np.object_]


def free_from_walls(
    walls: Shapes, inside: Area | None, doors: Shapes = (), *, wall_m: float, name: str = "the plan"
) -> Area:
    """Return the free floor [m]: ``inside`` minus the walls, without the cavities of hollow walls.

    walls: lines count as ``wall_m`` thick, areas as they are; invalid areas are repaired. inside: the extent of the
    floor, None to find it with `inside_of_walls`. doors: areas cut out of the walls, and lines cut through a wall
    of `DEEPEST_DOORWAY_M` at most. name: which plan it is, for an error.

    Raises:
        PlanError: far too many walls cross each other, or their geometry cannot be combined.
    """
    try:
        solid = walls_as_area(walls, wall_m=wall_m, name=name)
        floor = inside_of_walls(solid) if inside is None else repaired(inside, name)
        openings = shapely.intersection(openings_as_area(doors, wall_m=wall_m, name=name), floor)
        rooms = _wide_enough(shapely.difference(floor, solid))  # first: a door must not open the cavity of its wall
        return without_cavities(shapely.union(rooms, openings))
    except GEOSException as problem:
        raise PlanError(f"{name}: walls and floor cannot be combined ({problem}). Simplify the drawing.") from problem


def inside_of_walls(solid: BaseGeometry) -> Area:
    """Return what the walls ``solid`` [m] enclose, themselves included; facades may have gaps, see the module."""
    narrow = _close(solid, OPEN_FACADE_M)
    wide = _close(solid, WIDE_FACADE_M)
    return wide if wide.area > _HALL * narrow.area else narrow


def walls_as_area(walls: Shapes, *, wall_m: float, name: str = "the plan") -> Area:
    """Return the walls as one area [m]: lines ``wall_m`` thick with square ends, areas repaired.

    Raises:
        PlanError: so many walls cross each other that combining them would take minutes.
    """
    shapes = _array(walls)
    check_crossings(shapes, name)
    flat = shapely.get_dimensions(shapes) < 2
    check_lines(shapes[flat], name)
    thick = shapely.buffer(shapes[flat], wall_m / 2, cap_style="square", join_style="mitre", mitre_limit=2.0)
    return as_area(shapely.union_all(np.concatenate([thick, _all_repaired(shapes[~flat], name)])))


def openings_as_area(doors: Shapes, *, wall_m: float, name: str = "the plan") -> Area:
    """Return what ``doors`` cut out of walls [m]: areas as drawn, lines as passages.

    Raises:
        PlanError: so many lines cross each other that combining them would take minutes.
    """
    shapes = _array(doors)
    flat = shapely.get_dimensions(shapes) < 2
    check_lines(shapes[flat], name)
    through = shapely.buffer(shapes[flat], max(wall_m / 2, DEEPEST_DOORWAY_M / 2) + _FILM_M, cap_style="flat")
    drawn = shapely.buffer(_all_repaired(shapes[~flat], name), _FILM_M, join_style="mitre")
    return as_area(shapely.union_all(np.concatenate([through, drawn])))


def without_cavities(free: BaseGeometry) -> Area:
    """Return ``free`` [m] without the parts that are no room: too small, or nowhere wide enough to be in."""
    parts = shapely.get_parts(_wide_enough(free))
    return MultiPolygon(parts[shapely.area(parts) >= SMALLEST_ROOM_M2].tolist())


def door_of(opening: BaseGeometry, *, leaf: bool = True) -> Door:
    """Return the door of an opening [m]: its middle, and the longer side of the box around it at any angle."""
    corners = shapely.get_coordinates(shapely.oriented_envelope(opening))
    sides = np.hypot(*np.diff(corners[:3], axis=0).T)
    middle = shapely.centroid(opening)
    return Door(float(middle.x), float(middle.y), round(float(sides.max(initial=0.0)), 3), leaf)


def repaired(outline: BaseGeometry, name: str) -> Area:
    """Return an area whose outline crosses itself as valid areas, filled by the even-odd rule; a valid one as it is.

    Raises:
        PlanError: the outline is a scribble that crosses itself far too often.
    """
    check_outline(outline, name)
    return as_area(outline if outline.is_valid else shapely.make_valid(outline))


def as_area(shape: BaseGeometry) -> Area:
    """Return the areas in ``shape``; the points and lines that overlays leave behind are dropped."""
    if isinstance(shape, Polygon | MultiPolygon):
        return shape
    parts = shapely.get_parts(shapely.get_parts(shape))
    areas: Sequence[Polygon] = parts[shapely.get_dimensions(parts) == 2].tolist()
    union: Area = shapely.union_all(areas) if len(areas) else Polygon()
    return union


def check_outline(outline: BaseGeometry, name: str) -> None:
    """Refuse a scribble, whose repair would take minutes.

    Raises:
        PlanError: the area crosses itself far too often.
    """
    if shapely.get_num_coordinates(outline) < _FEW_CORNERS and outline.is_valid:
        return  # of more corners, even the question whether it is valid may take minutes
    corners, ring = shapely.get_coordinates(_rings(outline), return_index=True)
    real = (ring[1:] == ring[:-1]) & (corners[1:] != corners[:-1]).any(axis=1)
    sides = shapely.linestrings(np.stack([corners[:-1][real], corners[1:][real]], axis=1))
    meet_anyway = 3 * len(sides)  # each meets itself and its two neighbours
    check_crossings(sides, name, most=_MOST_SELF_CROSSINGS, besides=meet_anyway)
    if not outline.is_valid:
        check_crossings(sides, name, most=_MOST_REPAIRS, predicate="crosses")


def _rings(area: BaseGeometry) -> NDArray[np.object_]:
    """Return the rings of all parts: shapely finds none in an area of several parts."""
    rings: NDArray[np.object_] = shapely.get_rings(shapely.get_parts(area))
    return rings


def check_lines(lines: NDArray[np.object_], name: str) -> None:
    """Refuse lines that are a scribble, one of them alone or all together.

    Raises:
        PlanError: the straight pieces of ``lines`` meet far too often.
    """
    sides = _sides(lines)
    check_crossings(sides, name, besides=3 * len(sides))


def check_crossings(
    shapes: NDArray[np.object_],
    name: str,
    *,
    most: int = _MOST_CROSSINGS,
    besides: int = 0,
    predicate: str | None = None,
) -> None:
    """Refuse a scribble: the union of n lines that all cross has n * n / 2 corners.

    Raises:
        PlanError: the boxes around ``shapes``, or what ``predicate`` asks of the shapes themselves, meet in more than
            ``most`` pairs, not counting ``besides``.
    """
    tree = shapely.STRtree(shapes)
    met = -besides
    step = max(1, min(1000, _MOST_PAIRS_AT_ONCE // max(1, len(shapes))))  # all may meet all: it must fit in memory
    for start in range(0, len(shapes), step):
        met += tree.query(shapes[start : start + step], predicate=predicate).shape[1]
        if met > most:
            raise PlanError(f"{name}: lines meet more than {most:,} times. Simplify the drawing.")


def _sides(lines: NDArray[np.object_]) -> NDArray[np.object_]:
    """Return the straight pieces of ``lines``."""
    corners, line = shapely.get_coordinates(shapely.get_parts(lines), return_index=True)
    real = (line[1:] == line[:-1]) & (corners[1:] != corners[:-1]).any(axis=1)
    sides: NDArray[np.object_] = shapely.linestrings(np.stack([corners[:-1][real], corners[1:][real]], axis=1))
    return sides


def _wide_enough(free: BaseGeometry) -> Area:
    """Drop the parts that are nowhere `NARROWEST_ROOM_M` wide."""
    parts = shapely.get_parts(as_area(free))
    core = shapely.buffer(parts, -NARROWEST_ROOM_M / 2, quad_segs=2)
    return MultiPolygon(parts[~shapely.is_empty(core)].tolist())


def _close(solid: BaseGeometry, gap_m: float) -> Area:
    """Fill gaps up to ``gap_m`` and everything that is then enclosed."""
    # One by one: where thousands of parts overlap when grown, that is ten times as fast as growing them together.
    grown = shapely.get_parts(shapely.union_all(shapely.buffer(shapely.get_parts(solid), gap_m / 2, quad_segs=4)))
    filled = shapely.union_all(shapely.polygons(shapely.get_exterior_ring(grown)))
    return as_area(shapely.buffer(filled, -gap_m / 2, quad_segs=4))


def _all_repaired(shapes: NDArray[np.object_], name: str) -> NDArray[np.object_]:
    bad = np.flatnonzero(~shapely.is_valid(shapes))
    for k in bad:
        shapes[k] = repaired(shapes[k], name)
    return shapes


def _array(shapes: Shapes) -> NDArray[np.object_]:
    listed = list(shapes)
    array = np.empty(len(listed), dtype=object)
    array[:] = listed
    kept: NDArray[np.object_] = array[~shapely.is_empty(array)]
    return kept
