"""Cutting a doorway of a given width through the wall between two rooms, and through nothing else."""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPolygon, Point, Polygon

Floor: TypeAlias = Polygon | MultiPolygon

_STEP_M = 0.05
_LAP_M = 0.01  # a cut laps over the two floors, so that they become one
_SHARES = (1.0, 0.85, 0.7)  # of the asked width, tried in this order
_DEEPER_M = (0.0, 0.1, 0.25, 0.5)
_FLATTEST_M = 0.1  # shorter pieces of an outline do not say how the wall runs


class Doorway(NamedTuple):
    """The floor of a cut [m] and its clear width [m]."""

    floor: Floor
    width: float


class Side(NamedTuple):
    """A room at a door. outline: up to the middle of its walls; floor: up to their faces [m]."""

    outline: Floor
    floor: Floor


def cut_doorway(door: Point, width: float, sides: tuple[Side, Side], others: Floor, wall_m: float) -> Doorway | None:
    """Return the floor to add so that both ``sides`` are joined near ``door``, None where that cannot be done.

    The doorway stands square to the wall, slides along it by up to its own width to come clear of corners, and gets
    down to 0.7 of the asked ``width`` where the shared wall is short. It stays a wall's thickness away from
    ``others``, the floors of all rooms that it does not join.
    """
    gap = max(side.outline.distance(door) for side in sides)
    places = list(_places(door, sides, reach=width + gap, apart=max(sides[0].outline.distance(sides[1].outline), gap)))
    kept_off = others.buffer(0.98 * wall_m, join_style="mitre")
    for share in _SHARES:
        for x, y, along_x, along_y in places:
            for deeper in _DEEPER_M:
                depth = wall_m / 2 + _LAP_M + deeper
                floor = _square(x, y, along_x, along_y, share * width, depth)
                if _joins(floor, sides) and not floor.intersects(kept_off):
                    return Doorway(floor, share * width)
    return _shortest_way(door, width, sides, others.buffer(wall_m / 2, join_style="mitre"))


def _places(
    door: Point, sides: tuple[Side, Side], *, reach: float, apart: float
) -> Iterator[tuple[float, float, float, float]]:
    """Yield middles (x, y) and directions (x, y) along the wall that both sides share, nearest to the door first."""
    near = door.buffer(reach)
    wall = shapely.intersection(shapely.boundary(sides[0].outline), near)
    shared = shapely.intersection(wall, sides[1].outline.buffer(apart + _LAP_M))
    found = []
    for corners in (shapely.get_coordinates(part) for part in shapely.get_parts(shapely.line_merge(_lines(shared)))):
        for start, end in pairwise(corners):
            length = float(np.hypot(*(end - start)))
            if length < _FLATTEST_M:
                continue
            along = (end - start) / length
            nearest = float(np.clip((np.array([door.x, door.y]) - start) @ along, 0, length))
            for offset in np.arange(-reach, reach + _STEP_M, _STEP_M):
                if 0 <= nearest + offset <= length:
                    middle = start + (nearest + offset) * along
                    away = float(np.hypot(middle[0] - door.x, middle[1] - door.y))
                    found.append((away, (float(middle[0]), float(middle[1]), float(along[0]), float(along[1]))))
    return (place for _, place in sorted(found))


def _lines(shape: shapely.Geometry) -> shapely.Geometry:
    parts = shapely.get_parts(shape)
    return shapely.MultiLineString([part for part in parts if isinstance(part, LineString)])


def _square(x: float, y: float, along_x: float, along_y: float, width: float, depth: float) -> Polygon:
    """Return a rectangle ``width`` along the wall and ``depth`` to either side of it."""
    along, across = np.array([along_x, along_y]) * width / 2, np.array([-along_y, along_x]) * depth
    middle = np.array([x, y])
    return Polygon([middle - along - across, middle + along - across, middle + along + across, middle - along + across])


def _joins(floor: Polygon, sides: tuple[Side, Side]) -> bool:
    """Return whether the two mouths of a cut open in their full width, one to either side."""
    corners = shapely.get_coordinates(floor)
    mouths = LineString(corners[:2]), LineString(corners[2:4])
    first, second = (side.floor for side in sides)
    return bool(
        (first.covers(mouths[0]) and second.covers(mouths[1])) or (first.covers(mouths[1]) and second.covers(mouths[0]))
    )


def _shortest_way(door: Point, width: float, sides: tuple[Side, Side], others: Floor) -> Doorway | None:
    """Join the floors through the door's point by a strip of the least asked width, where walls are crooked.

    The strip reaches so deep into both floors that it opens in its width: into a slanting one it would only lead by a
    corner. Where it cannot, it is as wide as the shallowest strip is in the middle.
    """
    narrow = _SHARES[-1] * width
    spot = np.array([door.x, door.y])
    ends = [shapely.get_coordinates(shapely.shortest_line(side.floor, door))[0] for side in sides]
    inside = shapely.union_all([side.outline for side in sides]).buffer(narrow / 2).buffer(-narrow / 2)
    found = []
    for deeper in _DEEPER_M:
        reach = _LAP_M + deeper
        lapped = [end + (end - spot) * (reach / max(_LAP_M, float(np.hypot(*(end - spot))))) for end in ends]
        path = LineString([lapped[0], spot, lapped[1]])
        strip = path.buffer(narrow / 2, cap_style="flat", join_style="mitre")
        for part in shapely.get_parts(shapely.difference(shapely.intersection(strip, inside), others)):
            if isinstance(part, Polygon) and all(part.intersects(side.floor) for side in sides):
                clear = min(narrow, float(part.area / path.length))
                if clear > narrow / 2:
                    found.append(Doorway(part, clear))
                break
        if not found:  # the rooms share no wall there
            return None
    return next((doorway for doorway in found if _opens(doorway, sides)), found[0])


def _opens(doorway: Doorway, sides: tuple[Side, Side]) -> bool:
    """Return whether a disc almost as wide as a doorway gets through it, from one floor to the other."""
    radius = 0.45 * doorway.width
    near = doorway.floor.buffer(2 * doorway.width)
    floors = [shapely.intersection(side.floor, near) for side in sides]
    whole = shapely.union_all([doorway.floor, *floors]).buffer(-radius)
    return any(all(part.intersects(floor) for floor in floors) for part in shapely.get_parts(whole))
