"""Rows of a campus floor cut into rooms, each with the door that joins it to a corridor or to another room."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pipeline.floorplans.generators.campus_layout import Box, Hall, Row, oriented

LOBBY = "LOBBY"
SHAFT = ""  # solid: ducts, lifts
SUITE = "SUITE"  # an office with others behind it; no label of a room

Choices = dict[str, float]

_SERVICES: Choices = {"TOILET": 0.07, "STAIRS": 0.06, LOBBY: 0.06, SHAFT: 0.03, "CLOSET": 0.08}
_PROGRAMS: list[Choices] = [
    _SERVICES | {"OFFICE": 0.60, SUITE: 0.06, "CONFERENCE": 0.06, "LAB": 0.04},
    _SERVICES | {"OFFICE": 0.22, SUITE: 0.05, "LAB": 0.46},
    _SERVICES | {"OFFICE": 0.14, "CLASSROOM": 0.52, "CONFERENCE": 0.08},
]
_WIDTHS: dict[str, tuple[float, float]] = {
    "OFFICE": (2.8, 6.0),
    SUITE: (6.0, 10.0),
    "CONFERENCE": (4.5, 9.0),
    "LAB": (6.0, 14.0),
    "CLASSROOM": (7.5, 13.0),
    "TOILET": (3.0, 5.0),
    "STAIRS": (3.0, 4.0),
    "CLOSET": (1.8, 3.2),
    LOBBY: (4.0, 9.0),
    SHAFT: (1.0, 2.5),
}
_MOST_DEPTH: dict[str, tuple[float, float]] = {"CLOSET": (1.6, 3.5), "TOILET": (4.5, 8.0), "STAIRS": (5.0, 7.5)}
_GRAND = frozenset({"LAB", "CLASSROOM", "CONFERENCE", LOBBY})  # rooms that may have a double door
_PRIVATE = frozenset({"STAIRS", "TOILET", LOBBY})  # rooms without further doors
_DIVISIBLE = frozenset({"LAB", "OFFICE"})  # rooms that may have others behind them
_PROGRAM_SHARES = (0.35, 0.3, 0.35)  # of the rows of rooms: offices, labs, classrooms
_STAIRS_SHARE = 0.6  # of the dead ends of corridors that are not left open
_DEEP_M, _DIVIDED_SHARE = 8.0, 0.3  # so many of the rooms deeper than that are divided
_LEAST_SUITE_M = 5.6  # depth from which on a suite fits
_FRONT = (0.42, 0.6)  # share of a divided room's depth that lies at the corridor
_LONG_M, _SECOND_SHARE = 8.0, 0.5  # so many of the rooms longer than that have a second door
_LOBBY_OPEN = (0.7, 1.0)  # share of a lobby's wall that is open to the corridor
_CORNER_M = 0.2  # least distance of a door from the corner of a room, beside half a wall
_SAME_M = 1e-6  # walls this close are one
_CORRIDOR = -1


class Place(NamedTuple):
    """A room: its box between the middles of walls, and its label."""

    box: Box
    label: str


class Gap(NamedTuple):
    """An opening in a wall.

    x, y: its middle [m]. width: clear [m]. upright: whether the wall runs along y. leaf: whether a door hangs in it.
    """

    x: float
    y: float
    width: float
    upright: bool
    leaf: bool


class DoorSizes(NamedTuple):
    """Clear widths [m] and frequencies of doors on one floor, see CampusShape, and the thickness of its walls [m]."""

    single: tuple[float, float]
    double: tuple[float, float]
    double_share: float
    link_share: float
    back_share: float
    wall: float


def furnish_rows(
    halls: Sequence[Hall],
    rows: Sequence[Row],
    caps: Sequence[tuple[int, Box]],
    doors: DoorSizes,
    rng: np.random.Generator,
) -> tuple[list[Place], list[Gap]]:
    """Return all rooms but the corridors, and all doors; ``rng`` is consumed.

    Every room has a door to a corridor, or to a room that has one; some have more.
    """
    floor = _Floor([hall.box for hall in halls], doors, rng)
    for hall, box in caps:
        floor.add(box, "STAIRS" if rng.random() < _STAIRS_SHARE else "OFFICE", _CORRIDOR - hall)
    for row in rows:
        program = _PROGRAMS[rng.choice(len(_PROGRAMS), p=_PROGRAM_SHARES)]
        for label, start, stop in _cut(row, program, rng):
            if label != SHAFT:
                _furnish(floor, row, label, start, stop)
    _add_doors(floor)
    return floor.places, floor.gaps


class _Floor:
    """A floor while it fills up. A corridor is named by _CORRIDOR minus its place, a room by its place."""

    def __init__(self, halls: Sequence[Box], doors: DoorSizes, rng: np.random.Generator) -> None:
        self.halls = halls
        self.doors = doors
        self.rng = rng
        self.places: list[Place] = []
        self.gaps: list[Gap] = []
        self.joined: set[tuple[int, int]] = set()

    def add(self, box: Box, label: str, beside: int) -> bool:
        """Add a room with a door to ``beside``; do nothing and return False where no door fits."""
        self.places.append(Place(box, label))
        if self.join(len(self.places) - 1, beside):
            return True
        self.places.pop()
        return False

    def join(self, place: int, other: int, *, plain: bool = False) -> bool:
        """Cut a door between a room and a room or corridor, clear of all others; return whether one fits."""
        box = self.places[other].box if other >= 0 else self.halls[_CORRIDOR - other]
        gap = _draw_gap(self.places[place].box, box, "" if plain else self.places[place].label, self.doors, self.rng)
        if gap is None or any(_crowds(gap, there) for there in self.gaps):
            return False
        self.gaps.append(gap)
        self.joined.add((place, other))
        return True


def _cut(row: Row, program: Choices, rng: np.random.Generator) -> list[tuple[str, float, float]]:
    """Cut a row into (label, start, stop); the outermost rooms take in what lies beyond the end of the corridor."""
    room = row.last - row.first
    names, shares = list(program), np.array(list(program.values()))
    labels: list[str] = []
    widths: list[float] = []
    while sum(widths) < room:
        labels.append(names[rng.choice(len(names), p=shares / shares.sum())])
        widths.append(float(rng.uniform(*_WIDTHS[labels[-1]])))
    if len(widths) > 1 and sum(widths) - room > widths[-1] / 2:
        labels.pop()
        widths.pop()
    edges = np.round(row.first + np.concatenate([[0.0], np.cumsum(widths)]) * room / sum(widths), 2)
    edges[0], edges[-1] = row.start, row.stop
    return list(zip(labels, edges[:-1].tolist(), edges[1:].tolist(), strict=True))


def _furnish(floor: _Floor, row: Row, label: str, start: float, stop: float) -> None:
    """Add one room, or a room with others behind it, from ``start`` to ``stop`` along the row."""
    rng, hall = floor.rng, _CORRIDOR - row.hall
    depth, sign = abs(row.far - row.near), 1 if row.far > row.near else -1

    def part(first: float, last: float, front: float, back: float) -> Box:
        low, high = sorted((row.near + sign * front, row.near + sign * back))
        return oriented(row.axis, first, last, low, high)

    if label in _MOST_DEPTH:
        depth = min(depth, float(rng.uniform(*_MOST_DEPTH[label])))
    divided = label == SUITE or (label in _DIVISIBLE and depth > _DEEP_M and rng.random() < _DIVIDED_SHARE)
    label = "OFFICE" if label == SUITE else label
    if not divided or depth < _LEAST_SUITE_M:
        floor.add(part(start, stop, 0.0, depth), label, hall)
        return
    front, parent = depth * float(rng.uniform(*_FRONT)), len(floor.places)
    if floor.add(part(start, stop, 0.0, front), label, hall):
        count = max(1, round((stop - start) / float(rng.uniform(*_WIDTHS["OFFICE"]))))
        for first, last in pairwise(np.linspace(start, stop, count + 1).tolist()):
            floor.add(part(first, last, front, depth), "OFFICE", parent)


def _add_doors(floor: _Floor) -> None:
    """Add doors between neighbours that have none, and second doors of long rooms."""
    rng, doors = floor.rng, floor.doors
    for place, (box, label) in enumerate(floor.places):
        if label in _PRIVATE:
            continue
        for other in range(place):
            apart = floor.places[other].label not in _PRIVATE and (place, other) not in floor.joined
            if apart and rng.random() < doors.link_share:
                floor.join(place, other, plain=True)
        longer = max(box.max_x - box.min_x, box.max_y - box.min_y)
        for hall in range(len(floor.halls)):
            joined = (place, _CORRIDOR - hall) in floor.joined
            share = _SECOND_SHARE * (longer > _LONG_M) if joined else doors.back_share
            if rng.random() < share:
                floor.join(place, _CORRIDOR - hall)


def _draw_gap(box: Box, other: Box, label: str, doors: DoorSizes, rng: np.random.Generator) -> Gap | None:
    """Return an opening in the wall between two boxes, None where they share too little of it."""
    wall = _shared_wall(box, other)
    if wall is None:
        return None
    upright, line, start, stop = wall
    margin = doors.wall / 2 + _CORNER_M
    room = stop - start - 2 * margin
    if label == LOBBY:
        width = room * float(rng.uniform(*_LOBBY_OPEN))
    else:
        wide = label in _GRAND and rng.random() < doors.double_share and room > doors.double[1]
        width = round(float(rng.uniform(*(doors.double if wide else doors.single))), 2)
    if not doors.single[0] <= width <= room:
        return None
    along = start + margin + width / 2 + float(rng.random()) * (room - width)
    leaf = label != LOBBY
    return Gap(line, along, width, True, leaf) if upright else Gap(along, line, width, False, leaf)


def _crowds(gap: Gap, other: Gap) -> bool:
    """Return whether two openings in one wall overlap, or leave hardly any wall between them."""
    across, along = abs(gap.x - other.x), abs(gap.y - other.y)
    if not gap.upright:
        across, along = along, across
    return gap.upright == other.upright and across < _SAME_M and along < (gap.width + other.width) / 2 + _CORNER_M


def _shared_wall(a: Box, b: Box) -> tuple[bool, float, float, float] | None:
    """Return whether the shared wall runs along y, where it stands, and from where to where [m]; None without one."""
    low_x, high_x = max(a.min_x, b.min_x), min(a.max_x, b.max_x)
    low_y, high_y = max(a.min_y, b.min_y), min(a.max_y, b.max_y)
    if abs(high_x - low_x) < _SAME_M < high_y - low_y:
        return True, low_x, low_y, high_y
    if abs(high_y - low_y) < _SAME_M < high_x - low_x:
        return False, low_y, low_x, high_x
    return None
