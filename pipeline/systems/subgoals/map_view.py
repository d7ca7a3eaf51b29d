"""A subgoal as the robot's whole map shows it: every scan so far at once, where the paper takes the last scan alone.

Rather few buildings can be harvested, so a view holds what carries over from one to the next: how much farther than
the best way this one is, how wide the boundary is, whether space that was never seen leads on to the goal, and how
open the surroundings are in 32 directions. All directions are relative: 0 points from the subgoal to the goal, and the
scene is mirrored so that the frontier faces to the left, so a turned or mirrored building gives the same view.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from pipeline.datums import MAP_VIEW
from pipeline.grids.distances import NO_TARGETS, Field, Status, settle
from pipeline.grids.occupancy import OCCUPIED
from pipeline.grids.outlook import look_around
from pipeline.grids.partial_map import UNSEEN
from pipeline.grids.raycast import beam_directions
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings

Values = NDArray[np.float64]

DIRECTIONS: Final = 32
SIGHT_M: Final = 15.0  # how far a view looks in each direction
CLEARANCES_M: Final = (0.0, 0.45, 0.9)  # distance kept from known obstacles on the way through unseen space
FARTHEST_M: Final = 999.0  # stands for "no way"
NUMBERS: Final = (
    "reach_m",  # travel distance from the robot to the frontier, at the cell where the optimistic way crosses it
    "onward_m",  # optimistic travel distance from there to the goal
    "straight_m",  # straight distance from the subgoal to the goal
    "detour_m",  # onward_m - straight_m
    "behind_m",  # by how much the optimistic way through this frontier is longer than the shortest through any
    "lead_m",  # the same, against the shortest through any other: negative for the best
    "nearer",  # number of subgoals with a shorter optimistic way
    "rivals",  # number of subgoals
    "cells",  # size of the frontier
    "extent",  # its longer side in cells
    "facing",  # cosine of the angle between where the frontier faces and the goal
    "aside",  # absolute sine of that angle
    "depth",  # unseen cells around the frontier that lie to one side of it, for each of its cells
    *(f"beyond_{clearance}_m" for clearance in CLEARANCES_M),  # way to the goal through unseen space alone
    *(f"rival_beyond_{clearance}_m" for clearance in CLEARANCES_M),  # the shortest such way from another frontier
)
_PLAIN = slice(10, 13)  # numbers that are used as they are; of the others the logarithm
_LEAD = NUMBERS.index("lead_m")
_STRAIGHT = NUMBERS.index("straight_m")
_BEYOND, _RIVAL = slice(13, 16), slice(16, 19)
MAP_INPUTS: Final = MAP_VIEW + 2 * len(CLEARANCES_M)


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


def map_inputs(views: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return the network's input [N, MAP_INPUTS] float32 for ``views`` [N, MAP_VIEW].

    Distances and counts enter as logarithms, since a metre matters less the farther off it is; three detours and
    three leads of the ways through unseen space are added.
    """
    values = np.array(views, dtype=np.float64, ndmin=2)
    count = len(NUMBERS)
    numbers = _signed_log(values[:, :count])
    numbers[:, _PLAIN] = values[:, _PLAIN]
    detours = np.maximum(values[:, _BEYOND] - values[:, [_STRAIGHT]], 0.0)
    leads = values[:, _BEYOND] - values[:, _RIVAL]
    parts = [numbers, _signed_log(detours), _signed_log(leads), values[:, count:]]
    return np.concatenate(parts, axis=1).astype(np.float32)


def _gate(cells: NDArray[np.int32], reach: Values, onward: Values) -> int:
    """Return the frontier cell on the shortest optimistic way; of several the one nearest to the robot."""
    through = reach[cells] + onward[cells]
    shortest = cells[through <= through.min() + 1e-9]
    return int(shortest[np.argmin(reach[shortest])])


def _signed_log(values: Values) -> Values:
    logs: Values = np.sign(values) * np.log1p(np.abs(values))
    return logs


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
