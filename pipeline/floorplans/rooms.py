"""Free floor from rooms whose doors are points on their outlines.

Many sources outline rooms that touch without a wall between them and mark a door as a point on the shared line. Every
room gives up half a wall along its outline, and each door is cut through the wall between exactly the two rooms that it
joins: never into a third room, and never outside, since only the floor of rooms and the cuts between them are free.

Rules for what sources draw carelessly:

- Rooms that overlap by a pixel, or a booth inside a hall: the smaller room keeps the floor.
- Neighbours a pixel or two apart: the cut is as deep as the gap needs.
- A door closer to a corner than half its width slides along the shared wall until it fits, or else gets narrower.
- Rooms without walls of their own ("open": areas, corridors) that touch are one space, unless a door lies between them.
- A door said without its rooms joins those that are met first straight through the wall, to either side of it.
"""

from collections.abc import Iterable, Sequence
from itertools import product
from math import floor, hypot
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely.geometry import MultiPolygon, Point, Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.doorways import Doorway, Floor, Side, cut_doorway
from pipeline.floorplans.plan import Door, Room
from pipeline.floorplans.walls import check_outline

_REACH_M = 0.6  # walls, and the errors of drawings, are thinner than this
_KNOWN_REACH_M = 2.0  # the same where the source says which rooms a door joins
_PROBE_M = 0.05
_SMALLEST_PART_M2 = 0.5  # a room keeps smaller scraps only where it has nothing else
_TOUCH_M = 0.02
_LEAST_SHARED_M = 0.3  # open rooms that touch along less are not one space
_ONE_DOOR_M = 0.5  # two doors between the same rooms lie further apart
_MOST_PAIRS = 500_000
_MOST_PASSAGES = 10_000

Pair = tuple[int, int]


class Passage(NamedTuple):
    """A door or opening that a source marks as a point [m].

    rooms: the numbers of the two rooms it joins, None to look for them. width: clear width where the source gives one
    [m]. leaf: False for an opening without a door leaf.
    """

    x: float
    y: float
    rooms: Pair | None = None
    width: float | None = None
    leaf: bool = True


class JoinedRooms(NamedTuple):
    """The floor of all rooms with the cut doors [m]; ``remarks`` say what was repaired, narrowed or left closed."""

    free: Floor
    doors: tuple[Door, ...]
    remarks: tuple[str, ...]


class _Spaces(NamedTuple):
    """Rooms that do not overlap, open ones put together. of_room: the space of each room, -1 where it has no floor."""

    sides: list[Side]
    of_room: list[int]
    tree: shapely.STRtree


def free_from_rooms(
    rooms: Sequence[Room],
    passages: Iterable[Passage],
    *,
    wall_m: float,
    door_width_m: float,
    open_rooms: frozenset[int] = frozenset(),
) -> JoinedRooms:
    """Return the navigable floor of ``rooms`` joined by ``passages``.

    ``wall_m``: thickness of the wall between two rooms [m]. ``door_width_m``: clear width of a passage that has none
    of its own [m]. ``open_rooms``: numbers of the rooms without walls towards each other.

    Raises:
        PlanError: no room, or outlines so tangled that no floor can be computed from them.
    """
    if not rooms:
        raise PlanError("there is no room, expected at least one closed outline. Check what the file holds.")
    try:
        with np.errstate(all="ignore"):  # GEOS divides by zero where lines are parallel, and notices itself
            return _join(rooms, _once_each(passages), wall_m, door_width_m, open_rooms)
    except shapely.errors.GEOSException as problem:
        raise PlanError(f"the outlines of the rooms are too tangled ({problem}). Repair the drawing.") from problem


def repair_outline(outline: Floor) -> tuple[Floor, bool]:
    """Return ``outline`` as valid polygons, and whether it had to be repaired (it crossed itself).

    Raises:
        PlanError: it is a scribble that crosses itself far too often.
    """
    check_outline(outline, "the outline of a room")
    if outline.is_valid:
        return outline, False
    with np.errstate(all="ignore"):
        return only_polygons(shapely.make_valid(outline, method="structure", keep_collapsed=False)), True


