"""What a floor is like in numbers: sizes of rooms, widths of doors and corridors, and how the rooms hang together.

Every plan is looked at as regions on cells of 0.1 m: the outlines of a drawn plan, the layer "semantics" or "rooms" of
a grid. Two regions are neighbours when a door lies between them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, find_objects, label, maximum_filter

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Door, FloorPlan, GridPlan, Layer, bounds_of

ROOM, CORRIDOR, SERVICE = "room", "corridor", "service"
CORRIDOR_LABELS = frozenset({"CORRIDOR", "HALL", "HALLWAY", "LOBBY", "ENTRANCE", "RECEPTION"})
SERVICE_LABELS = frozenset({"STAIRS", "ELEVATOR", "TOILET", "WASHROOM", "BATHROOM"})

_CELL_M = 0.1
_MOST_CELLS = 36_000_000
_LEAST_M2 = 1.0  # smaller patches are splinters of a drawing
_REACH_M = 0.5  # a door belongs to regions this close to its middle: half a thick wall and a little
_DOORS_OF_A_CORRIDOR = 4  # where nothing is named, a region with so many neighbours counts as a corridor

Regions = NDArray[np.int32]  # [rows, cols]: 0 is none, k the k-th region


@dataclass(frozen=True, kw_only=True)
class FloorStatistics:
    """One floor in numbers. A tuple holds one value for each room, door or piece of corridor.

    long_side_m, short_side_m: extent of the plan [m]. floor_m2: all rooms and corridors. room_m2: size of each room.
    corridor_share: area of corridors, halls and lobbies over ``floor_m2``. common_share: stairs and toilets counted as
    well, which is all that some sources tell. corridor_m: width of the corridors, one value for each decimetre or so
    along their middle. door_m: width of each door. neighbours: other regions a door away, for each room.
    dead_end_share: rooms with one neighbour over rooms with any. loops: ways round, that is doors too many for a tree.
    """

    long_side_m: float
    short_side_m: float
    floor_m2: float
    room_m2: tuple[float, ...]
    corridor_share: float
    common_share: float
    corridor_m: tuple[float, ...]
    door_m: tuple[float, ...]
    neighbours: tuple[int, ...]
    dead_end_share: float
    loops: int


class _Marked(NamedTuple):
    """The regions of a floor, the kind of each (place 0 is region 1), and the side of a cell [m]."""

    regions: Regions
    kinds: list[str]
    cell_m: float


def floor_statistics(plan: FloorPlan | GridPlan) -> FloorStatistics:
    """Measure one floor.

    Raises:
        PlanError: the plan has neither outlined rooms nor a layer "semantics" or "rooms".
    """
    marked = _from_outlines(plan) if isinstance(plan, FloorPlan) else _from_layers(plan)
    links = _links(marked, plan)
    degree = np.bincount([region for link in links for region in link], minlength=len(marked.kinds) + 1)[1:]
    kinds = np.array(marked.kinds or [""])
    if not (kinds == CORRIDOR).any():
        kinds = np.where(degree >= _DOORS_OF_A_CORRIDOR, CORRIDOR, kinds)
    area = np.bincount(marked.regions.ravel(), minlength=len(kinds) + 1)[1:] * marked.cell_m**2
    is_room, joined = kinds == ROOM, degree > 0
    bounds = bounds_of(plan)
    sides = sorted((bounds.max_x - bounds.min_x, bounds.max_y - bounds.min_y))
    total = float(area.sum())
    return FloorStatistics(
        long_side_m=sides[1],
        short_side_m=sides[0],
        floor_m2=total,
        room_m2=tuple(area[is_room].tolist()),
        corridor_share=float(area[kinds == CORRIDOR].sum() / total) if total else 0.0,
        common_share=float(area[~is_room].sum() / total) if total else 0.0,
        corridor_m=_widths(marked, kinds),
        door_m=tuple(door.width for door in plan.doors if door.leaf),
        neighbours=tuple(degree[is_room & joined].tolist()),
        dead_end_share=float((degree[is_room & joined] == 1).mean()) if (is_room & joined).any() else float("nan"),
        loops=_loops(links),
    )


def compare(sources: Mapping[str, Sequence[FloorStatistics]]) -> str:
    """Return a table in Markdown: lower quartile, median and upper quartile of each statistic, a column per source.

    Rooms, doors and pieces of corridor of all floors of a source are pooled; a dash means that a source lacks them.
    """
    rows = [
        ("floors", None),
        ("longer side [m]", "long_side_m"),
        ("shorter side [m]", "short_side_m"),
        ("floor area [m2]", "floor_m2"),
        ("room size [m2]", "room_m2"),
        ("corridors, share of the floor", "corridor_share"),
        ("the same with stairs, toilets", "common_share"),
        ("corridor width [m]", "corridor_m"),
        ("door width [m]", "door_m"),
        ("neighbours of a room, mean", "neighbours"),
        ("rooms with one neighbour, share", "dead_end_share"),
        ("loops", "loops"),
    ]
    lines = ["| statistic | " + " | ".join(sources) + " |", "|---" * (len(sources) + 1) + "|"]
    for title, name in rows:
        cells = [str(len(found)) if name is None else _quartiles(name, found) for found in sources.values()]
        lines.append(f"| {title} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _quartiles(name: str, found: Sequence[FloorStatistics]) -> str:
    values = [getattr(floor, name) for floor in found]
    if name == "neighbours":
        values = [float(np.mean(of_floor)) for of_floor in values if of_floor]
    pooled = np.array([x for value in values for x in (value if isinstance(value, tuple) else (value,))], dtype=float)
    pooled = pooled[np.isfinite(pooled)]
    if not pooled.size:
        return "-"
    low, middle, high = np.percentile(pooled, [25, 50, 75])
    return f"{low:.3g} / **{middle:.3g}** / {high:.3g}"


def _from_outlines(plan: FloorPlan) -> _Marked:
    low_x, low_y, high_x, high_y = plan.bounds
    rows, cols = (int(np.ceil(side / _CELL_M)) + 1 for side in (high_y - low_y, high_x - low_x))
    if rows * cols > _MOST_CELLS:
        raise PlanError(f"plan {plan.plan_id}: {rows} x {cols} decimetres are too many to measure. Cut the plan.")
    regions = np.zeros((rows, cols), dtype=np.int32)
    kinds = []
    for room in plan.rooms:
        min_x, min_y, max_x, max_y = room.outline.bounds
        col, row = max(0, int((min_x - low_x) / _CELL_M)), max(0, int((min_y - low_y) / _CELL_M))
        window = regions[row : int((max_y - low_y) / _CELL_M) + 1, col : int((max_x - low_x) / _CELL_M) + 1]
        x = low_x + (np.arange(col, col + window.shape[1]) + 0.5) * _CELL_M
        y = low_y + (np.arange(row, row + window.shape[0]) + 0.5) * _CELL_M
        shapely.prepare(room.outline)
        inside = shapely.contains_xy(room.outline, *np.meshgrid(x, y)) & (window == 0)
        kinds.append(_kind(room.label))
        window[inside] = len(kinds)
    if not kinds:
        raise PlanError(f"plan {plan.plan_id}: no room is outlined, so there is nothing to measure.")
    return _Marked(regions, kinds, _CELL_M)


def _from_layers(plan: GridPlan) -> _Marked:
    if "semantics" in plan.layers:
        return _from_semantics(plan.layers["semantics"], plan.resolution)
    if "rooms" in plan.layers:
        values = plan.layers["rooms"].values.astype(np.int32)
        labels = plan.layers["rooms"].labels
        return _Marked(values, [_kind(labels.get(k, "")) for k in range(1, int(values.max()) + 1)], plan.resolution)
    raise PlanError(f"plan {plan.plan_id}: no layer says which cells are rooms, so there is nothing to measure.")


def _from_semantics(layer: Layer, cell_m: float) -> _Marked:
    """Take the connected patches of hallway, and those of room with the furniture in them."""
    known = {name.lower(): value for value, name in layer.labels.items()}
    regions = np.zeros(layer.values.shape, dtype=np.int32)
    kinds: list[str] = []
    for kind, names in ((CORRIDOR, ("hallway",)), (ROOM, ("room", "clutter"))):
        wanted = [known[name] for name in names if name in known]
        patches, _ = label(np.isin(layer.values, wanted))
        sizes = np.bincount(patches.ravel()) * cell_m**2
        for number, window in enumerate(find_objects(patches), start=1):
            if sizes[number] >= _LEAST_M2:
                kinds.append(kind)
                regions[window][patches[window] == number] = len(kinds)
    return _Marked(regions, kinds, cell_m)


def _kind(name: str) -> str:
    upper = name.upper()
    return CORRIDOR if upper in CORRIDOR_LABELS else SERVICE if upper in SERVICE_LABELS else ROOM


def _links(marked: _Marked, plan: FloorPlan | GridPlan) -> set[tuple[int, int]]:
    """Return the pairs of regions with a door between them."""
    low_x, low_y = bounds_of(plan)[:2]
    links = set()
    for door in plan.doors:
        sides = _sides(marked, door, low_x, low_y)
        if len(sides) == 2:
            links.add((min(sides), max(sides)))
    return links


def _sides(marked: _Marked, door: Door, low_x: float, low_y: float) -> list[int]:
    """Return the two regions nearest to the middle of ``door``, or fewer where there are no two near it."""
    col, row = (door.x - low_x) / marked.cell_m - 0.5, (door.y - low_y) / marked.cell_m - 0.5
    reach = _REACH_M / marked.cell_m
    first_row, first_col = max(0, int(row - reach)), max(0, int(col - reach))
    window = marked.regions[first_row : int(row + reach) + 2, first_col : int(col + reach) + 2]
    rows, cols = np.nonzero(window)
    off = np.hypot(rows + first_row - row, cols + first_col - col)
    near: dict[int, float] = {}
    for region, distance in zip(window[rows, cols].tolist(), off.tolist(), strict=True):
        near[region] = min(distance, near.get(region, np.inf))
    return sorted(near, key=lambda region: near[region])[:2]


def _loops(links: set[tuple[int, int]]) -> int:
    """Return links - regions + parts of the graph: 0 for a tree."""
    parent: dict[int, int] = {}

    def root(region: int) -> int:
        while parent.setdefault(region, region) != region:
            region = parent[region]
        return region

    extra = 0
    for a, b in sorted(links):
        extra += root(a) == root(b)
        parent[root(a)] = root(b)
    return extra


def _widths(marked: _Marked, kinds: NDArray[np.str_]) -> tuple[float, ...]:
    """Return the width of the corridors at each cell of their middle line [m]."""
    inside = np.concatenate([[False], kinds == CORRIDOR])[marked.regions]
    clearance = distance_transform_edt(np.pad(inside, 1))
    ridge = (clearance > 1) & (clearance >= maximum_filter(clearance, size=3))
    return tuple(((2 * clearance[ridge] - 0.5) * marked.cell_m).round(3).tolist())
