"""Floor plan -> occupancy grid.

Geometry: a cell is FREE only if it lies entirely inside the free polygon; touching its outline from inside is inside,
to a micrometre. Cells: a coarser cell is FREE only if every finer cell in it is free. Either way a free cell never
hides an obstacle, and the outermost ring is OCCUPIED.
"""

from math import ceil

import numpy as np
import shapely
from numpy.typing import NDArray

from pipeline.errors import ConfigError, PlanError
from pipeline.floorplans.plan import CLUTTER, FloorPlan, GridPlan
from pipeline.grids.occupancy import FREE, OCCUPIED, OccupancyGrid, Point
from pipeline.grids.open_doors import FineFloor, Window, cut_window, open_doors

Mask = NDArray[np.bool_]
Lengths = NDArray[np.float64]
Indices = NDArray[np.int64]

CELLS_PER_DOOR = 3  # a door at least this many cells wide stays open wherever the grid falls
_MOST_CELLS = 25_000_000  # 1.5 km x 1.5 km at 0.3 m
_FINE_PER_DOOR = 6  # fine cells across the narrowest door: at any angle its floor stays connected
_FINEST = 24  # fine cells for a cell
_TOUCH_M = 1e-6  # an outline this close to the edge of a cell does not cross it


def rasterize(
    plan: FloorPlan | GridPlan, resolution: float, *, drop_clutter: bool = False, doors_from_m: float | None = None
) -> OccupancyGrid:
    """Return the plan as FREE and OCCUPIED cells of ``resolution`` [m] inside a closed ring.

    drop_clutter: count furniture, where the source marks it, as free. doors_from_m: marked doors of at least this
    width [m] stay open, by cells that are free only in part where need be (`open_doors`); None lets them close.

    Raises:
        ConfigError: the resolution is not positive, or no whole multiple of the cells of a grid plan.
        PlanError: nothing is left free.
    """
    check_resolution(plan, resolution)
    grid = (
        _from_cells(plan, resolution, drop_clutter) if isinstance(plan, GridPlan) else _from_geometry(plan, resolution)
    )
    if not (grid.cells == FREE).any():
        raise PlanError(
            f"plan {plan.plan_id}: no cell of {resolution:g} m lies inside its free space. "
            "Lower rasterize.resolution_m or check the scale of the plan."
        )
    return _ringed(grid if doors_from_m is None else _with_doors(grid, plan, drop_clutter, doors_from_m))


def fine_floor(
    plan: FloorPlan | GridPlan, grid: OccupancyGrid, factor: int, *, drop_clutter: bool = False
) -> FineFloor:
    """Return what gives the free floor of a plan on cells ``factor`` times finer than those of ``grid``.

    A grid plan has only its own cells: ``factor`` is then how many of them a cell of ``grid`` is wide.
    """
    side = grid.resolution / factor
    if isinstance(plan, FloorPlan):
        floor = plan.free

        def of_geometry(window: Window) -> Mask:
            corner = Point(grid.origin.x + window.col * grid.resolution, grid.origin.y + window.row * grid.resolution)
            return inside(floor, window.rows * factor, window.cols * factor, side, corner)

        return of_geometry
    free = ~_blocked(plan, drop_clutter)
    shift = (
        round((grid.origin.y - plan.origin.y) / plan.resolution),
        round((grid.origin.x - plan.origin.x) / plan.resolution),
    )

    def of_cells(window: Window) -> Mask:
        row, col = shift[0] + window.row * factor, shift[1] + window.col * factor
        return cut_window(free, Window(row, col, window.rows * factor, window.cols * factor))

    return of_cells


def fine_factor(plan: FloorPlan | GridPlan, resolution: float, detail: float) -> int:
    """Return how many fine cells a cell of ``resolution`` [m] is wide, so that ``detail`` [m] is seen in geometry."""
    if isinstance(plan, GridPlan):
        return round(resolution / plan.resolution)
    return min(_FINEST, max(1, ceil(resolution / detail)))


