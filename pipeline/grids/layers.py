"""What a plan says of the cells of its grid beside their occupancy: rooms, doors, and any layer of its source."""

import numpy as np
import shapely
from numpy.typing import NDArray

from pipeline.floorplans.plan import FloorPlan, GridPlan, Room
from pipeline.grids.occupancy import FREE, OccupancyGrid, Point, cell_at, contains

ROOMS = "rooms"
DOORS = "doors"
NONE = -1


def layers_of(plan: FloorPlan | GridPlan, grid: OccupancyGrid) -> dict[str, NDArray[np.int32] | NDArray[np.uint8]]:
    """Return the layers of ``plan`` on the cells of ``grid``, by name, each [rows, cols].

    ROOMS, int32: the room that the middle of a cell lies in, by its place in the plan, or in a grid plan by its number
    less one; NONE for none. Of rooms that overlap the smallest has it. DOORS, uint8: 1 where a door is marked: at its
    middle, and on free cells within half its width. Other layers of a grid plan, int32: the value at the middle of a
    cell, NONE beyond the drawing. Plans without rooms or doors have these two layers all the same.
    """
    found = {DOORS: _doors(plan, grid)}
    if isinstance(plan, FloorPlan):
        return found | {ROOMS: _rooms(plan.rooms, grid)}
    others = {name: _sampled(plan, layer.values, grid) for name, layer in plan.layers.items() if name != DOORS}
    rooms = others.get(ROOMS)
    numbered = np.full(grid.cells.shape, NONE, dtype=np.int32) if rooms is None else np.maximum(rooms - 1, NONE)
    return found | others | {ROOMS: numbered}


def _middles(grid: OccupancyGrid) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    rows, cols = grid.cells.shape
    x = np.float64(grid.origin.x) + (np.arange(cols, dtype=np.float64) + 0.5) * grid.resolution
    y = np.float64(grid.origin.y) + (np.arange(rows, dtype=np.float64) + 0.5) * grid.resolution
    return x, y


def _doors(plan: FloorPlan | GridPlan, grid: OccupancyGrid) -> NDArray[np.uint8]:
    marked = np.zeros(grid.cells.shape, dtype=np.uint8)
    x, y = _middles(grid)
    for door in plan.doors:
        cols = np.flatnonzero(np.abs(x - door.x) <= door.width / 2.0)
        rows = np.flatnonzero(np.abs(y - door.y) <= door.width / 2.0)
        near = np.hypot(x[cols] - door.x, y[rows, None] - door.y) <= door.width / 2.0
        window = np.ix_(rows, cols)
        marked[window] |= near & (grid.cells[window] == FREE)
        middle = cell_at(grid, Point(door.x, door.y))
        if contains(grid, middle):
            marked[middle] = 1
    return marked


def _rooms(rooms: tuple[Room, ...], grid: OccupancyGrid) -> NDArray[np.int32]:
    number = np.full(grid.cells.shape, NONE, dtype=np.int32)
    x, y = _middles(grid)
    for place in sorted(range(len(rooms)), key=lambda k: (-rooms[k].outline.area, k)):
        outline = rooms[place].outline
        if outline.is_empty:
            continue
        low_x, low_y, high_x, high_y = outline.bounds
        cols = np.flatnonzero((x >= low_x) & (x <= high_x))
        inside_rows = np.flatnonzero((y >= low_y) & (y <= high_y))
        window = np.ix_(inside_rows, cols)
        shapely.prepare(outline)
        within = shapely.contains_xy(outline, *np.meshgrid(x[cols], y[inside_rows]))
        number[window] = np.where(within, place, number[window])
    return number


def _sampled(plan: GridPlan, values: NDArray[np.uint16], grid: OccupancyGrid) -> NDArray[np.int32]:
    x, y = _middles(grid)
    cols = np.floor((x - plan.origin.x) / plan.resolution + 1e-6).astype(np.int64)
    rows = np.floor((y - plan.origin.y) / plan.resolution + 1e-6).astype(np.int64)
    inside = ((rows >= 0) & (rows < values.shape[0]))[:, None] & ((cols >= 0) & (cols < values.shape[1]))
    taken = values[np.ix_(rows.clip(0, values.shape[0] - 1), cols.clip(0, values.shape[1] - 1))].astype(np.int32)
    return np.where(inside, taken, NONE).astype(np.int32)
