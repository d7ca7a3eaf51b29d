"""Clutter: furniture put at random on the free floor of any plan, so that a robot still gets everywhere.

Furniture never divides the floor: where a robot of a given width could drive before, it still drives from any place
left to any other. Doors, start and goal stay clear. What is drawn depends on a generator of random numbers of its own,
so that one plan can be had with many arrangements.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias, overload

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPolygon, Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.generators.demand import demand
from pipeline.floorplans.plan import CLUTTER, FREE, FloorPlan, GridPlan

Floor: TypeAlias = Polygon | MultiPolygon
Cells: TypeAlias = tuple[NDArray[np.intp], NDArray[np.intp]]  # rows and columns

_MOST_PIECES = 20_000
_ROUNDS, _SPARE = 12, 4  # so often, candidates are drawn: each time so many for every piece still missing
_RIM_M = 0.02  # how far around a piece the floor must hang together
_ARC = 16  # straight pieces of a quarter of a circle
_HAIR_M = 1e-6  # the robot is this much narrower, or rounding would close passages exactly as wide as it is


@dataclass(frozen=True, kw_only=True)
class ClutterShape:
    """How much furniture, of what size, and what it leaves clear.

    per_m2: pieces for a square metre of free floor; fewer where no more fit. min_length_m, max_length_m: longer side of
    a piece; min_width_m, max_width_m: its other side [m]. turned_share: of the pieces that stand at any angle; all
    others are parallel to the axes. gap_m: width of the robot that still gets everywhere [m]; where doors are narrower,
    everywhere within a room. door_clear_m: what stays free in front of a door, from either jamb on [m].
    """

    per_m2: float = 0.08
    min_length_m: float = 0.6
    max_length_m: float = 2.0
    min_width_m: float = 0.4
    max_width_m: float = 0.9
    turned_share: float = 0.3
    gap_m: float = 0.8
    door_clear_m: float = 0.8

    def __post_init__(self) -> None:
        """Refuse impossible values; the ConfigError names the key."""
        _demand("per_m2", self.per_m2, 0 <= self.per_m2 <= 2, "from 0 to 2 pieces for a square metre")
        for name in ("length", "width"):
            low, high = (getattr(self, f"{end}_{name}_m") for end in ("min", "max"))
            _demand(f"min_{name}_m", low, low >= 0.1, "at least 0.1 m")
            _demand(f"max_{name}_m", high, low <= high <= 20, f"from min_{name}_m = {low:g} to 20 m")
        _demand("turned_share", self.turned_share, 0 <= self.turned_share <= 1, "a share from 0 to 1")
        _demand("gap_m", self.gap_m, 0.05 <= self.gap_m <= 5, "from 0.05 to 5 m")
        _demand("door_clear_m", self.door_clear_m, 0 <= self.door_clear_m <= 10, "from 0 to 10 m")


class Piece(NamedTuple):
    """A piece of furniture: the floor it takes [m], and the cells, where the plan has any."""

    outline: Floor
    cells: Cells | None = None


@overload
def add_clutter(plan: FloorPlan, shape: ClutterShape, rng: np.random.Generator) -> FloorPlan: ...


@overload
def add_clutter(plan: GridPlan, shape: ClutterShape, rng: np.random.Generator) -> GridPlan: ...


def add_clutter(plan: FloorPlan | GridPlan, shape: ClutterShape, rng: np.random.Generator) -> FloorPlan | GridPlan:
    """Return the plan with furniture: less free floor, or cells that turn from FREE to CLUTTER; ``rng`` is consumed.

    Everything else stays, also the name: give the plan another one with ``replace(plan, plan_id=...)``.

    Raises:
        PlanError: the floor is so large that more than 20,000 pieces were asked for.
    """
    pieces = draw_furniture(plan, shape, rng)
    if isinstance(plan, GridPlan):
        cells = plan.cells.copy()
        for piece in pieces:
            if piece.cells is not None:
                cells[piece.cells] = CLUTTER
        return replace(plan, cells=cells)
    return replace(plan, free=plan.free.difference(shapely.union_all([piece.outline for piece in pieces])))


def draw_furniture(plan: FloorPlan | GridPlan, shape: ClutterShape, rng: np.random.Generator) -> list[Piece]:
    """Draw the pieces that `add_clutter` puts on the floor, none over another; ``rng`` is consumed.

    Raises:
        PlanError: see `add_clutter`.
    """
    free = plan.free if isinstance(plan, FloorPlan) else free_of(plan)
    count = round(shape.per_m2 * free.area)
    if count > _MOST_PIECES:
        raise PlanError(
            f"plan {plan.plan_id}: {count:,} pieces of furniture for {free.area:,.0f} m2 are too many, at most "
            f"{_MOST_PIECES:,} are drawn. Lower plans.clutter.per_m2."
        )
    space, kept_clear = _Space(free, shape.gap_m), _kept_clear(plan, shape)
    shapely.prepare([free, kept_clear])
    for _ in range(_ROUNDS):
        missing = count - len(space.pieces)
        if not missing:
            break
        rectangles = draw_rectangles(free.bounds, shape, _SPARE * missing, rng)
        for rectangle in rectangles[shapely.contains_properly(free, rectangles)]:
            piece = Piece(rectangle) if isinstance(plan, FloorPlan) else _on_cells(plan, rectangle)
            if piece is not None and len(space.pieces) < count and not kept_clear.intersects(piece.outline):
                space.place(piece)
    return space.pieces


def free_of(plan: GridPlan) -> Floor:
    """Return the free cells of a grid as geometry [m]."""
    return _outline(plan, plan.cells == FREE)


class _Space:
    """The floor where the middle of a robot may be, while furniture is put on it."""

    def __init__(self, free: Floor, gap: float) -> None:
        self.radius = gap / 2 - _HAIR_M
        self.core = free.buffer(-self.radius, quad_segs=_ARC)
        self.pieces: list[Piece] = []
        self._grown: list[Floor] = []  # each piece, and half a robot around it
        self._boxes = np.empty((0, 4))  # what bounds these

    def place(self, piece: Piece) -> bool:
        """Put a piece on the floor; do nothing and return False where it stands over another or divides the core.

        The floor around the piece is looked at, a window that reaches a little beyond it. Where the core within it is
        one part, and one part still without the piece, every way that led through the piece leads around it.
        """
        near = self._near(piece.outline, self.radius + _RIM_M)
        if any(self.pieces[k].outline.intersects(piece.outline) for k in near):
            return False
        grown = piece.outline.buffer(self.radius, quad_segs=_ARC)
        window = grown.buffer(_RIM_M)
        core = shapely.intersection(self.core, window)
        for k in near:
            core = shapely.difference(core, self._grown[k])
        if core.area and not (_is_one(core) and _is_one(shapely.difference(core, grown))):
            return False
        self.pieces.append(piece)
        self._grown.append(grown)
        self._boxes = np.concatenate([self._boxes, [grown.bounds]])
        return True

    def _near(self, outline: Floor, reach: float) -> list[int]:
        low_x, low_y, high_x, high_y = outline.bounds
        boxes = self._boxes
        apart = (boxes[:, :2] > (high_x + reach, high_y + reach)) | (boxes[:, 2:] < (low_x - reach, low_y - reach))
        return np.flatnonzero(~apart.any(axis=1)).tolist()


def draw_rectangles(
    bounds: tuple[float, float, float, float], shape: ClutterShape, count: int, rng: np.random.Generator
) -> NDArray[np.object_]:
    """Draw ``count`` rectangles with their middles anywhere within ``bounds`` [m]; ``rng`` is consumed."""
    middle = rng.uniform(bounds[:2], bounds[2:], size=(count, 2))
    half_length = rng.uniform(shape.min_length_m, shape.max_length_m, size=count) / 2
    half_width = rng.uniform(shape.min_width_m, shape.max_width_m, size=count) / 2
    upright = rng.integers(2, size=count) * np.pi / 2
    angle = np.where(rng.random(count) < shape.turned_share, rng.uniform(0, np.pi, size=count), upright)
    along = np.column_stack([np.cos(angle), np.sin(angle)]) * half_length[:, None]
    across = np.column_stack([-np.sin(angle), np.cos(angle)]) * half_width[:, None]
    corners = [-along - across, along - across, along + across, across - along]
    rectangles: NDArray[np.object_] = shapely.polygons(middle[:, None] + np.stack(corners, axis=1))
    return rectangles


def _kept_clear(plan: FloorPlan | GridPlan, shape: ClutterShape) -> Floor:
    """Return where no furniture may stand: before doors, around start and goal."""
    doors = [shapely.Point(door.x, door.y).buffer(door.width / 2 + shape.door_clear_m) for door in plan.doors]
    ends = [shapely.Point(end).buffer(shape.gap_m / 2 + _RIM_M) for end in plan.endpoints or ()]
    discs = shapely.union_all([*doors, *ends])
    return discs if isinstance(discs, Polygon | MultiPolygon) else Polygon()


def _on_cells(plan: GridPlan, rectangle: Polygon) -> Piece | None:
    """Return the piece that covers the cells whose middles lie within ``rectangle``, None where there are none."""
    low, high = np.array(rectangle.bounds).reshape(2, 2)
    first_col, first_row = ((low - plan.origin) / plan.resolution).astype(int).tolist()
    cols, rows = np.ceil((high - low) / plan.resolution).astype(int) + 1
    row, col = np.indices((rows, cols)) + np.array([first_row, first_col])[:, None, None]
    x, y = ((place + 0.5) * plan.resolution + start for place, start in zip((col, row), plan.origin, strict=True))
    inside = shapely.contains_xy(rectangle, x, y)
    if not inside.any():
        return None
    return Piece(_outline(plan, inside, first_row, first_col), (row[inside], col[inside]))


def _outline(plan: GridPlan, cells: NDArray[np.bool_], first_row: int = 0, first_col: int = 0) -> Floor:
    """Return the marked cells as geometry [m]; ``cells`` is a part of the grid that begins at the given row, column."""
    rows, ends = np.nonzero(np.diff(np.pad(cells, ((0, 0), (1, 1))).astype(np.int8), axis=1))
    row, start, stop = rows[::2] + first_row, ends[::2] + first_col, ends[1::2] + first_col  # runs of marked cells
    (x, y), side = plan.origin, plan.resolution
    shape = shapely.union_all(shapely.box(x + start * side, y + row * side, x + stop * side, y + (row + 1) * side))
    return shape if isinstance(shape, Polygon | MultiPolygon) else Polygon()


def _is_one(floor: Floor) -> bool:
    """Return whether the floor is one part; parts that meet in a corner are two, splinters of rounding are none."""
    parts = shapely.get_parts(floor)
    return int((shapely.area(parts) > _HAIR_M**2).sum()) == 1


def _demand(key: str, value: float, holds: bool, allowed: str) -> None:
    demand(f"clutter.{key}", value, holds, allowed)
