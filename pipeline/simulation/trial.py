"""One loop for every planner: sense, decide, move, until the trial ends."""

from collections.abc import Callable
from enum import StrEnum
from time import perf_counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import TrialError
from pipeline.grids.occupancy import Cell, Cells
from pipeline.grids.partial_map import unseen_map
from pipeline.planning.protocols import Planner
from pipeline.planning.seen import Pose, Seen
from pipeline.simulation.answers import check_surrender, checked_path, never_moves
from pipeline.simulation.lidar import Lidar, beams_in, robot_frame_ranges, sense
from pipeline.simulation.motion import pose_after, walk
from pipeline.simulation.world import World, require_inside, require_standing_room


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
    seconds: wall time of the loop [s]: sensing, deciding and moving, without what was done ``aside``.
    known: [rows, cols] uint8, the robot's map at the end.
    """

    ending: Ending
    travelled: float
    path: NDArray[np.int32]
    steps: int
    decisions: int
    seconds: float
    known: Cells


def require_possible(episode: Episode, known_map_m: float, by: str) -> None:
    """Check that ``episode`` did not reach the goal by less than the shortest way in the true map.

    known_map_m: ``known_map_distance`` of its start and goal [m]. by: whose episode, for the message.

    Raises:
        TrialError: it did, so that one of the two belongs to another map, robot, start or goal.
    """
    if episode.ending is Ending.REACHED and episode.travelled < known_map_m - 1e-6:
        raise TrialError(
            f"{by}: reached the goal after {episode.travelled:.3f} m, less than the shortest way in the true map, "
            f"{known_map_m:.3f} m. The pairs belong to other grids or another robot.radius_m: rasterize again."
        )


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
    aside: Callable[[], None] | None = None,
) -> Episode:
    """Let ``planner`` drive a robot from ``start`` to ``goal`` in a world it has not seen.

    The planner is asked again only when a scan, or a touch, has changed the map. Between two decisions the map
    therefore grows by at least one cell, and every subgoal's cell borders a cell not yet seen, so a trial always
    ends, and a reachable goal is always reached, whatever an estimator says. Every path is checked before the robot
    follows it, and so is the claim that the goal cannot be reached.

    step_m: distance between two scans [m], to the nearest cell on the path; at least one cell is moved.
    merge_m: frontiers less than this apart [m], by way of reached space, make one subgoal.
    max_steps: ends the trial as CUT_OFF; default 4 x the number of cells, which no planner of this project meets.
    aside: called after each decision, for whoever keeps records; the robot's clock stands meanwhile.

    Raises:
        TrialError: the robot cannot stand at the start, or the goal is outside the grid.
        PlannerError: an answer of the planner is no path to set out on, or gives up a goal that may be in reach.
    """
    require_standing_room(world, start, "start")
    require_inside(world, goal, "goal")
    by = f"{type(planner).__name__} on {world.name}"
    rows, cols = world.grid.cells.shape
    map_, beams, step_cells = unseen_map(rows, cols), beams_in(world, lidar), step_m / world.grid.resolution
    pose = Pose(start.row, start.col, 0.0)
    path: NDArray[np.int32] = np.empty(0, dtype=np.int32)
    track = [np.array([start.row * cols + start.col], dtype=np.int32)]
    travelled, decisions, paused, began = 0.0, 0, 0.0, perf_counter()
    ending, steps = Ending.CUT_OFF, 0
    widen = round(merge_m / (2.0 * world.grid.resolution))
    for step in range(max_steps or 4 * rows * cols):
        exact, fresh = sense(world, beams, map_, pose)
        steps = step + 1
        if (pose.row, pose.col) == goal:
            ending = Ending.REACHED
            break
        if fresh or path.size < 2:
            ranges = robot_frame_ranges(lidar, exact, pose, world.grid.resolution, rng)
            seen = Seen(map_, pose, goal, ranges, world.grid.resolution, step, widen)
            chosen = planner.plan(seen)
            decisions += 1
            if aside is not None:
                stopped = perf_counter()
                aside()
                paused += perf_counter() - stopped
            if chosen is None:
                check_surrender(seen, by)
                ending = Ending.UNREACHABLE
                break
            path = checked_path(chosen, seen, by)
        moves, length, touched = walk(path, map_, world.grid.cells, world.blocked, world.disk, step_cells)
        if moves == 0 and not touched:
            raise never_moves(Seen(map_, pose, goal, ranges, world.grid.resolution, step, widen), by)
        track.append(path[1 : moves + 1])
        pose = pose_after(path, moves, pose, cols)
        path = path[:0] if touched else path[moves:]
        travelled += length
    return Episode(
        ending,
        travelled * world.grid.resolution,
        np.concatenate(track),
        steps,
        decisions,
        perf_counter() - began - paused,
        map_.known,
    )
