"""Distance fields that live as long as a trial, and cost only what changed."""

import numpy as np

from pipeline.grids.distances import (
    NOWHERE,
    Field,
    Indices,
    Status,
    Workspace,
    descend,
    open_field,
    reopen,
    settle,
    spread,
)
from pipeline.grids.partial_map import CHANGES, PartialMap
from pipeline.grids.repair import GAVE_UP, repair

_FAR = 2.0**16  # base to begin with: far above 0, and far enough below 2^18, up to where sums are exact
_SHARE = 4  # more than a quarter of the grid cleared: from there on it is quicker to begin anew


class LiveField:
    """Travel distances [cells] from one source over the cells with ``status <= limit``, true to their latest values.

    values: [cells] float64, see ``pipeline.grids.distances``. Read it, do not write into it.
    """

    def __init__(self, status: Status, limit: int, source: int, work: Workspace) -> None:
        """Settle the field. ``status`` [rows, cols] is kept and read again at each update."""
        self._status, self._limit, self._source, self._work = status, limit, source, work
        self.values: Field = self._anew()

    def update(self, changed: Indices) -> None:
        """Take in the flat cells ``changed``, whose status may differ from that of the last update."""
        if not changed.size:
            return
        most = self.values.size // _SHARE
        if repair(self.values, self._status, self._limit, self._source, 0.0, changed, most, self._work) == GAVE_UP:
            self.values = self._anew()

    def _anew(self) -> Field:
        values = open_field(self._status, self._limit)
        settle(values, self._status.shape[1], self._source, NOWHERE, self._work)
        return values


class MapField(LiveField):
    """A field over a partial map, which knows how much of the map's journal it has taken in."""

    def __init__(self, map_: PartialMap, limit: int, source: int, work: Workspace) -> None:
        """Settle the field from the flat cell ``source`` over what the map says now."""
        self._map, self._read = map_, int(map_.written[CHANGES])
        super().__init__(map_.status, limit, source, work)

    def catch_up(self) -> Field:
        """Take in what was seen since, and return the values."""
        written = int(self._map.written[CHANGES])
        if written > self._read:
            self.update(self._map.changes[self._read : written])
            self._read = written
        return self.values


class RovingField:
    """Travel distances [cells] from a source that moves, over the cells of a partial map with ``status <= limit``.

    Settled anew each time, but only as far as the targets, and only what was touched the time before is cleared.

    touched: how many cells the last search gave a distance.
    """

    def __init__(self, map_: PartialMap, limit: int, work: Workspace) -> None:
        """Make a field in which nothing is settled."""
        self._map, self._limit, self._read = map_, limit, int(map_.written[CHANGES])
        self._work = work._replace(trail=np.empty_like(work.trail))  # its trail must outlive the searches of others
        self.touched = 0
        self._values = open_field(map_.status, limit)

    def settle(self, source: int, targets: Indices) -> Field:
        """Return the distances from the flat cell ``source``, final at ``targets`` and up to there (all if none)."""
        written = int(self._map.written[CHANGES])
        changed = self._map.changes[self._read : written]
        reopen(self._values, self._map.status, self._limit, self._work.trail[: self.touched], changed)
        self._read = written
        self.touched = settle(self._values, self._map.status.shape[1], source, targets, self._work)
        return self._values


class RobotField:
    """Travel distances [cells] from a robot that moves, over the cells of a partial map with ``status <= limit``.

    What lies behind the robot gets farther by just as much as it moved. So values are kept beside a base, the value of
    the robot's own cell, which falls with every move: only what is nearer now than by way of where the robot was is
    spread anew.

    values: [cells] float64, distance plus ``base``; inf and SHUT as in ``pipeline.grids.distances``.
    """

    values: Field
    base: float
    robot: int
    _read: int

    def __init__(self, map_: PartialMap, limit: int, robot: int, work: Workspace) -> None:
        """Settle the field from the flat cell ``robot``."""
        self._map, self._limit, self._work = map_, limit, work
        self._cols = map_.status.shape[1]
        self._begin(robot)

    def move(self, robot: int) -> None:
        """Take in what was seen since and where the robot is now."""
        map_, written = self._map, int(self._map.written[CHANGES])
        changed = map_.changes[self._read : written]
        self._read = written
        most = self.values.size // _SHARE
        if repair(self.values, map_.status, self._limit, self.robot, self.base, changed, most, self._work) == GAVE_UP:
            self._begin(robot)
        elif robot != self.robot:
            base = 2.0 * self.base - float(self.values[robot])
            if not 0.0 <= base <= self.base:  # the robot is where it could not get to, or has moved very far
                self._begin(robot)
                return
            self.robot, self.base = robot, base
            seed = np.array([robot], dtype=np.int32)
            self.values[robot] = base
            spread(self.values, self._cols, seed, NOWHERE, self._work, np.bool_(True))

    def distance_to(self, cells: Indices) -> Field:
        """Return the distances [cells] to the flat ``cells``."""
        distances: Field = self.values[cells] - self.base
        return distances

    def path_to(self, cell: int) -> Indices:
        """Return the flat cells of a shortest path from the robot to ``cell``: [k] int32, empty if there is none."""
        return descend(self.values, self._cols, cell, self.robot)[::-1].copy()

    def _begin(self, robot: int) -> None:
        self.robot, self.base, self._read = robot, _FAR, int(self._map.written[CHANGES])
        self.values = open_field(self._map.status, self._limit)
        if self.values[robot] == np.inf:
            self.values[robot] = self.base
            seed = np.array([robot], dtype=np.int32)
            spread(self.values, self._cols, seed, NOWHERE, self._work, np.bool_(False))
