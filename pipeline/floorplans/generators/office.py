"""Office-like floors: long hallways with small offices, and in each a desk that hides part of it from its door.

Source: Stein, Bradley, Roy, "Learning over Subgoals for Efficient Navigation of Structured, Unknown
Environments", CoRL 2018 (one long hallway); several crossing hallways are the harder variant.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.generators.demand import demand
from pipeline.floorplans.plan import Bounds, Door, FloorPlan, Location, Room

ENVIRONMENT = "office"

_MOST_DRAWS = 1000  # starts and goals drawn before giving up on two that are far apart
_CLEAR_M = 0.75  # start and goal keep this much from walls and desks
_JAMB_M = 0.3  # least wall between a door and the corner of its room


@dataclass(frozen=True, kw_only=True)
class OfficeShape:
    """Size of an office floor and of what is in it.

    hallways: 1 for one long hallway along x; of more, every second one runs along y and crosses the others.
    length_m: of the hallways along x; breadth_m: of those along y, where there are any [m]. hallway_m: their width [m].
    min_room_m, max_room_m: width of an office along its hallway [m]. min_depth_m, max_depth_m: its other side; all
    offices in a row have the same [m]. door_m: width of a door [m]. wall_m: thickness of every wall [m].
    min_desk_m, max_desk_m: length of the desk, parallel to the wall with the door; desk_depth_m: its other side
    [m]. aisle_m: what is free in front of a desk, behind it, and on one side of it at least [m].
    min_distance_m: least distance in a straight line between the start, anywhere, and the goal, in an office [m].
    """

    hallways: int = 1
    length_m: float = 60.0
    breadth_m: float = 60.0
    hallway_m: float = 2.7
    min_room_m: float = 3.9
    max_room_m: float = 6.0
    min_depth_m: float = 4.5
    max_depth_m: float = 6.6
    door_m: float = 1.2
    wall_m: float = 0.3
    min_desk_m: float = 1.5
    max_desk_m: float = 2.4
    desk_depth_m: float = 0.9
    aisle_m: float = 1.5
    min_distance_m: float = 35.0

    def __post_init__(self) -> None:
        """Refuse impossible values; the ConfigError names the key."""
        _demand("hallways", self.hallways, 1 <= self.hallways <= 20, "from 1 to 20")
        _demand("wall_m", self.wall_m, self.wall_m > 0, "above 0 m")
        _demand("door_m", self.door_m, self.door_m > 0, "above 0 m")
        _demand("aisle_m", self.aisle_m, self.aisle_m >= 2 * _CLEAR_M, f"at least {2 * _CLEAR_M:g} m")
        _demand("min_desk_m", self.min_desk_m, self.min_desk_m > 0, "above 0 m")
        _demand("desk_depth_m", self.desk_depth_m, self.desk_depth_m > 0, "above 0 m")
        _demand("hallway_m", self.hallway_m, self.hallway_m >= self.aisle_m, f"at least aisle_m = {self.aisle_m:g} m")
        least = max(self.max_desk_m + self.aisle_m, self.door_m + 2 * _JAMB_M)
        _demand("min_room_m", self.min_room_m, self.min_room_m >= least, f"at least {least:g} m, or a desk blocks it")
        deep = 2 * self.aisle_m + self.desk_depth_m
        _demand("min_depth_m", self.min_depth_m, self.min_depth_m >= deep, f"at least {deep:g} m, desk and aisles")
        for name in ("desk", "room", "depth"):
            low, high = (getattr(self, f"{end}_{name}_m") for end in ("min", "max"))
            _demand(f"max_{name}_m", high, high >= low, f"at least min_{name}_m = {low:g} m")
        most_room = 2 * self.wall_m + self.max_room_m
        _demand("length_m", self.length_m, most_room <= self.length_m <= 2000, f"from {most_room:g} to 2000 m")
        if self.along_y:
            for name, side, count in (
                ("length_m", self.length_m, self.along_y),
                ("breadth_m", self.breadth_m, self.along_x),
            ):
                least = count * (self.hallway_m + 2 * self.row_m) + 2 * self.wall_m
                _demand(
                    name, side, least <= side <= 2000, f"from {least:g} m, a row of offices on both sides, to 2000 m"
                )
        fits = 0 <= self.min_distance_m < 0.9 * self.length_m
        _demand("min_distance_m", self.min_distance_m, fits, f"less than {0.9 * self.length_m:g} m, 0.9 of length_m")

    @property
    def along_x(self) -> int:
        """Number of hallways along x."""
        return (self.hallways + 1) // 2

    @property
    def along_y(self) -> int:
        """Number of hallways along y."""
        return self.hallways // 2

    @property
    def row_m(self) -> float:
        """Room for one row of offices between a hallway and what lies behind [m]."""
        return self.max_depth_m + 2 * self.wall_m


class Row(NamedTuple):
    """Where offices stand side by side along a hallway.

    x, y: the end at the hallway's edge from which the offices are counted [m]. along, away: unit vectors along the
    hallway and away from it. length: of the row, the walls at both ends included [m].
    """

    x: float
    y: float
    along: tuple[int, int]
    away: tuple[int, int]
    length: float

    def box(self, along: tuple[float, float], away: tuple[float, float]) -> Polygon:
        """Return the box between two distances along the hallway and two away from its edge [m]."""
        x, y = zip(*(self.at(u, v) for u, v in zip(along, away, strict=True)), strict=True)
        return shapely.box(min(x), min(y), max(x), max(y))

    def at(self, along: float, away: float) -> Location:
        """Return the point at these distances along the hallway and away from its edge [m]."""
        return Location(
            self.x + along * self.along[0] + away * self.away[0], self.y + along * self.along[1] + away * self.away[1]
        )


class Side(NamedTuple):
    """From where to where a block reaches along one axis [m], and whether a hallway bounds it at either end."""

    low: float
    high: float
    hall_below: bool
    hall_above: bool


class Office(NamedTuple):
    """One office: its outline, the opening through the wall, the door in it, and the desk."""

    outline: Polygon
    opening: Polygon
    door: Door
    desk: Polygon


def draw_office(shape: OfficeShape, rng: np.random.Generator, *, plan_id: str, split: str | None = None) -> FloorPlan:
    """Draw one floor; ``rng`` is consumed. A robot narrower than door and aisle reaches every office.

    Raises:
        PlanError: no start and goal as far apart as asked were found.
    """
    bounds = _extent(shape)
    hallways, rows = draw_hallways(shape, bounds, rng)
    offices = [office for row in rows for office in draw_offices(row, shape, rng)]
    floor = shapely.union_all([*hallways, *(part for office in offices for part in (office.outline, office.opening))])
    free = floor.difference(shapely.union_all([office.desk for office in offices]))
    return FloorPlan(
        plan_id=plan_id,
        building=plan_id,
        floor=plan_id,
        environment=ENVIRONMENT,
        source="generator office",
        split=split,
        doors=tuple(office.door for office in offices),
        endpoints=_draw_ends(shape, hallways, offices, rng, plan_id),
        free=free,
        bounds=bounds,
        rooms=tuple(
            [Room(outline, "hallway") for outline in hallways] + [Room(office.outline, "office") for office in offices]
        ),
    )


def draw_hallways(shape: OfficeShape, bounds: Bounds, rng: np.random.Generator) -> tuple[list[Polygon], list[Row]]:
    """Draw the hallways across ``bounds``, and return them with the rows of offices in the blocks between them."""
    inner = shapely.box(*bounds).buffer(-shape.wall_m, join_style="mitre").bounds
    bands_y = _bands(inner[1], inner[3], shape.along_x, shape, rng)
    bands_x = _bands(inner[0], inner[2], shape.along_y, shape, rng)
    hallways = [shapely.box(inner[0], low, inner[2], high) for low, high in bands_y]
    hallways += [shapely.box(low, inner[1], high, inner[3]) for low, high in bands_x]
    blocks_x, blocks_y = _between(bands_x, bounds.min_x, bounds.max_x), _between(bands_y, bounds.min_y, bounds.max_y)
    return hallways, [row for y in blocks_y for x in blocks_x for row in _rows_in(x, y, shape)]


def draw_offices(row: Row, shape: OfficeShape, rng: np.random.Generator) -> Iterator[Office]:
    """Draw offices side by side; they share what is left over of the row, so that some are wider than asked."""
    depth = rng.uniform(shape.min_depth_m, shape.max_depth_m)
    wall, begin = shape.wall_m, shape.wall_m
    for width in _draw_widths(row.length - wall, shape, rng):
        door = begin + rng.uniform(_JAMB_M, width - shape.door_m - _JAMB_M) + shape.door_m / 2
        low, high = _desk_span(door - begin, width, shape, rng)
        front = wall + rng.uniform(shape.aisle_m, depth - shape.aisle_m - shape.desk_depth_m)
        half = shape.door_m / 2
        yield Office(
            outline=row.box((begin, begin + width), (wall, wall + depth)),
            opening=row.box((door - half, door + half), (0.0, wall)),
            door=Door(*row.at(door, wall / 2), shape.door_m),
            desk=row.box((begin + low, begin + high), (front, front + shape.desk_depth_m)),
        )
        begin += width + wall


def _draw_widths(length: float, shape: OfficeShape, rng: np.random.Generator) -> list[float]:
    """Draw the widths of offices that fill ``length``, each with a wall at its end [m]."""
    widths: list[float] = []
    while (left := length - sum(widths) - shape.wall_m * (len(widths) + 1)) >= shape.min_room_m:
        widths.append(min(rng.uniform(shape.min_room_m, shape.max_room_m), left))
    spare = length - sum(widths) - shape.wall_m * len(widths)
    return [width + spare / len(widths) for width in widths]


def _desk_span(door: float, width: float, shape: OfficeShape, rng: np.random.Generator) -> tuple[float, float]:
    """Draw where a desk in front of the door begins and ends; a side too narrow to pass is closed altogether."""
    length = rng.uniform(shape.min_desk_m, shape.max_desk_m)
    low = float(np.clip(door - length * rng.uniform(0.3, 0.7), 0.0, width - length))
    left, right = low, width - length - low
    if left < shape.aisle_m and left <= right:
        low = 0.0
    elif right < shape.aisle_m:
        low = width - length
    return low, low + length


def _extent(shape: OfficeShape) -> Bounds:
    single = shape.hallway_m + 2 * shape.row_m
    return Bounds(0.0, 0.0, shape.length_m, shape.breadth_m if shape.along_y else single)


def _bands(
    low: float, high: float, count: int, shape: OfficeShape, rng: np.random.Generator
) -> list[tuple[float, float]]:
    """Place ``count`` hallways between two ends, one in each of as many equal parts, off its middle by up to a fifth.

    A row of offices fits on both sides of each.
    """
    part, half = (high - low) / max(count, 1), shape.hallway_m / 2
    slack = float(np.clip(part / 2 - half - shape.row_m + shape.wall_m / 2, 0.0, 0.2 * part))
    middles = [low + (k + 0.5) * part + rng.uniform(-slack, slack) for k in range(count)]
    return [(middle - half, middle + half) for middle in middles]


def _between(bands: list[tuple[float, float]], low: float, high: float) -> list[Side]:
    """Return the stretches that ``bands`` leave between ``low`` and ``high``."""
    ends = [low, *(end for band in bands for end in band), high]
    return [Side(a, b, k > 0, k < len(bands)) for k, (a, b) in enumerate(zip(ends[::2], ends[1::2], strict=True))]


def _rows_in(x: Side, y: Side, shape: OfficeShape) -> list[Row]:
    """Return the rows of one block. Those along x take its corners; those along y what is left between them."""
    rows = []
    if y.hall_below:
        rows.append(Row(x.low, y.low, (1, 0), (0, 1), x.high - x.low))
    if y.hall_above:
        rows.append(Row(x.low, y.high, (1, 0), (0, -1), x.high - x.low))
    low, high = y.low + shape.row_m * y.hall_below, y.high - shape.row_m * y.hall_above
    if x.hall_below:
        rows.append(Row(x.low, low, (0, 1), (1, 0), high - low))
    if x.hall_above:
        rows.append(Row(x.high, low, (0, 1), (-1, 0), high - low))
    return rows


def _draw_ends(
    shape: OfficeShape, hallways: list[Polygon], offices: list[Office], rng: np.random.Generator, plan_id: str
) -> tuple[Location, Location]:
    """Draw a start anywhere on the floor and a goal in an office, both clear of walls and desks."""
    rooms = [_clear(office.outline).difference(office.desk.buffer(_CLEAR_M)) for office in offices]
    places = [_clear(hallway) for hallway in hallways] + rooms
    areas = shapely.area(places)
    for _ in range(_MOST_DRAWS):
        start = _draw_point(places[rng.choice(len(places), p=areas / areas.sum())], rng)
        goal = _draw_point(rooms[rng.integers(len(rooms))], rng)
        if np.hypot(goal.x - start.x, goal.y - start.y) >= shape.min_distance_m:
            return start, goal
    raise PlanError(
        f"plan {plan_id} (generator office): no start and goal {shape.min_distance_m:g} m apart in {_MOST_DRAWS} "
        "draws. Lower plans.office.min_distance_m."
    )


def _clear(outline: Polygon) -> Polygon:
    return outline.buffer(-_CLEAR_M, join_style="mitre")


def _draw_point(area: Polygon | MultiPolygon, rng: np.random.Generator) -> Location:
    """Draw a point of ``area``, all equally likely; where it fills hardly any of its box, one that is surely in it."""
    low_x, low_y, high_x, high_y = area.bounds
    for _ in range(_MOST_DRAWS):
        point = rng.uniform((low_x, low_y), (high_x, high_y))
        if shapely.contains_xy(area, *point):
            return Location(*point.tolist())
    sure = shapely.point_on_surface(area)
    return Location(sure.x, sure.y)


def _demand(key: str, value: float, holds: bool, allowed: str) -> None:
    demand(f"office.{key}", value, holds, allowed)
