"""Drives through a building that the planner has not seen."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hinterland.plans import ROBOT
from pipeline.errors import ConfigError, TrialError
from pipeline.grids.inflate import disk_offsets
from pipeline.grids.occupancy import Cell, OccupancyGrid, Point, cell_at
from pipeline.parts import find_part, make_part, named
from pipeline.planning.protocols import Planner
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.simulation.robots import make_robot
from pipeline.simulation.trial import require_possible, run_trial
from pipeline.simulation.world import World, known_map_distance, require_standing_room
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner

PLANNERS = {"optimistic": "pipeline.planning.optimistic:OptimisticPlanner"}
SENSOR = SensorConfig(max_range_m=12.0)


class Drive(NamedTuple):
    """A finished drive.

    ending: how it ended, a sentence. reached: whether that was at the goal. travelled_m: distance travelled [m].
    known_map_m: shortest way in the true map [m], a bound that no robot can know. path: [k, 2] x, y of cells passed
    [m], from the start on. steps: scans; decisions: times the planner was asked. map: what the robot knew at the end.
    """

    ending: str
    reached: bool
    travelled_m: float
    known_map_m: float
    path: NDArray[np.float64]
    steps: int
    decisions: int
    map: OccupancyGrid


def drive(
    world: World,
    planner: Planner | LearnedEstimator | str,
    *,
    start: tuple[float, float],
    goal: tuple[float, float],
    sensor: SensorConfig = SENSOR,
    robot: RobotConfig = ROBOT,
    max_steps: int | None = None,
    seed: int = 0,
) -> Drive:
    """Let a planner drive a robot from ``start`` to ``goal`` (x, y [m]) and return how it fared.

    planner: a fresh planner, since one serves one drive; a network, with which subgoals are planned; "optimistic"; or
        a place, ``my_package.my_module:factory``.
    sensor: the lidar; by default it looks all around, 12 m far. robot: the one that the world was made for.
    max_steps: scans after which the drive is cut off. seed: of the noise of the ranges that planners receive.

    Raises:
        ConfigError: the world was made for a robot of another radius.
        TrialError: the robot cannot stand at the start, or the goal lies outside of the plan or in a wall.
        PartError, PlannerError: the planner fails, or answers what no robot can follow.
        TableError: the network takes scans of another number of ranges than the sensor makes.
    """
    grid = world.grid
    first, last = _cell(world, start, "start"), _cell(world, goal, "goal")
    require_standing_room(world, first, "start")
    require_standing_room(world, last, "goal")
    if not np.array_equal(world.disk, disk_offsets(robot.radius_m / grid.resolution)):
        raise ConfigError(
            f"robot.radius_m = {robot.radius_m}: {world.name} was made for a robot of another radius. Hand the same "
            "robot to make_world and drive"
        )
    body = make_robot(sensor, robot)
    chosen, name = _planner(planner)
    with named(name):
        episode = run_trial(
            world,
            first,
            last,
            chosen,
            robot=body,
            rng=np.random.default_rng(seed),
            max_steps=max_steps,
        )
    shortest = known_map_distance(world, first, last)
    require_possible(episode, shortest * body.motion.undercut, name)
    rows, cols = np.divmod(episode.path, grid.cells.shape[1])
    corner = np.array([grid.origin.x, grid.origin.y])
    return Drive(
        ending=str(episode.ending),
        reached=episode.ending.name == "REACHED",
        travelled_m=episode.travelled,
        known_map_m=shortest,
        path=corner + (np.stack([cols, rows], axis=1) + 0.5) * grid.resolution,
        steps=episode.steps,
        decisions=episode.decisions,
        map=OccupancyGrid(episode.known, grid.resolution, grid.origin),
    )


def _cell(world: World, place: tuple[float, float], what: str) -> Cell:
    """Return the cell at ``place`` (x, y [m])."""
    grid = world.grid
    cell = cell_at(grid, Point(*place))
    rows, cols = grid.cells.shape
    if not (0 <= cell.row < rows and 0 <= cell.col < cols):
        left, low = grid.origin
        right, high = left + cols * grid.resolution, low + rows * grid.resolution
        raise TrialError(
            f"{what} = ({place[0]:g}, {place[1]:g}) m lies outside of {world.name}, whose cells span x from {left:g} "
            f"to {right:g} m and y, which points up, from {low:g} to {high:g} m"
        )
    return cell


def _planner(given: Planner | LearnedEstimator | str) -> tuple[Planner, str]:
    """Return the planner to drive with, and its name for messages."""
    if isinstance(given, LearnedEstimator):
        return SubgoalPlanner(estimator=given), "the network"
    if isinstance(given, str):
        part = find_part("planner", given, PLANNERS)
        made: Planner = make_part(part, part.settings() if part.settings else None, expected=Planner)
        return made, str(part)
    if not hasattr(given, "plan"):
        raise ConfigError(
            f"planner = {given!r}: expected an object with a method plan, a network, {', '.join(PLANNERS)}, or "
            "my_package.my_module:factory"
        )
    return given, type(given).__name__
