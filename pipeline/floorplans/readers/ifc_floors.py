"""Which bodies of an IFC model make which floor, so that each floor is read once and through its own bodies.

A level is cut through the bodies that it contains. Bodies of other levels of its building count as well where they
reach through its cut: wholly where their level lies a storey away and above or below it, as for a facade that stands on
the ground and rises to the roof; else, as for wings and split levels, only as far as they bound its own outline.

Levels at one height that hold one floor between them, such as a finish and a slab level, or a level for each trade, are
read together, at the height of the one with the most walls. Levels at one height that lie side by side stay apart.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.floorplans.readers.ifc_levels import Home, Level
from pipeline.floorplans.walls import Area, as_area

WALL, BARRIER, DOOR, PASSAGE, DOORWAY, SPACE, UNREAD = (
    *("wall", "barrier", "door", "passage", "doorway", "space"),
    "unread",
)
"""What a body is to a floor. Barriers are of classes that are walls in some models only; see `ifc_bodies`."""

_SAME_FLOOR_M = 0.5  # levels no further apart in height may be one floor
_STOREY_M = 2.0  # levels further apart lie one above the other
_REACH_M = 0.35  # what bounds an outline lies no further from it
_ONE_FLOOR = 0.7  # of the smaller outline lies in the other
_STACKED = 0.25  # the same for levels one above the other
_MOSTLY = 0.5  # of an outline; a floor is not taken away from a level that mostly lies in it
_CLOSED = 0.4  # of its hull is filled by walls that enclose something
_LARGEST_BARRIER_M2 = 20.0  # a larger body of an unclear class is a zone or the ground, no wall


class Piece(NamedTuple):
    """What the cut of a level shows of one body.

    kind: its IFC class. part_of: the id of the curtain wall that it is a part of, 0 for none.
    """

    role: str
    kind: str
    home: Home
    area: Area
    label: str = ""
    part_of: int = 0


@dataclass
class Floor:
    """A floor: the level that it is named by and cut at, and what it is made of.

    read_with: levels whose bodies it holds as well. pieces: what it is made of. elsewhere: floor of other levels at
    this height. as_walls: how many bodies of each class of barriers are among the pieces; unread: the same for bodies
    that were left out.
    """

    level: int
    read_with: list[int] = field(default_factory=list)
    pieces: list[Piece] = field(default_factory=list)
    elsewhere: list[Area] = field(default_factory=list)
    as_walls: Counter[str] = field(default_factory=Counter)
    unread: Counter[str] = field(default_factory=Counter)


class _Outline(NamedTuple):
    """What the own bodies of a level enclose, or span where they are open, and their convex hull, grown.

    closed: what they enclose, themselves included.
    """

    filled: BaseGeometry
    closed: BaseGeometry
    hull: BaseGeometry


class _Known(NamedTuple):
    """What all floors of a model share. solid: the role of what makes a floor of a level."""

    levels: Sequence[Level]
    outlines: Sequence[_Outline]
    solid: str
    one_building: bool


_NOWHERE = _Outline(Polygon(), Polygon(), Polygon())


def floors_of(
    levels: Sequence[Level], cuts: Sequence[Sequence[Piece]], inhabited: frozenset[int], buildings: int
) -> list[Floor]:
    """Return the floors: of each level that is one, or of several that are one together.

    cuts: for each level, what a plane above it shows of the bodies of its building. inhabited: levels with bodies of
    their own that a floor has, slabs included. buildings: how many the model has.
    """
    outlines = [_outline(number, cut) for number, cut in enumerate(cuts)]
    # Some programs write every wall as a body of no class.
    solid = WALL if any(piece.role == WALL for cut in cuts for piece in cut) else BARRIER
    areas = [
        sum(piece.area.area for piece in cut if _stands(piece, solid) and piece.home.level == number)
        for number, cut in enumerate(cuts)
    ]
    groups: list[list[int]] = []
    for number in range(len(levels)):
        if areas[number] > 0:
            same = (group for group in groups if _is_one_floor(group, number, levels, outlines))
            if (group := next(same, None)) is None:
                groups.append([number])
            else:
                group.append(number)
    walled = [list(group) for group in groups]
    owners = {levels[group[0]].building for group in groups}
    for number, level in enumerate(levels):
        # Some models assign walls to no level at all: then any level that they stand on is a floor.
        loose = level.building not in owners and any(
            _stands(piece, solid) and piece.home.level < 0 and (piece.home.building == level.building or not owners)
            for piece in cuts[number]
        )
        if (number in inhabited or loose) and not areas[number]:
            near = [group for group in groups if _is_near(levels[group[0]], level)]
            for group in near:
                group.append(number)
            if not near:
                groups.append([number])
    known = _Known(levels, outlines, solid, buildings <= 1)
    floors = []
    for k, group in enumerate(groups):
        head = max(group, key=lambda number: (areas[number], -number))
        floor = Floor(head, read_with=[number for number in group if number != head])
        sure = frozenset(walled[k] if k < len(walled) else group)
        beside = any(other is not group and _is_near(levels[other[0]], levels[head]) for other in groups)
        if _fill(floor, sure, cuts[head], known, beside=beside):
            floors.append(floor)
    return floors


def _fill(floor: Floor, sure: frozenset[int], cut: Sequence[Piece], known: _Known, *, beside: bool) -> bool:
    """Fill ``floor`` with what of a cut is its own; return whether walls are, more than what bounds a neighbour's.

    sure: its levels with walls of their own. beside: other floors lie at its height.
    """
    level, own = known.levels[floor.level], {floor.level, *floor.read_with}
    hull, filled, closed = (
        shapely.union_all([getattr(known.outlines[number], name) for number in sure])
        for name in ("hull", "filled", "closed")
    )
    stands, neighbours = False, set()
    for piece in cut:
        home = piece.home
        if home.shared & own or home.level in sure or (home.level in own and not beside):
            whole = True
        elif home.level in own or home.level < 0:
            sole = home.level < 0 and (known.one_building or home.building >= 0)
            whole = sole or hull.is_empty or bool(shapely.intersects(piece.area, hull))
            if not whole:
                continue
        else:
            whole = _lies_over(known.levels[home.level], level, known.outlines[home.level].filled, filled)
        if not whole:
            neighbours.add(home.level)
        stands |= whole and _stands(piece, known.solid)
        area = piece.area if whole else _within(piece, hull)
        if area is not None and (not area.is_empty or piece.role == UNREAD):
            _add(floor, piece, area)
    for number in sorted(neighbours):
        other = known.outlines[number].filled
        near = abs(known.levels[number].elevation - level.elevation) < _STOREY_M / 2
        if near and not hull.is_empty and shapely.intersection(other, hull).area < _MOSTLY * hull.area:
            floor.elsewhere.append(as_area(shapely.difference(other, closed)))
    return stands


def _add(floor: Floor, piece: Piece, area: Area) -> None:
    if piece.role == UNREAD or (piece.role == BARRIER and piece.area.area > _LARGEST_BARRIER_M2):
        floor.unread[piece.kind] += 1
        return
    if piece.role == BARRIER:
        floor.as_walls[piece.kind] += 1
    floor.pieces.append(piece._replace(area=area))


def _within(piece: Piece, hull: BaseGeometry) -> Area | None:
    """Return what of a body of a neighbouring level bounds an outline; rooms are the neighbour's own."""
    if piece.role == SPACE or hull.is_empty:
        return None
    if piece.role in (DOOR, UNREAD):
        return piece.area if shapely.covers(hull, piece.area.centroid) else None
    return as_area(shapely.intersection(piece.area, hull))


