"""One loop for every planner: sense, decide, move, until the trial ends."""

from enum import StrEnum
from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.grids.distances import DIAGONAL
from pipeline.grids.occupancy import FREE, OCCUPIED, Cell, Cells
from pipeline.grids.partial_map import CLEAR, PartialMap, unseen_map
from pipeline.grids.raycast import block_around, insert_scan
from pipeline.planning.protocols import Planner
from pipeline.planning.seen import Pose, Seen
from pipeline.simulation.lidar import Lidar, robot_frame_ranges, sense
from pipeline.simulation.world import World, require_standing_room


class Ending(StrEnum):
    """How a trial ended, in a sentence."""

    REACHED = "reached the goal"
    UNREACHABLE = "no frontier is left that could lead to the goal: it cannot be reached"
    CUT_OFF = "step limit: the cost is only a lower bound, so no ratio is formed"


class Episode(NamedTuple):
    """A finished trial.

    ending: how it ended.
    travelled: distance really travelled [m].
    path: [k] int32 flat cells the robot's centre passed, from the start on.
    steps: number of scans; decisions: number of times the planner was asked.
    seconds: wall time of the whole loop [s].
    known: [rows, cols] uint8, the robot's map at the end.
    """

    ending: Ending
    travelled: float
    path: NDArray[np.int32]
    steps: int
    decisions: int
    seconds: float
    known: Cells


class _Stride(NamedTuple):
    pose: Pose
    travelled: float  # [cells]
    rest: NDArray[np.int32]  # of the path, from the robot's cell on; empty where something was touched
    passed: NDArray[np.int32]


def run_trial(
    world: World,
    start: Cell,
    goal: Cell,
    planner: Planner,
    *,
    lidar: Lidar,
    step_m: float,
    rng: np.random.Generator,
    merge_m: float = 0.0,
    max_steps: int | None = None,
) -> Episode:
    """Let ``planner`` drive a robot from ``start`` to ``goal`` in a world it has not seen.

    The planner is asked again only when a scan, or a touch, has changed the map. Between two decisions the map
    therefore grows by at least one cell, and every subgoal's cell borders a cell not yet seen, so a trial always
    ends, and a reachable goal is always reached, whatever an estimator says.

    step_m: distance between two scans [m], to the nearest cell on the path; at least one cell is moved.
    merge_m: frontiers less than this apart [m], by way of reached space, make one subgoal.
    max_steps: ends the trial as CUT_OFF; default 4 x the number of cells, which no planner of this project meets.

    Raises:
        TrialError: the robot cannot stand at the start, or the goal is outside the grid.
    """
    require_standing_room(world, start, "start")
    rows, cols = world.grid.cells.shape
    map_ = unseen_map(rows, cols)
    pose = Pose(start.row, start.col, 0.0)
    path: NDArray[np.int32] = np.empty(0, dtype=np.int32)
    track = [np.array([start.row * cols + start.col], dtype=np.int32)]
    travelled, decisions, began = 0.0, 0, perf_counter()
    ending, steps = Ending.CUT_OFF, 0
    widen = round(merge_m / (2.0 * world.grid.resolution))
    for step in range(max_steps or 4 * rows * cols):
        scan = sense(world, lidar, pose)
        fresh = insert_scan(map_.known, map_.status, pose.row, pose.col, lidar.directions, scan, world.disk)
        steps = step + 1
        if (pose.row, pose.col) == goal:
            ending = Ending.REACHED
            break
        if fresh or path.size < 2:
            ranges = robot_frame_ranges(lidar, scan.ranges, pose, world.grid.resolution, rng)
            chosen = planner.plan(Seen(map_, pose, goal, ranges, world.grid.resolution, step, widen))
            decisions += 1
            if chosen is None:
                ending = Ending.UNREACHABLE
                break
            path = chosen
        stride = _walk(path, map_, world, pose, step_m / world.grid.resolution)
        track.append(stride.passed)
        pose, path = stride.pose, stride.rest
        travelled += stride.travelled
    return Episode(
        ending,
        travelled * world.grid.resolution,
        np.concatenate(track),
        steps,
        decisions,
        perf_counter() - began,
        map_.known,
    )


def _walk(path: NDArray[np.int32], map_: PartialMap, world: World, pose: Pose, length: float) -> _Stride:
    """Follow ``path`` through space seen to be free for the cell nearest to ``length`` [cells], at least one.

    An obstacle that hid from the scan, such as the far side of a corner, stops the robot when its body would touch
    it; it then enters the map, and the planner is asked again.
    """
    cols = map_.status.shape[1]
    flat = map_.status.ravel()
    travelled, used = 0.0, 0
    row, col, heading = pose
    rest = path
    while used + 1 < path.size and flat[path[used + 1]] == CLEAR:
        next_row, next_col = divmod(int(path[used + 1]), cols)
        # A corner that was not yet seen may be a wall: the robot scans before it passes one.
        if flat[row * cols + next_col] != CLEAR or flat[next_row * cols + col] != CLEAR:
            break
        ahead = [(next_row, next_col), (row, next_col), (next_row, col)]
        if any(world.blocked[cell] for cell in ahead):
            for cell in ahead:
                _touch(map_, world, *cell)
            rest = path[:0]
            break
        move = DIAGONAL if next_row != row and next_col != col else 1.0
        if used and travelled + move - length > length - travelled + 1e-9:  # the nearer of the two ends
            break
        heading = float(np.arctan2(next_row - row, next_col - col) % (2.0 * np.pi))
        row, col = next_row, next_col
        travelled += move
        used += 1
    return _Stride(Pose(row, col, heading), travelled, rest[used:], path[1 : used + 1])


def _touch(map_: PartialMap, world: World, row: int, col: int) -> None:
    """Enter into the map every obstacle that a robot at (row, col) would touch."""
    rows, cols = world.grid.cells.shape
    around = world.disk + np.array([row, col], dtype=np.int32)
    inside = around[(around >= 0).all(axis=1) & (around < (rows, cols)).all(axis=1)]
    for obstacle in inside[world.grid.cells[inside[:, 0], inside[:, 1]] != FREE]:
        map_.known[tuple(obstacle)] = OCCUPIED
        block_around(map_.status, int(obstacle[0]), int(obstacle[1]), world.disk)
