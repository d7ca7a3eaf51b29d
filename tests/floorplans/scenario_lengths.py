"""Our own shortest lengths for the scenarios of a Moving AI benchmark."""

from pipeline.floorplans.plan import GridPlan
from pipeline.floorplans.readers.moving_ai import Scenario
from pipeline.grids.occupancy import Cell
from pipeline.grids.rasterize import rasterize
from pipeline.simulation.world import known_map_distance, make_world


def lengths_on(plan: GridPlan, scenarios: list[Scenario]) -> list[float]:
    """Shortest lengths [cells] on ``plan``, inf where there is none, for a robot that is no wider than a cell."""
    grid = rasterize(plan, plan.resolution)
    world = make_world(plan.plan_id, grid, 0.0)
    right, up = (
        round((of_plan - of_grid) / plan.resolution) for of_plan, of_grid in zip(plan.origin, grid.origin, strict=True)
    )

    def cell(end: tuple[int, int]) -> Cell:
        return Cell(plan.cells.shape[0] - 1 - end[1] + up, end[0] + right)

    return [known_map_distance(world, cell(s.start), cell(s.goal)) / plan.resolution for s in scenarios]
