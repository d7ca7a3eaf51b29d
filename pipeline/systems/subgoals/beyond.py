"""The true space that a robot has not reached, and distances in it from a frontier on.

U is the true traversable space that the robot cannot reach through known free space. It shrinks as the robot explores,
so the distances to the goal in it are repaired from step to step. A frontier lies in reached space: it is opened for
the moment of a question, and only the cells that this brings nearer to the goal are looked at.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.distances import (
    DIAGONAL,
    SHUT,
    Field,
    Indices,
    Status,
    Workspace,
    by_level,
    open_field,
    spread,
)
from pipeline.grids.fields import LiveField
from pipeline.grids.repair import best_way
from pipeline.grids.zones import REACHED
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Surroundings
from pipeline.simulation.world import World


class Beyond:
    """U of one trial, as it shrinks."""

    _taken: Status
    _to_goal: LiveField
    _open: Field
    _divisions: int
    _read: int

    def __init__(self, world: World, seen: Seen, around: Surroundings) -> None:
        """Look at the building ``world`` beyond what the robot at ``seen`` has reached."""
        self._world, self._around = world, around
        self._goal = seen.goal.row * world.blocked.shape[1] + seen.goal.col
        self._work = around.work
        self._overlay = overlay_for(world.blocked.size)
        self._start()

    def is_of(self, around: Surroundings) -> bool:
        """Whether this is the beyond of this very trial."""
        return around is self._around

    def follow(self) -> None:
        """Take in what was reached since."""
        around = self._around
        if around.divisions != self._divisions:
            self._start()
            return
        entered = around.entered[self._read :]
        self._read = around.entered.size
        self._taken.ravel()[entered] = 1
        self._to_goal.update(entered)
        self._open[entered] = SHUT

    def way_to_goal(self, frontier: Indices, point: int) -> float:
        """Return the shortest distance [cells] to the goal inside U and the frontier, inf if there is none.

        frontier: its flat cells. It starts at the flat cell ``point``; along the frontier itself distances are octile.
        """
        cols = self._taken.shape[1]
        return float(way_through(self._to_goal.values, cols, frontier, point, self._overlay))

    def extent(self, frontier: Indices, point: int) -> tuple[float, float]:
        """Return the smallest and the largest distance [cells] from ``point`` over the part of U beyond the frontier.

        Both are 0 where every way on turned out to be a wall.
        """
        return extent_of(self._open, self._taken.shape[1], frontier, point, self._work)

    def _start(self) -> None:
        around, shape = self._around, self._world.blocked.shape
        self._divisions, self._read = around.divisions, int(around.entered.size)
        taken = (self._world.blocked != 0) | (around.zones == REACHED).reshape(shape)
        self._taken: Status = taken.astype(np.uint8)
        self._to_goal = LiveField(self._taken, 0, self._goal, self._work)
        self._open = open_field(self._taken, 0)


class Overlay(NamedTuple):
    """Room for distances that hold during one question: lesser ones than the field's, in the cells noted.

    lesser: [cells] float64 of inf. waiting: [cells] uint8 of zeros. queue, noted: [cells] int32.
    """

    lesser: Field
    waiting: NDArray[np.uint8]
    queue: Indices
    noted: Indices


def overlay_for(cells: int) -> Overlay:
    """Return an overlay for a field of ``cells`` cells."""
    lesser, waiting = np.full(cells, np.inf), np.zeros(cells, dtype=np.uint8)
    return Overlay(lesser, waiting, np.empty(cells, dtype=np.int32), np.empty(cells, dtype=np.int32))


@njit(cache=True, nogil=True)
def way_through(field: Field, cols: int, frontier: Indices, point: int, over: Overlay) -> float:
    """Return the shortest way [cells] from ``point`` along the ``frontier``, then through the open cells of ``field``.

    field: distances to the goal, in which the frontier is SHUT; opened during the search.
    """
    for cell in frontier:
        field[cell] = np.inf
    noted, head, length = 0, 0, 0
    for cell in frontier:
        for move in range(9):  # the cell itself, and whom it now lets pass
            other = cell + (move // 3 - 1) * cols + move % 3 - 1
            if field[other] < 0.0:
                continue
            way = best_way(field, cols, other)
            if way < min(field[other], over.lesser[other]):
                if over.lesser[other] == np.inf:
                    over.noted[noted] = other
                    noted += 1
                over.lesser[other] = way
                length += _wait(over, head, length, other)
    while length > 0:
        cell = over.queue[head]
        head = (head + 1) % over.queue.size
        length -= 1
        over.waiting[cell] = 0
        here = over.lesser[cell]
        for move in range(9):
            drow, dcol = move // 3 - 1, move % 3 - 1
            other = cell + drow * cols + dcol
            if field[other] < 0.0 or field[cell + drow * cols] < 0.0 or field[cell + dcol] < 0.0:
                continue
            way = here + (DIAGONAL if drow != 0 and dcol != 0 else 1.0)
            if way < min(field[other], over.lesser[other]):
                if over.lesser[other] == np.inf:
                    over.noted[noted] = other
                    noted += 1
                over.lesser[other] = way
                length += _wait(over, head, length, other)
    shortest = np.inf
    for cell in frontier:
        shortest = min(shortest, _octile(point, cell, cols) + over.lesser[cell])
        field[cell] = SHUT
    for k in range(noted):
        over.lesser[over.noted[k]] = np.inf
    return shortest


@njit(cache=True, nogil=True)
def _wait(over: Overlay, head: int, length: int, cell: int) -> int:
    """Put ``cell`` into the queue; return 1, or 0 where it waits already."""
    if over.waiting[cell]:
        return 0
    over.waiting[cell] = 1
    over.queue[(head + length) % over.queue.size] = cell
    return 1


@njit(cache=True, nogil=True)
def extent_of(field: Field, cols: int, frontier: Indices, point: int, work: Workspace) -> tuple[float, float]:
    """Return the smallest and the largest distance [cells] from ``point`` over what the ``frontier`` opens on.

    field: an open one, in which the frontier is SHUT; left as it was. Both are 0 where it opens on nothing.
    """
    for cell in frontier:
        field[cell] = _octile(point, cell, cols)
    settled = spread(field, cols, by_level(field, frontier), frontier[:0], work, np.bool_(False))
    for cell in frontier:
        field[cell] = SHUT
    nearest, farthest = np.inf, -np.inf
    for cell in work.trail[:settled]:
        if field[cell] != SHUT:
            nearest, farthest = min(nearest, field[cell]), max(farthest, field[cell])
            field[cell] = np.inf
    return (nearest, farthest) if nearest <= farthest else (0.0, 0.0)


@njit(cache=True, nogil=True)
def _octile(one: int, other: int, cols: int) -> float:
    drow, dcol = abs(one // cols - other // cols), abs(one % cols - other % cols)
    return float(max(drow, dcol) + (DIAGONAL - 1.0) * min(drow, dcol))
