"""Campus: floors of a university, with offices, labs and classrooms along corridors that branch and close loops.

The defaults are set so that the statistics lie among those of real floors of MIT, KTH, schools and offices
(docs/campus-statistics.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from pipeline.errors import ConfigError
from pipeline.floorplans.generators.campus_layout import LAYOUTS, Sizes, find_caps, lay_halls, lay_rows
from pipeline.floorplans.generators.campus_rooms import DoorSizes, Gap, furnish_rows
from pipeline.floorplans.generators.demand import demand
from pipeline.floorplans.plan import Bounds, Door, FloorPlan, Room

ENVIRONMENT = "campus"
ANY = "any"

_MARGIN_M = 0.6  # of solid wall around the floor
_CUT_M = 0.01  # a door reaches this far into the floor on both sides, so that the union is one piece
_CAP_SHARE = 0.7  # of the dead ends of corridors that end in stairs or a room
_END_M = (2.5, 5.0)  # how far rows of rooms reach beyond the end of a corridor


@dataclass(frozen=True, kw_only=True)
class CampusShape:
    """What campus floors are drawn from; a pair low, high is drawn from uniformly, once for each floor or each thing.

    layout: slab, ell, u, ring, comb, aitch, or any: one of them for each floor. length_low_m .. width_high_m: extent of
    the corridors [m]. corridor_low_m, corridor_high_m: their width between walls [m]. depth_low_m, depth_high_m: depth
    of a row of rooms [m]. wall_low_m, wall_high_m: thickness of walls [m]. door_low_m, door_high_m: clear width of a
    door [m]; double_low_m, double_high_m: of a double door. double_share: of the doors of large rooms that are double.
    link_share: of the walls between neighbouring rooms that have a door. back_share: the same between rooms and a
    corridor behind or beside them.
    """

    layout: str = ANY
    length_low_m: float = 36.0
    length_high_m: float = 76.0
    width_low_m: float = 18.0
    width_high_m: float = 42.0
    corridor_low_m: float = 2.0
    corridor_high_m: float = 4.2
    depth_low_m: float = 5.0
    depth_high_m: float = 10.5
    wall_low_m: float = 0.1
    wall_high_m: float = 0.3
    door_low_m: float = 0.9
    door_high_m: float = 1.25
    double_low_m: float = 1.5
    double_high_m: float = 1.8
    double_share: float = 0.35
    link_share: float = 0.15
    back_share: float = 0.3

    def __post_init__(self) -> None:
        """Refuse impossible values; the ConfigError names the key."""
        layouts = (*LAYOUTS, ANY)
        if self.layout not in layouts:
            raise ConfigError(f"plans.campus.layout = {self.layout}: expected one of {', '.join(layouts)}.")
        across = self.corridor_high_m + self.wall_high_m
        for name, least, most in (
            ("corridor", 1.2, 5.0),
            ("wall", 0.05, 0.6),
            ("length", max(12.0, 6 * across), 500.0),
            ("width", 4 * across, 500.0),
            ("depth", 3.0, 30.0),
            ("door", 0.7, 1.4),
            ("double", 0.7, 3.0),
        ):
            low, high = (getattr(self, f"{name}_{end}_m") for end in ("low", "high"))
            _demand(f"{name}_low_m", low, least <= low <= most, f"from {least:g} to {most:g} m")
            _demand(f"{name}_high_m", high, low <= high <= most, f"from {name}_low_m = {low:g} to {most:g} m")
        for name in ("double_share", "link_share", "back_share"):
            _demand(name, getattr(self, name), 0 <= getattr(self, name) <= 1, "a share from 0 to 1")


def draw_campus(shape: CampusShape, rng: np.random.Generator, *, plan_id: str, split: str | None = None) -> FloorPlan:
    """Draw one floor, a building of its own; ``rng`` is consumed. A robot narrower than a door reaches every room."""
    wall = float(rng.uniform(shape.wall_low_m, shape.wall_high_m))
    layout = shape.layout if shape.layout != ANY else str(rng.choice(LAYOUTS))
    sizes = Sizes(
        length=float(rng.uniform(shape.length_low_m, shape.length_high_m)),
        width=float(rng.uniform(shape.width_low_m, shape.width_high_m)),
        corridor=float(rng.uniform(shape.corridor_low_m, shape.corridor_high_m)) + wall,
        depth=lambda: float(rng.uniform(shape.depth_low_m, shape.depth_high_m)),
        end=float(rng.uniform(*_END_M)),
    )
    doors = DoorSizes(
        single=(shape.door_low_m, shape.door_high_m),
        double=(shape.double_low_m, shape.double_high_m),
        double_share=shape.double_share,
        link_share=shape.link_share,
        back_share=shape.back_share,
        wall=wall,
    )
    halls = lay_halls(layout, sizes, rng)
    caps = [cap for cap in find_caps(halls) if rng.random() < _CAP_SHARE]
    rows = lay_rows(halls, [box for _, box in caps])
    places, gaps = furnish_rows(halls, rows, caps, doors, rng)
    corridors = shapely.union_all([shapely.box(*hall.box) for hall in halls])
    rooms = [
        Room(outline.buffer(-wall / 2, join_style="mitre"), label)
        for outline, label in [(corridors, "CORRIDOR"), *((shapely.box(*place.box), place.label) for place in places)]
    ]
    free = shapely.union_all([*(room.outline for room in rooms), *_openings(gaps, wall)])
    min_x, min_y, max_x, max_y = free.bounds
    return FloorPlan(
        plan_id=plan_id,
        building=plan_id,
        floor=plan_id,
        environment=ENVIRONMENT,
        source="generator campus",
        split=split,
        doors=tuple(Door(gap.x, gap.y, gap.width, gap.leaf) for gap in gaps),
        free=free,
        bounds=Bounds(min_x - _MARGIN_M, min_y - _MARGIN_M, max_x + _MARGIN_M, max_y + _MARGIN_M),
        rooms=tuple(rooms),
    )


def _openings(gaps: Sequence[Gap], wall: float) -> NDArray[np.object_]:
    """Return the floor of each opening: as wide as the door, and a little deeper than the wall."""
    upright = np.array([gap.upright for gap in gaps], dtype=bool)
    middle = np.array([(gap.x, gap.y) for gap in gaps]).reshape(-1, 2)
    along, across = np.array([gap.width for gap in gaps]) / 2, wall / 2 + _CUT_M
    half = np.column_stack([np.where(upright, across, along), np.where(upright, along, across)])
    found: NDArray[np.object_] = shapely.box(*(middle - half).T, *(middle + half).T)
    return found


def _demand(key: str, value: float, holds: bool, allowed: str) -> None:
    demand(f"campus.{key}", value, holds, allowed)