def _with_doors(
    grid: OccupancyGrid, plan: FloorPlan | GridPlan, drop_clutter: bool, doors_from_m: float
) -> OccupancyGrid:
    doors = [door for door in plan.doors if door.width >= doors_from_m - _TOUCH_M]
    if not doors:
        return grid
    factor = fine_factor(plan, grid.resolution, min(door.width for door in doors) / _FINE_PER_DOOR)
    free = open_doors(
        grid.cells == FREE,
        doors,
        fine_floor(plan, grid, factor, drop_clutter=drop_clutter),
        factor=factor,
        resolution=grid.resolution,
        origin=grid.origin,
    )
    return OccupancyGrid(np.where(free, FREE, OCCUPIED).astype(np.uint8), grid.resolution, grid.origin)


def check_resolution(plan: FloorPlan | GridPlan, resolution: float) -> None:
    """Refuse a resolution [m] that does not fit the plan; the ConfigError names the key and the allowed values."""
    if not 0 < resolution < float("inf"):
        raise ConfigError(f"rasterize.resolution_m = {resolution:g}: expected metres per cell above 0.")
    if isinstance(plan, GridPlan) and not _is_multiple(resolution, plan.resolution):
        allowed = ", ".join(f"{plan.resolution * k:g}" for k in (1, 2, 3))
        raise ConfigError(
            f"rasterize.resolution_m = {resolution:g}: plan {plan.plan_id} has cells of {plan.resolution:g} m, "
            f"so only whole multiples of that are possible ({allowed}, ...). Change it in conf/rasterize/."
        )


def check_doors(plan_id: str, narrowest_door: float | None, resolution: float) -> None:
    """Refuse a resolution [m] that may close the narrowest door [m]; the ConfigError names the largest allowed."""
    if narrowest_door is not None and resolution > narrowest_door / CELLS_PER_DOOR + 1e-9:
        raise ConfigError(
            f"rasterize.resolution_m = {resolution:g}: the narrowest door of plan {plan_id} is {narrowest_door:.2f} m, "
            f"so at most {narrowest_door / CELLS_PER_DOOR:.3f} surely keeps it open. Lower it in conf/rasterize/, "
            "or set rasterize.narrow_doors=keep."
        )


def pool(blocked: Mask, factor: int) -> Mask:
    """Return ``blocked`` [rows, cols] with ``factor`` x ``factor`` cells as one, blocked if any of them is.

    Cells missing from the last row or column count as blocked.
    """
    rows, cols = blocked.shape
    padded = np.pad(blocked, ((0, -rows % factor), (0, -cols % factor)), constant_values=True)
    blocks = padded.reshape(padded.shape[0] // factor, factor, padded.shape[1] // factor, factor)
    return np.asarray(blocks.any(axis=(1, 3)))


def inside(free: shapely.Geometry, rows: int, cols: int, resolution: float, origin: Point) -> Mask:
    """Return the cells that lie entirely inside the valid polygon ``free`` [m]: [rows, cols] bool."""
    x = origin.x + (np.arange(cols) + 0.5) * resolution
    y = origin.y + (np.arange(rows) + 0.5) * resolution
    shapely.prepare(free)
    centered: Mask = shapely.contains_xy(free, *np.meshgrid(x, y))
    return centered & ~crossed(free, rows, cols, resolution, origin)


def crossed(free: shapely.Geometry, rows: int, cols: int, resolution: float, origin: Point) -> Mask:
    """Return the cells whose interior the outline of ``free`` [m] enters: [rows, cols] bool.

    Each segment is cut into the strips of the rows it passes. Inside one strip it is still one straight piece, so it
    enters just the cells between its lowest and its highest x.
    """
    outline = shapely.get_parts(shapely.boundary(free))
    corners, line = shapely.get_coordinates(outline, return_index=True)
    corners = (corners - (origin.x, origin.y)) / resolution  # now in cells: x is a column, y a row
    ends = np.stack([corners[:-1], corners[1:]], axis=1)[line[:-1] == line[1:]]  # [segments, 2, xy]
    touch = _TOUCH_M / resolution
    first, stop = _entered(ends[..., 1].min(axis=1), ends[..., 1].max(axis=1), touch, rows)
    count = stop - first
    segment = np.repeat(np.arange(len(ends)), count)
    row = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - first, count)
    low_x, high_x = _cut(ends[segment], row + touch, row + 1 - touch)
    begin, end = _entered(low_x, high_x, touch, cols)
    edges = np.zeros((rows, cols + 1), dtype=np.int32)
    np.add.at(edges, (row, begin), 1)
    np.add.at(edges, (row, end), -1)
    return edges.cumsum(axis=1)[:, :cols] > 0


