"""The true building that a simulated robot moves through."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import TrialError
from pipeline.grids.distances import SHUT, open_field, settle, workspace_for
from pipeline.grids.inflate import disk_offsets, inflate
from pipeline.grids.occupancy import FREE, Cell, OccupancyGrid, contains


class World(NamedTuple):
    """A building as the simulation needs it. Planners never receive it.

    name: plan id, for messages.
    grid: true occupancy; the outermost ring is occupied.
    blocked: [rows, cols] uint8, 1 where the robot's centre cannot be.
    disk: [k, 2] int32 offsets that one obstacle cell blocks.
    layers: what else the plan says of each cell, by name ("rooms", "doors"): [rows, cols].
    """

    name: str
    grid: OccupancyGrid
    blocked: NDArray[np.uint8]
    disk: NDArray[np.int32]
    layers: Mapping[str, NDArray[Any]] = MappingProxyType({})

    def layer(self, name: str) -> NDArray[Any]:
        """Return layer ``name``.

        Raises:
            TrialError: the world has none of that name.
        """
        if name not in self.layers:
            known = ", ".join(sorted(self.layers)) or "none"
            raise TrialError(
                f"{self.name}: no layer {name!r}; it has {known}. Plans with such a layer carry it through rasterize: "
                "rasterize again, or change what the sensor reads (sensor.layers)."
            )
        return self.layers[name]


def make_world(
    name: str, grid: OccupancyGrid, radius_m: float, layers: Mapping[str, NDArray[Any]] | None = None
) -> World:
    """Return the world of ``grid`` for a robot of ``radius_m`` [m].

    Raises:
        TrialError: the grid's outermost ring is not occupied, or a layer has another shape than the grid.
    """
    for layer, values in (layers or {}).items():
        if values.shape != grid.cells.shape:
            raise TrialError(
                f"{name}: layer {layer!r} is {values.shape}, the grid {grid.cells.shape}. Rasterize the plan again."
            )
    occupied = grid.cells != FREE
    ring = (occupied[0], occupied[-1], occupied[:, 0], occupied[:, -1])
    if not all(bool(edge.all()) for edge in ring):
        raise TrialError(f"{name}: the grid's outermost ring must be occupied. Rasterize the plan again.")
    radius_cells = radius_m / grid.resolution
    blocked = inflate(occupied, radius_cells).astype(np.uint8)
    return World(name, grid, blocked, disk_offsets(radius_cells), dict(layers or {}))


def known_map_distance(world: World, start: Cell, goal: Cell) -> float:
    """Return the shortest travel distance [m] in the true map, inf if there is none: a bound, not a competitor."""
    cols = world.blocked.shape[1]
    target = goal.row * cols + goal.col
    field = open_field(world.blocked, 0)
    settle(field, cols, start.row * cols + start.col, np.array([target], dtype=np.int32), workspace_for(field.size))
    return float(field[target]) * world.grid.resolution if field[target] != SHUT else np.inf


def require_inside(world: World, cell: Cell, what: str) -> None:
    """Check that ``cell`` is one of the grid's.

    Raises:
        TrialError: it is not; ``what`` names it ("start", "goal").
    """
    rows, cols = world.blocked.shape
    if not contains(world.grid, cell):
        raise TrialError(
            f"{world.name}: the {what} is at row {cell.row}, col {cell.col}, outside the {rows} x {cols} grid. "
            "Choose a cell inside it."
        )


def require_standing_room(world: World, cell: Cell, what: str) -> None:
    """Check that a robot can stand at ``cell``.

    Raises:
        TrialError: the cell is outside the grid or too close to a wall; ``what`` names it ("start", "goal").
    """
    require_inside(world, cell, what)
    if world.blocked[cell.row, cell.col]:
        raise TrialError(
            f"{world.name}: the {what} at row {cell.row}, col {cell.col} lies in a wall or within the robot's "
            "radius of one. Choose a free cell or a smaller robot.radius_m."
        )
