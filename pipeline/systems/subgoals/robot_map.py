"""Estimates on a map that a robot made itself: where to try first, and what each way is expected to cost."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import TrialError
from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN, Cell, OccupancyGrid, Point, cell_at, center_of
from pipeline.grids.partial_map import BLOCKED, PartialMap
from pipeline.grids.robot_map import belief_of, with_unseen_rim
from pipeline.learning.provenance import made_differently
from pipeline.planning.expected_cost import order_subgoals
from pipeline.planning.gate_distances import GateDistances
from pipeline.planning.protocols import Estimates
from pipeline.planning.seen import RANGES, Pose, Seen
from pipeline.planning.subgoals import Surroundings
from pipeline.settings import RobotConfig
from pipeline.simulation.lidar import Lidar
from pipeline.simulation.world import make_world
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.planner import most_promising

_SCANNED_M = 18.0  # as far as a lidar looks where the network does not say
_BEAMS = 1024
_MARGIN_M = 3.0


class RankedSubgoal(NamedTuple):
    """A frontier and what the network says of it.

    x, y: the frontier cell that stands for it, frame of the map [m]. p_success: probability that it leads to the goal.
    way_m: optimistic way robot -> frontier -> goal [m], unseen space taken as free. delta_success_m: what success is
    expected to cost beyond that [m]; exploration_m: what failure costs [m]. cells: size of the frontier.
    """

    x: float
    y: float
    p_success: float
    way_m: float
    delta_success_m: float
    exploration_m: float
    cells: int


class MapEstimate(NamedTuple):
    """What a network says of a robot's map.

    subgoals: in the order of least expected cost, so the first is the one to try next; behind those that entered the
    ordering the others, the likelier first. Empty where known space leads to the goal, or nothing can.
    expected_cost_m: of that order [m]; the way itself where it is known; inf where nothing leads to the goal.
    remarks: what the network was made with that this map and robot are not.
    """

    subgoals: Sequence[RankedSubgoal]
    expected_cost_m: float
    remarks: Sequence[str] = ()


def estimate_on_map(
    network: LearnedEstimator,
    grid: OccupancyGrid,
    pose: tuple[float, float, float],
    goal: tuple[float, float],
    *,
    robot: RobotConfig,
    ranges: NDArray[np.floating] | None = None,
    max_subgoals: int = 12,
) -> MapEstimate:
    """Return what ``network`` says of the frontiers of the robot's map ``grid``.

    pose: x, y [m] and yaw [rad] of the robot, goal: x, y [m], in the frame of the map; the goal may lie outside of it.
    ranges: [beams] m, the last scan in the robot frame, beam 0 ahead, counter-clockwise, for a network that reads
        scans; where None it is made from the map, unseen cells taken as free.
    max_subgoals: how many enter the ordering.

    Raises:
        TrialError: the robot stands in an obstacle of its map or off it, or the goal lies in one.
        TableError: the scan has another number of ranges than the network takes.
    """
    start, end = Point(*pose[:2]), Point(*goal)
    wide = with_unseen_rim(grid, [start, end], _MARGIN_M)
    here, there = cell_at(wide, start), cell_at(wide, end)
    map_ = belief_of(wide, robot.radius_m)
    _require_sense(wide, map_, here, there, robot)
    scanned = _ranges(network, wide, here, pose[2], ranges)
    widen = round(robot.merge_m / (2.0 * wide.resolution))
    seen = Seen(map_, Pose(here.row, here.col, pose[2]), there, scanned, wide.resolution, 0, widen)
    around, metres = Surroundings(seen), wide.resolution
    remarks = made_differently(network.header.made_with, _present(robot, metres)) if network.header.made_with else []
    if around.goal_in_reach:
        flat = there.row * wide.cells.shape[1] + there.col
        way = around.reach.distance_to(np.array([flat], dtype=np.int32))[0] * metres
        return MapEstimate([], float(way), remarks)
    if not around.subgoals:
        return MapEstimate([], np.inf, remarks)
    found = network.estimate(seen, around, around.subgoals)
    order, cost, ways = _ordered(found, around, map_, metres, max_subgoals)
    return MapEstimate([_ranked(place, found, around, wide, ways) for place in order], cost, remarks)


def _ordered(
    found: Estimates, around: Surroundings, map_: PartialMap, metres: float, most: int
) -> tuple[list[int], float, NDArray[np.float64]]:
    """Return all places by rank, the expected cost of those that entered the ordering, and the optimistic ways [m]."""
    gates = around.gates
    reach, onward = around.reach.distance_to(gates) * metres, around.onward[gates] * metres
    kept = most_promising(found.p_success, reach + onward, most)
    best = order_subgoals(
        reach[kept],
        GateDistances(map_, around.work).between(gates[kept]) * metres,
        found.p_success[kept],
        onward[kept] + found.delta_success[kept],
        found.exploration[kept],
    )
    first = [int(kept[place]) for place in best.order]
    rest = sorted(set(range(gates.size)) - set(first), key=lambda place: (-found.p_success[place], place))
    return [*first, *rest], best.cost, reach + onward


def _ranked(
    place: int, found: Estimates, around: Surroundings, grid: OccupancyGrid, ways: NDArray[np.float64]
) -> RankedSubgoal:
    subgoal = around.subgoals[place]
    point = center_of(grid, Cell(*divmod(subgoal.point, grid.cells.shape[1])))
    return RankedSubgoal(
        point.x,
        point.y,
        p_success=float(found.p_success[place]),
        way_m=float(ways[place]),
        delta_success_m=float(found.delta_success[place]),
        exploration_m=float(found.exploration[place]),
        cells=subgoal.cells.size,
    )


def _ranges(
    network: LearnedEstimator, grid: OccupancyGrid, here: Cell, yaw: float, given: NDArray[np.floating] | None
) -> NDArray[np.float32]:
    """Return the scan for the network: the one given, or one made from the map; empty where it reads none."""
    if given is not None:
        return np.asarray(given, dtype=np.float32)
    if network.beams is None:
        return np.empty(0, dtype=np.float32)
    reach = float(network.header.made_with.get("sensor.max_range_m", _SCANNED_M))
    beams = -(-_BEAMS // network.beams) * network.beams
    walls = np.where(grid.cells == UNKNOWN, FREE, grid.cells).astype(np.uint8)
    walls[0], walls[-1], walls[:, 0], walls[:, -1] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    world = make_world("the map", OccupancyGrid(walls, grid.resolution, grid.origin), 0.0)
    look = Lidar(beams, network.beams, reach).observe(world, Pose(here.row, here.col, yaw), np.random.default_rng(0))
    scanned: NDArray[np.float32] = look.channels[RANGES]
    return scanned


def _require_sense(grid: OccupancyGrid, map_: PartialMap, here: Cell, there: Cell, robot: RobotConfig) -> None:
    at = center_of(grid, here)
    if grid.cells[here] != FREE or map_.status[here] == BLOCKED:
        what = {FREE: "within the robot's radius of an obstacle", OCCUPIED: "an obstacle", UNKNOWN: "not seen"}
        raise TrialError(
            f"the robot at ({at.x:.2f}, {at.y:.2f}) m stands where its map is {what[int(grid.cells[here])]}: expected "
            f"free floor for a radius of {robot.radius_m:g} m. Clear its footprint in the map, or give a smaller radius"
        )
    if map_.status[there] == BLOCKED:
        at = center_of(grid, there)
        raise TrialError(
            f"the goal at ({at.x:.2f}, {at.y:.2f}) m lies in an obstacle of the map or within the robot's radius of "
            "one: expected free or unseen floor"
        )


def _present(robot: RobotConfig, resolution: float) -> dict[str, Any]:
    return {
        "robot.radius_m": robot.radius_m,
        "robot.merge_m": robot.merge_m,
        "rasterize.resolution_m": round(resolution, 9),
    }