def _entered(low: Lengths, high: Lengths, touch: float, count: int) -> tuple[Indices, Indices]:
    """Return first and stop of the unit intervals 0 .. count-1 that [low, high] enters by more than ``touch``."""
    first = np.ceil(low - 1 + touch).astype(np.int64).clip(0, count)
    stop = np.floor(high - touch).astype(np.int64) + 1
    return first, stop.clip(first, count)


def _cut(ends: Lengths, low_y: Lengths, high_y: Lengths) -> tuple[Lengths, Lengths]:
    """Return the lowest and highest x of segments [k, 2, xy] between ``low_y`` and ``high_y`` [k]."""
    (x0, y0), (dx, dy) = ends[:, 0].T, (ends[:, 1] - ends[:, 0]).T
    level = dy == 0
    rise = np.where(level, 1.0, dy)
    shares = np.stack([(low_y - y0) / rise, (high_y - y0) / rise]).clip(0, 1)
    shares[:, level] = [[0.0], [1.0]]
    x = x0 + shares * dx
    return x.min(axis=0), x.max(axis=0)


def _from_geometry(plan: FloorPlan, resolution: float) -> OccupancyGrid:
    low_x, low_y, high_x, high_y = plan.bounds
    rows, cols = (max(1, ceil(side / resolution - 1e-6)) for side in (high_y - low_y, high_x - low_x))
    if rows * cols > _MOST_CELLS:
        raise ConfigError(
            f"rasterize.resolution_m = {resolution:g}: plan {plan.plan_id} would have {rows} x {cols} cells, "
            f"at most {_MOST_CELLS:,} are allowed. Raise it in conf/rasterize/."
        )
    origin = Point(low_x, low_y)
    free = inside(plan.free, rows, cols, resolution, origin)
    return OccupancyGrid(np.where(free, FREE, OCCUPIED).astype(np.uint8), resolution, origin)


def _from_cells(plan: GridPlan, resolution: float, drop_clutter: bool) -> OccupancyGrid:
    """Pool the cells, then cut away what lies beyond the free ones (laser maps have wide unknown margins)."""
    pooled = pool(_blocked(plan, drop_clutter), round(resolution / plan.resolution))
    free_rows, free_cols = (np.flatnonzero(~pooled.all(axis=axis)) for axis in (1, 0))
    if not free_rows.size:
        return OccupancyGrid(pooled.astype(np.uint8), resolution, Point(*plan.origin))
    row, col = int(free_rows[0]), int(free_cols[0])
    kept = pooled[row : free_rows[-1] + 1, col : free_cols[-1] + 1]
    origin = Point(plan.origin.x + col * resolution, plan.origin.y + row * resolution)
    return OccupancyGrid(np.where(kept, OCCUPIED, FREE).astype(np.uint8), resolution, origin)


def _blocked(plan: GridPlan, drop_clutter: bool) -> Mask:
    blocked: Mask = plan.cells != FREE
    return blocked & (plan.cells != CLUTTER) if drop_clutter else blocked


def _ringed(grid: OccupancyGrid) -> OccupancyGrid:
    cells = np.pad(grid.cells, 1, constant_values=OCCUPIED)
    corner = Point(grid.origin.x - grid.resolution, grid.origin.y - grid.resolution)
    return OccupancyGrid(cells, grid.resolution, corner)


def _is_multiple(resolution: float, finer: float) -> bool:
    factor = resolution / finer
    return round(factor) >= 1 and abs(factor - round(factor)) < 1e-6 * factor
