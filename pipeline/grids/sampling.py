"""Start and goal cells: in space the robot can stand in, connected, far enough apart, seeded."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from pipeline.errors import TrialError
from pipeline.grids.distances import travel_field
from pipeline.grids.inflate import inflate
from pipeline.grids.occupancy import FREE, Cell, OccupancyGrid, Point, cell_at, contains
from pipeline.randomness import stream

Mask = NDArray[np.bool_]

_TRIES = 50  # starts drawn for one pair before the floor counts as too small


class Ends(NamedTuple):
    """A start, a goal and the shortest travel distance between them in the true inflated map [m]."""

    start: Cell
    goal: Cell
    known_map_m: float


def traversable_cells(grid: OccupancyGrid, robot_radius: float) -> Mask:
    """Return the cells where the centre of a robot of ``robot_radius`` [m] may be: [rows, cols] bool."""
    return ~inflate(grid.cells != FREE, robot_radius / grid.resolution)


def largest_component(traversable: Mask) -> Mask:
    """Return the largest connected part of ``traversable``. Diagonal steps never cut corners, so 4-connected."""
    parts, count = label(traversable)
    if count == 0:
        return traversable.copy()
    largest: Mask = parts == 1 + int(np.argmax(np.bincount(parts.ravel())[1:]))
    return largest


def sample_ends(
    grid: OccupancyGrid, *, plan_id: str, count: int, min_distance: float, robot_radius: float, seed: int
) -> list[Ends]:
    """Draw ``count`` starts and goals in the largest connected part, at least ``min_distance`` [m] of travel apart.

    Starts are uniform over the part, goals uniform over its cells that are far enough. The first k of more pairs are
    the same pairs. They depend on (seed, plan_id) alone.

    Raises:
        TrialError: no cell is traversable, or nowhere on the plan are two cells that far apart.
    """
    rng = stream(seed, "pairs", plan_id)
    room = largest_component(traversable_cells(grid, robot_radius))
    cells = np.argwhere(room)
    if not len(cells):
        raise TrialError(
            f"plan {plan_id}: a robot of radius {robot_radius:g} m fits nowhere at {grid.resolution:g} m per cell. "
            "Lower robot.radius_m or rasterize.resolution_m."
        )
    return [_draw_ends(room, cells, grid.resolution, plan_id, min_distance, rng) for _ in range(count)]


def ends_between(grid: OccupancyGrid, start: Point, goal: Point, *, plan_id: str, robot_radius: float) -> Ends:
    """Return the given start and goal [m] as cells, with the travel distance between them.

    Raises:
        TrialError: one of them lies outside the map, in a wall or too close to one, or they are not connected.
    """
    room = traversable_cells(grid, robot_radius)
    cells = []
    for name, spot in (("start", start), ("goal", goal)):
        cell = cell_at(grid, spot)
        if not contains(grid, cell) or not room[cell]:
            raise TrialError(_blocked(grid, name, cell, plan_id, robot_radius))
        cells.append(cell)
    distance = float(travel_field(room, *cells[0])[cells[1]]) * grid.resolution
    if not np.isfinite(distance):
        raise TrialError(
            f"plan {plan_id}: the goal in cell {tuple(cells[1])} cannot be reached from the start in cell "
            f"{tuple(cells[0])} by a robot of radius {robot_radius:g} m. Move one of them or lower robot.radius_m."
        )
    return Ends(cells[0], cells[1], distance)


def _draw_ends(
    room: Mask, cells: NDArray[np.int64], resolution: float, plan_id: str, min_distance: float, rng: np.random.Generator
) -> Ends:
    farthest = 0.0
    for _ in range(_TRIES):
        start = Cell(*rng.choice(cells).tolist())
        field = travel_field(room, start.row, start.col) * resolution
        far = np.argwhere(np.isfinite(field) & (field >= max(min_distance, resolution)))
        if len(far):
            goal = Cell(*rng.choice(far).tolist())
            return Ends(start, goal, float(field[goal]))
        farthest = max(farthest, float(field[np.isfinite(field)].max()))
    raise TrialError(
        f"plan {plan_id}: no start and goal {min_distance:g} m apart found in {_TRIES} tries, the farthest were "
        f"{farthest:.1f} m. Lower rasterize.min_distance_m or leave this plan out."
    )


def _blocked(grid: OccupancyGrid, name: str, cell: Cell, plan_id: str, robot_radius: float) -> str:
    if not contains(grid, cell):
        place = f"outside the map of {grid.cells.shape[0]} x {grid.cells.shape[1]} cells"
    else:
        place = "in a wall" if grid.cells[cell] != FREE else f"closer to a wall than the robot's {robot_radius:g} m"
    return f"plan {plan_id}: the {name} in cell (row {cell.row}, col {cell.col}) is {place}. Choose a free cell."