def _lies_over(one: Level, other: Level, of_one: BaseGeometry, of_other: BaseGeometry) -> bool:
    """Return whether two levels lie one above the other, and a storey apart; where nothing is known of one, they do."""
    if abs(one.elevation - other.elevation) < _STOREY_M:
        return False
    return of_one.is_empty or of_other.is_empty or _overlap(of_one, of_other) > _STACKED


def _stands(piece: Piece, solid: str) -> bool:
    """Return whether a body makes a floor of a level; windows on a level of sills alone do not."""
    return piece.role == solid and piece.kind != "IfcWindow"


def _is_near(one: Level, other: Level) -> bool:
    return one.building == other.building and abs(one.elevation - other.elevation) <= _SAME_FLOOR_M


def _is_one_floor(group: list[int], number: int, levels: Sequence[Level], outlines: Sequence[_Outline]) -> bool:
    return _is_near(levels[group[0]], levels[number]) and any(
        _overlap(outlines[number].filled, outlines[member].filled) > _ONE_FLOOR for member in group
    )


def _overlap(one: BaseGeometry, other: BaseGeometry) -> float:
    """Return the share of the smaller area that lies in the other."""
    smaller = min(one.area, other.area)
    return float(shapely.intersection(one, other).area / smaller) if smaller > 0 else 0.0


def _outline(level: int, cut: Sequence[Piece]) -> _Outline:
    own = [p.area for p in cut if p.home.level == level and p.role in (WALL, BARRIER, DOOR, SPACE)]
    own = [area for area in own if not area.is_empty]
    if not own:
        return _NOWHERE
    whole = shapely.union_all(own)
    grown = shapely.buffer(whole, _REACH_M, join_style="mitre")
    closed = shapely.union_all([Polygon(part.exterior) for part in shapely.get_parts(grown)])
    filled = shapely.buffer(closed, -_REACH_M, join_style="mitre")
    hull = shapely.convex_hull(whole)
    span = filled if filled.area >= _CLOSED * hull.area else hull
    return _Outline(span, filled, shapely.buffer(hull, _REACH_M))
