"""How much floor a plan loses on the way to its grid: what a robot reaches on the plan, and no longer on the cells.

Along every wall a grid of wholly free cells is up to a cell narrower than the floor; that is no loss, since the robot
gets as far. Floor is lost where the robot no longer gets near it: a room behind a door that closed, a corridor narrower
than a cell. Both are told apart by the way along the floor to the nearest cell that is still reached.
"""

from math import ceil
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, label

from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.grids.occupancy import OccupancyGrid, Point
from pipeline.grids.open_doors import Window
from pipeline.grids.rasterize import fine_factor, fine_floor
from pipeline.grids.sampling import largest_component, traversable_cells

Mask = NDArray[np.bool_]

MUCH_LOST = 0.01  # a larger share of what is reachable is worth a warning
_NEAR_CELLS = 2  # floor so far from a cell that is reached, along the floor, is its margin
_DETAIL_M = 0.1
_MOST_POINTS = 40_000_000
_AROUND = np.ones((3, 3), dtype=np.bool_)


class LostArea(NamedTuple):
    """What a robot reaches on the plan, and what of that is lost on the grid [m2], for the middle of the robot.

    place: a point in the largest lost part [m]; None where nothing is lost.
    """

    reachable_m2: float
    lost_m2: float
    place: Point | None

    @property
    def share(self) -> float:
        """The lost share of what is reachable."""
        return self.lost_m2 / self.reachable_m2 if self.reachable_m2 > 0 else 0.0


def lost_area(
    plan: FloorPlan | GridPlan, grid: OccupancyGrid, robot_radius: float, *, drop_clutter: bool = False
) -> LostArea:
    """Return how much of the largest part of the floor for a robot of ``robot_radius`` [m] is lost on ``grid``.

    The floor is looked at on cells of at most 0.1 m, a grid plan on its own.
    """
    rows, cols = grid.cells.shape
    factor = fine_factor(plan, grid.resolution, _DETAIL_M)
    factor = max(1, min(factor, int((_MOST_POINTS / (rows * cols)) ** 0.5)))
    side = grid.resolution / factor
    if isinstance(plan, GridPlan):
        fine = fine_floor(plan, grid, factor, drop_clutter=drop_clutter)(Window(0, 0, rows, cols))
        floor = traversable_cells(OccupancyGrid(np.where(fine, 0, 1).astype(np.uint8), side, grid.origin), robot_radius)
        floor = largest_component(floor)
    else:
        floor = _largest_reached(plan, grid, factor, robot_radius)
    reached = _most_of(traversable_cells(grid, robot_radius).repeat(factor, axis=0).repeat(factor, axis=1), floor)
    steps = ceil(_NEAR_CELLS * factor)
    far = floor & ~_grown(reached, floor, steps)
    lost = _grown(far, floor & ~reached, steps) if far.any() else far
    return LostArea(float(floor.sum()) * side**2, float(lost.sum()) * side**2, _place(lost, side, grid.origin))


def _most_of(traversable: Mask, floor: Mask) -> Mask:
    """Return the connected part of ``traversable`` that holds most of ``floor``, where it is floor.

    The largest part of the grid may be another flat of about the same size.
    """
    parts, _ = label(traversable)
    counts = np.bincount(parts[floor], minlength=2)
    counts[0] = 0
    most = int(np.argmax(counts))
    reached: Mask = (parts == most) & floor & (most > 0)
    return reached


def say_lost(plan_id: str, resolution: float, lost: LostArea) -> str:
    """Return the sentence that warns of floor lost on cells of ``resolution`` [m]."""
    where = "" if lost.place is None else f", most of it around ({lost.place.x:.1f}, {lost.place.y:.1f}) m"
    return (
        f"plan {plan_id} loses {lost.lost_m2:.1f} m2 ({lost.share:.1%}) of its reachable floor on cells of "
        f"{resolution:g} m{where}. Lower rasterize.resolution_m, or mark the door there."
    )


def _largest_reached(plan: FloorPlan, grid: OccupancyGrid, factor: int, robot_radius: float) -> Mask:
    """Return the fine cells whose middle the robot's middle may reach in the largest part of the floor."""
    parts = shapely.get_parts(shapely.buffer(plan.free, -robot_radius))
    rows, cols = (count * factor for count in grid.cells.shape)
    if not len(parts):
        return np.zeros((rows, cols), dtype=np.bool_)
    part = parts[int(np.argmax(shapely.area(parts)))]
    side = grid.resolution / factor
    x = grid.origin.x + (np.arange(cols) + 0.5) * side
    y = grid.origin.y + (np.arange(rows) + 0.5) * side
    shapely.prepare(part)
    inside: Mask = shapely.contains_xy(part, *np.meshgrid(x, y))
    return inside


def _grown(seeds: Mask, floor: Mask, steps: int) -> Mask:
    """Return ``seeds`` grown by so many steps in eight directions, along ``floor`` only."""
    grown: Mask = binary_dilation(seeds, structure=_AROUND, iterations=steps, mask=floor)
    return grown


def _place(lost: Mask, side: float, origin: Point) -> Point | None:
    """Return a point of the largest lost part, near its middle [m]."""
    parts, count = label(lost, structure=_AROUND)
    if not count:
        return None
    cells = np.argwhere(parts == 1 + int(np.argmax(np.bincount(parts.ravel())[1:])))
    row, col = cells[int(np.argmin(((cells - cells.mean(axis=0)) ** 2).sum(axis=1)))].tolist()
    return Point(origin.x + (col + 0.5) * side, origin.y + (row + 0.5) * side)
