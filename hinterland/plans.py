"""Floor plans and a robot's maps, from files to worlds."""

from pathlib import Path

import numpy as np

from pipeline.errors import PlanError
from pipeline.floorplans.plan import CLUTTER, OCCUPIED, FloorPlan, GridPlan, Location
from pipeline.floorplans.readers import Reader, ReadOptions, read_plan_file
from pipeline.floorplans.writers import WRITERS
from pipeline.grids.occupancy import OccupancyGrid, Point
from pipeline.grids.rasterize import rasterize as rasterize_plan
from pipeline.grids.robot_map import coarsened
from pipeline.settings import RobotConfig
from pipeline.simulation.world import World
from pipeline.simulation.world import make_world as world_of

ROBOT = RobotConfig(radius_m=0.15, step_m=0.54)
"""A small robot: a disc 0.3 m wide that looks every 0.54 m."""


def read_plans(
    path: str | Path, *, reader: str | Reader | None = None, options: ReadOptions | None = None
) -> list[FloorPlan | GridPlan]:
    """Return all plans of the file at ``path``.

    reader: name of a format (``hinterland plan formats``) or a reader of your own; None looks into the file.
    options: what the file does not say itself, such as ``ReadOptions(metres_per_unit=0.05)``.

    Raises:
        PlanError: no such file, no reader knows it, it is damaged or lacks something, or one plan of it is unusable.
    """
    found = read_plan_file(Path(path), reader, options)
    for plan in found:
        if isinstance(plan, PlanError):
            raise plan
    return [plan for plan in found if not isinstance(plan, PlanError)]


def read_plan(
    path: str | Path,
    *,
    plan_id: str | None = None,
    reader: str | Reader | None = None,
    options: ReadOptions | None = None,
) -> FloorPlan | GridPlan:
    """Return the plan of the file at ``path``; ``plan_id`` names one where it holds several. Else as `read_plans`.

    Raises:
        PlanError: as `read_plans`, and where there are several plans or none of that name.
    """
    found = read_plans(path, reader=reader, options=options)
    chosen = [plan for plan in found if plan_id in (None, plan.plan_id)]
    if len(chosen) != 1:
        names = ", ".join(plan.plan_id for plan in found)
        asked = "one plan" if plan_id is None else f"a plan {plan_id!r}"
        raise PlanError(f"{path}: expected {asked}, it holds {len(found)}: {names}. Name one by plan_id=...")
    return chosen[0]


def rasterize(plan: FloorPlan | GridPlan, resolution_m: float, *, doors_from_m: float | None = None) -> OccupancyGrid:
    """Return the plan as FREE and OCCUPIED cells of ``resolution_m`` [m] inside a closed ring.

    doors_from_m: marked doors of at least this width [m] stay open; None lets them close where no cell fits in.

    Raises:
        ConfigError: the resolution is not positive, or no whole multiple of the cells of a grid plan.
        PlanError: nothing is left free.
    """
    return rasterize_plan(plan, resolution_m, doors_from_m=doors_from_m)


def make_world(plan: FloorPlan | GridPlan, *, resolution_m: float = 0.1, robot: RobotConfig = ROBOT) -> World:
    """Return the building to drive in, on cells of ``resolution_m`` [m] for ``robot``, of which the radius counts.

    Marked doors that the robot passes stay open. Raises as `rasterize`.
    """
    grid = rasterize_plan(plan, resolution_m, doors_from_m=2 * robot.radius_m)
    return world_of(plan.plan_id, grid, robot.radius_m)


def read_map(
    path: str | Path, *, resolution_m: float | None = None, options: ReadOptions | None = None
) -> OccupancyGrid:
    """Return a robot's own map, such as the YAML of a ROS map_server, with its UNKNOWN cells.

    resolution_m: coarser cells [m], a whole multiple of the map's: take those that the network was made with. A cell
        is then OCCUPIED where any part is, FREE where at least half was seen to be, else UNKNOWN. None keeps the map's.

    Raises:
        PlanError: no such file, no map, or a plan of geometry.
        ConfigError: the resolution is no such multiple.
    """
    plan = read_plan(path, options=options)
    if not isinstance(plan, GridPlan):
        raise PlanError(f"{path}: a plan of lines, expected a map of cells. Read it with read_plan.")
    cells = np.where(plan.cells == CLUTTER, OCCUPIED, plan.cells).astype(np.uint8)
    grid = OccupancyGrid(cells, plan.resolution, Point(*plan.origin))
    return grid if resolution_m is None else coarsened(grid, resolution_m)


def write_map(grid: OccupancyGrid, path: str | Path) -> list[Path]:
    """Write ``grid`` as a ROS map, ``path`` (YAML) and a PGM beside it; return both.

    Raises:
        PlanError: ``path`` does not end in .yaml.
    """
    target = Path(path)
    if target.suffix != ".yaml":
        raise PlanError(f"{target}: expected a name that ends in .yaml")
    name = target.stem
    plan = GridPlan(
        plan_id=name,
        building=name,
        floor=name,
        environment="robot_maps",
        source=target.name,
        cells=grid.cells,
        resolution=grid.resolution,
        origin=Location(*grid.origin),
    )
    return WRITERS["ros_map_server"].write(plan, target)
