"""A subgoal as the robot's whole map shows it: every scan so far at once, where the paper takes the last scan alone.

All directions are relative: 0 points from the subgoal to the goal, and the scene is mirrored so that the frontier faces
to the left, so a turned or mirrored building gives the same view.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from pipeline.grids.distances import NO_TARGETS, Field, Status, settle
from pipeline.grids.occupancy import OCCUPIED
from pipeline.grids.outlook import look_around
from pipeline.grids.partial_map import UNSEEN
from pipeline.grids.raycast import beam_directions
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings
from pipeline.systems.subgoals.map_inputs import (
    CLEARANCES_M,
    DIRECTIONS,
    FARTHEST_M,
    MAP_VIEW,
    SIGHT_M,
)

Values = NDArray[np.float64]


def view_map(seen: Seen, around: Surroundings, subgoals: Sequence[Subgoal]) -> NDArray[np.float32]:
    """Return one view of each of ``subgoals``: [n, MAP_VIEW] float32.

    A view is the NUMBERS, then the three rows of `look_around` [m] for the DIRECTIONS. ``around`` holds all subgoals
    of this step, ``subgoals`` those asked for.
    """
    status, metres = seen.map.status, seen.resolution
    goal = seen.goal.row * status.shape[1] + seen.goal.col
    optimistic = settle(status, UNSEEN, goal, NO_TARGETS)
    beyond = _ways_beyond(seen, around)
    reach, onward = around.reach.ravel(), optimistic.ravel()
    through = np.array([(reach[each.cells] + onward[each.cells]).min() for each in around.subgoals]) * metres
    places = {subgoal.key: place for place, subgoal in enumerate(around.subgoals)}
    views = np.empty((len(subgoals), MAP_VIEW), dtype=np.float32)
    for k, subgoal in enumerate(subgoals):
        place = places[subgoal.key]
        gate = _gate(subgoal.cells, reach, onward)
        others = np.delete(np.arange(len(through)), place)
        rival = beyond[others].min(axis=0) if others.size else np.full(len(CLEARANCES_M), FARTHEST_M)
        lead = through[place] - (through[others].min() if others.size else through[place] + FARTHEST_M)
        shape, outlook = _look_at(seen, around, subgoal, goal)
        straight = _straight(subgoal.point, goal, status.shape[1]) * metres
        views[k] = np.concatenate(
            [
                [reach[gate] * metres, onward[gate] * metres, straight, onward[gate] * metres - straight],
                [through[place] - through.min(), lead, (through < through[place] - 1e-9).sum(), len(through)],
                shape,
                beyond[place],
                rival,
                outlook.ravel() * metres,
            ]
        )
    return views


def _gate(cells: NDArray[np.int32], reach: Values, onward: Values) -> int:
    """Return the frontier cell on the shortest optimistic way; of several the one nearest to the robot."""
    through = reach[cells] + onward[cells]
    shortest = cells[through <= through.min() + 1e-9]
    return int(shortest[np.argmin(reach[shortest])])


def _straight(cell: int, goal: int, cols: int) -> float:
    return float(np.hypot(cell // cols - goal // cols, cell % cols - goal % cols))


def _ways_beyond(seen: Seen, around: Surroundings) -> Values:
    """Return the way from each subgoal to the goal through unseen space alone [m]: [subgoals, CLEARANCES_M].

    Unseen space is what is neither reached nor known to be blocked. Narrow gaps between seen obstacles are seldom real
    ways on: cells within a clearance of one are closed, except around the goal. Frontier cells are open.
    """
    rows, cols = seen.map.status.shape
    goal = seen.goal.row * cols + seen.goal.col
    frontiers = np.concatenate([subgoal.cells for subgoal in around.subgoals])
    unseen = np.isinf(around.reach) & (seen.map.status <= UNSEEN)
    clear_by = distance_transform_edt(seen.map.known != OCCUPIED)
    found = np.empty((len(around.subgoals), len(CLEARANCES_M)))
    for k, clearance in enumerate(CLEARANCES_M):
        keep = clearance / seen.resolution + 1e-9
        open_ = unseen & (clear_by > keep)
        span = int(keep + 1.5)
        window = (
            slice(max(0, seen.goal.row - span), min(rows, seen.goal.row + span + 1)),
            slice(max(0, seen.goal.col - span), min(cols, seen.goal.col + span + 1)),
        )
        near_rows, near_cols = np.ogrid[window]
        at_goal = np.hypot(near_rows - seen.goal.row, near_cols - seen.goal.col) <= keep + 1.5
        open_[window] |= unseen[window] & at_goal
        open_.ravel()[frontiers] = True
        open_[[0, -1]] = False
        open_[:, [0, -1]] = False
        field = settle((~open_).astype(np.uint8), 0, goal, frontiers).ravel()
        found[:, k] = [field[subgoal.cells].min() for subgoal in around.subgoals]
    ways: Values = np.minimum(found * seen.resolution, FARTHEST_M)
    return ways


def _look_at(seen: Seen, around: Surroundings, subgoal: Subgoal, goal: int) -> tuple[Values, Values]:
    """Return (cells, extent, facing, aside, depth) of a frontier and the outlook [3, DIRECTIONS] in cells."""
    cols = seen.map.status.shape[1]
    rows, columns = np.divmod(subgoal.cells, cols)
    extent = max(int(np.ptp(rows)), int(np.ptp(columns))) + 1
    dx, dy = _outward(seen.map.status, around.reach, subgoal.cells)
    row, col = divmod(subgoal.point, cols)
    towards = np.arctan2(goal // cols - row, goal % cols - col)
    angle = np.arctan2(dy, dx) - towards
    mirrored = 1.0 if np.sin(angle) >= 0.0 else -1.0
    lines = beam_directions(DIRECTIONS) * (1.0, mirrored)
    turn = np.array([[np.cos(towards), np.sin(towards)], [-np.sin(towards), np.cos(towards)]])
    outlook = look_around(seen.map.known, row, col, lines @ turn, SIGHT_M / seen.resolution)
    depth = np.hypot(dx, dy) / subgoal.cells.size
    return np.array([subgoal.cells.size, extent, np.cos(angle), abs(np.sin(angle)), depth]), outlook


@njit(cache=True, nogil=True)
def _outward(status: Status, reach: Field, cells: NDArray[np.int32]) -> tuple[float, float]:
    """Return the sum of the offsets (x, y) from frontier cells to cells beyond, up to two away [cells]."""
    rows, cols = status.shape
    x, y = 0.0, 0.0
    for cell in cells:
        row, col = cell // cols, cell % cols
        for r in range(max(0, row - 2), min(rows, row + 3)):
            for c in range(max(0, col - 2), min(cols, col + 3)):
                if status[r, c] <= UNSEEN and reach[r, c] == np.inf:
                    x += c - col
                    y += r - row
    return x, y
