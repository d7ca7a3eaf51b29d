"""A subgoal as the robot's whole map shows it: every scan so far at once, where the paper takes the last scan alone.

All directions are relative: 0 points from the subgoal to the goal, and the scene is mirrored so that the frontier faces
to the left, so a turned or mirrored building gives the same view.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.beams import beam_directions
from pipeline.grids.distances import Field, Indices, Status
from pipeline.grids.outlook import look_around
from pipeline.grids.partial_map import UNSEEN
from pipeline.grids.zones import REACHED, Zones
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings
from pipeline.systems.subgoals.map_inputs import (
    CLEARANCES_M,
    DIRECTIONS,
    FARTHEST_M,
    MAP_VIEW,
    NUMBERS,
    SIGHT_M,
)
from pipeline.systems.subgoals.unseen_ways import UnseenWays

_LINES = beam_directions(DIRECTIONS)
_SHAPE, _BEYOND, _OUTLOOK = NUMBERS.index("cells"), len(NUMBERS) - 2 * len(CLEARANCES_M), len(NUMBERS)


class MapViews:
    """Makes the views of one trial's subgoals, step by step."""

    def __init__(self, seen: Seen, around: Surroundings) -> None:
        """Begin with the map of ``seen`` as it is; ``around`` are its surroundings, kept up to date by their owner."""
        self._around = around
        self._ways = UnseenWays(seen, around, CLEARANCES_M)

    def are_of(self, around: Surroundings) -> bool:
        """Whether these are the views of this very trial."""
        return around is self._around

    def views(self, seen: Seen, subgoals: Sequence[Subgoal]) -> NDArray[np.float32]:
        """Return one view of each of ``subgoals``, which are among those around: [n, MAP_VIEW] float32.

        A view is the NUMBERS, then the three rows of `look_around` [m] for the DIRECTIONS.
        """
        around, metres = self._around, seen.resolution
        goal = seen.goal.row * seen.map.status.shape[1] + seen.goal.col
        places = {subgoal.key: place for place, subgoal in enumerate(around.subgoals)}
        asked = np.array([places[subgoal.key] for subgoal in subgoals], dtype=np.int64)
        points = np.array([subgoal.point for subgoal in subgoals], dtype=np.int64)
        beyond = np.minimum(self._ways.lengths() * metres, FARTHEST_M)
        views = np.empty((len(subgoals), MAP_VIEW))
        reach = around.reach
        _compare(views, asked, around.cells, around.starts, reach.values, reach.base, around.onward, beyond, metres)
        _look(views, asked, points, around.cells, around.starts, seen.map.known, seen.map.status, around.zones, goal,
              metres, _LINES)  # fmt: skip
        return views.astype(np.float32)


@njit(cache=True, nogil=True)
def _compare(
    views: Field,
    asked: NDArray[np.int64],
    cells: Indices,
    starts: Indices,
    reach: Field,
    base: float,
    onward: Field,
    beyond: Field,
    metres: float,
) -> None:
    """Fill in the lengths of the ways and how they compare with those through the other frontiers.

    cells, starts: all frontiers around; asked: [n] their places. beyond: [frontiers, clearances] m.
    reach, onward: distances [cells] from the robot, plus ``base``, and to the goal.
    """
    gates, through = _gates(cells, starts, reach, base, onward)
    through = through * metres
    for k in range(asked.size):
        place, view = asked[k], views[k]
        lead, rank = -FARTHEST_M, 0
        rival = np.full(beyond.shape[1], FARTHEST_M)
        nearest = through[place]
        for other in range(through.size):
            nearest = min(nearest, through[other])
            rank += int(through[other] < through[place] - 1e-9)
            if other != place:
                lead = max(lead, through[place] - through[other])
                for clearance in range(rival.size):
                    rival[clearance] = min(rival[clearance], beyond[other, clearance])
        view[0], view[1] = (reach[gates[place]] - base) * metres, onward[gates[place]] * metres
        view[4], view[5], view[6], view[7] = through[place] - nearest, lead, rank, through.size
        view[_BEYOND : _BEYOND + rival.size] = beyond[place]
        view[_BEYOND + rival.size : _OUTLOOK] = rival


@njit(cache=True, nogil=True)
def _gates(cells: Indices, starts: Indices, reach: Field, base: float, onward: Field) -> tuple[Indices, Field]:
    """Return of each frontier the cell on the shortest optimistic way, of several the nearest, and the way's length."""
    gates, through = np.empty(starts.size - 1, dtype=np.int32), np.full(starts.size - 1, np.inf)
    for group in range(gates.size):
        for cell in cells[starts[group] : starts[group + 1]]:
            way = reach[cell] - base + onward[cell]
            if way < through[group] or (way == through[group] and reach[cell] < reach[gates[group]]):
                gates[group], through[group] = cell, way
    return gates, through


@njit(cache=True, nogil=True)
def _look(
    views: Field,
    asked: NDArray[np.int64],
    points: NDArray[np.int64],
    cells: Indices,
    starts: Indices,
    known: Status,
    status: Status,
    zones: Zones,
    goal: int,
    metres: float,
    lines: Field,
) -> None:
    """Fill in where each frontier lies and faces, and how open the map is around it."""
    cols = known.shape[1]
    turned = np.empty_like(lines)
    for k in range(asked.size):
        frontier, view = cells[starts[asked[k]] : starts[asked[k] + 1]], views[k]
        row, col = points[k] // cols, points[k] % cols
        up, right = goal // cols - row, goal % cols - col
        view[2] = np.hypot(up, right) * metres
        view[3] = view[1] - view[2]
        dx, dy = _outward(status, zones, frontier)
        towards = np.arctan2(up, right)
        angle = np.arctan2(dy, dx) - towards
        view[_SHAPE] = frontier.size
        view[_SHAPE + 1] = max(np.ptp(frontier // cols), np.ptp(frontier % cols)) + 1
        view[_SHAPE + 2], view[_SHAPE + 3] = np.cos(angle), abs(np.sin(angle))
        view[_SHAPE + 4] = np.hypot(dx, dy) / frontier.size
        mirrored = 1.0 if np.sin(angle) >= 0.0 else -1.0
        cos, sin = np.cos(towards), np.sin(towards)
        for line in range(lines.shape[0]):
            x, y = lines[line, 0], lines[line, 1] * mirrored
            turned[line, 0], turned[line, 1] = x * cos - y * sin, x * sin + y * cos
        view[_OUTLOOK:] = look_around(known, row, col, turned, SIGHT_M / metres).ravel() * metres


@njit(cache=True, nogil=True)
def _outward(status: Status, zones: Zones, cells: Indices) -> tuple[float, float]:
    """Return the sum of the offsets (x, y) from frontier cells to cells beyond, up to two away [cells]."""
    rows, cols = status.shape
    x, y = 0.0, 0.0
    for cell in cells:
        row, col = cell // cols, cell % cols
        for r in range(max(0, row - 2), min(rows, row + 3)):
            for c in range(max(0, col - 2), min(cols, col + 3)):
                if status[r, c] <= UNSEEN and zones[r * cols + c] != REACHED:
                    x += c - col
                    y += r - row
    return x, y