def only_polygons(shape: shapely.Geometry) -> Floor:
    """Return the polygons of ``shape`` without its points and lines: one, or a multi-polygon of none or several."""
    parts = [part for part in shapely.get_parts(shape) if isinstance(part, Polygon) and not part.is_empty]
    if not parts and isinstance(shape, shapely.GeometryCollection):
        parts = [part for whole in shapely.get_parts(shape) for part in shapely.get_parts(only_polygons(whole))]
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)


def say_count(number: int, noun: str) -> str:
    """Return "1 door" or "3 doors", for remarks."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def say_repaired(number: int) -> str:
    """Return the remark on outlines that were repaired, "2 outlines crossed themselves and were repaired"."""
    each = "itself and was" if number == 1 else "themselves and were"
    return f"{say_count(number, 'outline')} crossed {each} repaired"


def _join(
    rooms: Sequence[Room], passages: Sequence[Passage], wall_m: float, door_width_m: float, open_rooms: frozenset[int]
) -> JoinedRooms:
    repaired = [repair_outline(room.outline) for room in rooms]
    outlines = [outline for outline, _ in repaired]
    tree = shapely.STRtree(outlines)
    pairs = [passage.rooms or _rooms_at(passage, outlines, tree) for passage in passages]
    spaces = _separate(outlines, tree, wall_m, open_rooms, {frozenset(pair) for pair in pairs if pair is not None})
    doors: list[Door] = []
    cuts: list[Floor] = []
    outside = uncut = 0
    for passage, pair in zip(passages, pairs, strict=True):
        spot, width = Point(passage.x, passage.y), passage.width or door_width_m
        joined = _spaces_of(pair, spot, spaces) if pair is not None else None
        if joined is None:
            outside += 1
        elif joined[0] == joined[1]:
            doors.append(Door(passage.x, passage.y, round(width, 3), passage.leaf))
        elif (cut := _cut(spot, width, wall_m, spaces, joined)) is not None:
            middle = cut.floor.centroid
            cuts.append(cut.floor)
            doors.append(Door(float(middle.x), float(middle.y), round(cut.width, 3), passage.leaf))
        else:
            uncut += 1
    free = only_polygons(shapely.union_all([*(side.floor for side in spaces.sides), *cuts]))
    lost = sum(space < 0 for space in spaces.of_room)
    remarks = _remarks(repaired=sum(crossed for _, crossed in repaired), lost=lost, outside=outside, uncut=uncut)
    return JoinedRooms(free, tuple(doors), remarks)


def _once_each(passages: Iterable[Passage]) -> list[Passage]:
    """Drop passages said twice, as from either side: the same rooms, less than half a metre apart."""
    kept: list[Passage] = []
    in_square: dict[tuple[frozenset[int], int, int], list[Passage]] = {}  # as wide as doors may be apart
    for passage in passages:
        rooms, apart = frozenset(passage.rooms or ()), _ONE_DOOR_M if passage.rooms else _PROBE_M
        col, row = floor(passage.x / apart), floor(passage.y / apart)
        around = product((rooms,), range(col - 1, col + 2), range(row - 1, row + 2))
        others = [other for square in around for other in in_square.get(square, ())]
        if all(hypot(passage.x - other.x, passage.y - other.y) >= apart for other in others):
            in_square.setdefault((rooms, col, row), []).append(passage)
            kept.append(passage)
        if len(kept) > _MOST_PASSAGES:
            raise PlanError(f"more than {_MOST_PASSAGES:,} doors, at most that many are read. Split the drawing.")
    return kept


def _rooms_at(passage: Passage, outlines: Sequence[Floor], tree: shapely.STRtree) -> Pair | None:
    """Return the two rooms met first straight through the wall at ``passage``, None where one side has no room."""
    spot = Point(passage.x, passage.y)
    near = tree.query(spot, predicate="dwithin", distance=_REACH_M)
    if len(near) < 2:
        return None
    walls = shapely.boundary([outlines[number] for number in near])
    across = _across(walls[int(np.argmin(shapely.distance(walls, spot)))], spot)
    steps = np.arange(_PROBE_M, _REACH_M + _PROBE_M / 2, _PROBE_M)
    by_size = sorted(near, key=lambda number: (outlines[number].area, number))
    met: list[dict[int, int]] = []
    for direction in (across, -across):
        probes = np.array([spot.x, spot.y]) + steps[:, None] * direction
        inside = [shapely.contains_xy(outlines[number], probes) for number in by_size]
        first: dict[int, int] = {}
        for step, at_step in enumerate(np.array(inside).T):
            if at_step.any():
                first.setdefault(int(by_size[int(np.argmax(at_step))]), step)
        met.append(first)
    found = [(met[0][a] + met[1][b], (a, b)) for a in met[0] for b in met[1] if a != b]
    return min(found)[1] if found else None


def _across(wall: shapely.Geometry, spot: Point) -> NDArray[np.float64]:
    """Return the direction square to the piece of ``wall`` at ``spot``; the longer piece at a corner."""
    corners, ring = shapely.get_coordinates(shapely.get_parts(wall), return_index=True)
    pieces = np.diff(corners, axis=0)
    length = np.hypot(*pieces.T)
    real = (ring[1:] == ring[:-1]) & (length > 0)
    start, along, length = corners[:-1][real], pieces[real] / length[real, None], length[real]
    offset = np.array([spot.x, spot.y]) - start
    reached = np.clip((offset * along).sum(axis=1), 0, length)
    away = np.hypot(*(offset - reached[:, None] * along).T).round(2)
    if not away.size:
        return np.array([0.0, 1.0])
    x, y = along[np.lexsort((-length, away))[0]]
    return np.array([-y, x])


def _separate(
    outlines: Sequence[Floor],
    tree: shapely.STRtree,
    wall_m: float,
    open_rooms: frozenset[int],
    divided: set[frozenset[int]],
) -> _Spaces:
    """Give each piece of floor to one room, put open rooms together, and take half a wall off each space."""
    first, second = tree.query(outlines, predicate="dwithin", distance=_TOUCH_M)
    if len(first) > _MOST_PAIRS:
        raise PlanError(f"{len(first):,} pairs of rooms touch or overlap; this is no floor. Check the drawing.")
    rank = {number: (number in open_rooms, outlines[number].area, number) for number in range(len(outlines))}
    before: dict[int, list[int]] = {}
    seams = []
    joined = [*range(len(outlines))]  # from each room a way to the one that stands for its space
    for a, b in zip(first.tolist(), second.tolist(), strict=True):
        is_seam = a in open_rooms and b in open_rooms and a != b and frozenset((a, b)) not in divided
        if is_seam and _root(joined, a) == _root(joined, b):
            continue  # one space already: not measured, for hundreds of outlines in one place have many pairs
        if is_seam and _shared_length(outlines[a], outlines[b]) >= _LEAST_SHARED_M:
            seams.append((a, b))
            joined[_root(joined, a)] = _root(joined, b)
        elif rank[b] < rank[a]:
            before.setdefault(a, []).append(b)
    owned = [
        only_polygons(shapely.difference(outline, shapely.union_all([outlines[other] for other in before[number]])))
        if number in before
        else outline
        for number, outline in enumerate(outlines)
    ]
    return _spaces(owned, seams, wall_m)


def _root(joined: list[int], room: int) -> int:
    while joined[room] != room:
        joined[room] = room = joined[joined[room]]
    return room


def _shared_length(one: Floor, other: Floor) -> float:
    """Return along how many metres two rooms touch or overlap."""
    reach = [shapely.intersection(a.boundary, b.buffer(_TOUCH_M)).length for a, b in ((one, other), (other, one))]
    return float(max(reach))


def _spaces(owned: Sequence[Floor], seams: Sequence[Pair], wall_m: float) -> _Spaces:
    ends = np.array(seams, dtype=int).reshape(-1, 2).T
    links = coo_array((np.ones(ends.shape[1]), (ends[0], ends[1])), shape=(len(owned), len(owned)))
    count, group = connected_components(links, directed=False)
    members: list[list[int]] = [[] for _ in range(count)]
    for number, its in enumerate(group.tolist()):
        members[its].append(number)
    sides: list[Side] = []
    of_room = [-1] * len(owned)
    for rooms in members:
        outline = owned[rooms[0]]
        if len(rooms) > 1:
            together = shapely.union_all([owned[number] for number in rooms]).buffer(_TOUCH_M, join_style="mitre")
            outline = only_polygons(together.buffer(-_TOUCH_M, join_style="mitre"))
        floor = _main_parts(only_polygons(outline.buffer(-wall_m / 2, join_style="mitre")))
        if floor.is_empty:
            continue
        for number in rooms:
            of_room[number] = len(sides) if not owned[number].is_empty else -1
        sides.append(Side(outline, floor))
    return _Spaces(sides, of_room, shapely.STRtree([side.outline for side in sides]))


def _main_parts(floor: Floor) -> Floor:
    """Drop scraps that overlaps leave of a room, such as a sliver behind a wall."""
    parts = shapely.get_parts(floor)
    if len(parts) < 2:
        return floor
    areas = shapely.area(parts)
    return only_polygons(MultiPolygon(list(parts[(areas >= _SMALLEST_PART_M2) | (areas == areas.max())])))


def _spaces_of(pair: Pair, spot: Point, spaces: _Spaces) -> Pair | None:
    """Return the spaces of two rooms, None where one has no floor or lies too far from the door."""
    first, second = (spaces.of_room[number] for number in pair)
    if min(first, second) < 0:
        return None
    far = any(spaces.sides[number].outline.distance(spot) > _KNOWN_REACH_M for number in (first, second))
    return None if far else (first, second)


def _cut(spot: Point, width: float, wall_m: float, spaces: _Spaces, joined: Pair) -> Doorway | None:
    reach = 2 * (width + _KNOWN_REACH_M + wall_m)
    window = shapely.box(spot.x - reach, spot.y - reach, spot.x + reach, spot.y + reach)
    near = spaces.tree.query(window)
    others = shapely.union_all([spaces.sides[number].floor for number in near if number not in joined])
    # Halls with ten thousand corners and a hundred doors: only what lies around the door is looked at.
    first, second = (Side(*(only_polygons(part.intersection(window)) for part in spaces.sides[k])) for k in joined)
    if first.floor.is_empty or second.floor.is_empty:
        return None
    return cut_doorway(spot, width, (first, second), only_polygons(others.intersection(window)), wall_m)


def _remarks(*, repaired: int, lost: int, outside: int, uncut: int) -> tuple[str, ...]:
    sealed = "to no outlined room and stays closed", "to no outlined room and stay closed"
    no_wall, why = "rooms that share no wall there, and", "thinner than walls, or under other rooms"
    said = [
        (lost, "room", f"has no floor of its own: {why}", f"have no floor of their own: {why}"),
        (outside, "door", f"leads outside or {sealed[0]}", f"lead outside or {sealed[1]}"),
        (uncut, "door", f"joins {no_wall} stays closed", f"join {no_wall} stay closed"),
    ]
    counted = [f"{say_count(count, noun)} {one if count == 1 else many}" for count, noun, one, many in said if count]
    return (*((say_repaired(repaired),) if repaired else ()), *counted)
