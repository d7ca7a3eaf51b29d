"""Distance fields that live as long as a trial, and cost only what changed."""

import numpy as np

from pipeline.grids.distances import NOWHERE, Field, Indices, Status, Workspace, open_field, reopen, settle
from pipeline.grids.partial_map import CHANGES, PartialMap
from pipeline.grids.repair import GAVE_UP, repair

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
        if repair(self.values, self._status, self._limit, self._source, changed, most, self._work) == GAVE_UP:
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
        self.update(self._map.changes[self._read : written])
        self._read = written
        return self.values


class RovingField:
    """Travel distances [cells] from a source that moves, over the cells of a partial map with ``status <= limit``.

    Settled anew each time, but only as far as the targets, and only what was touched the time before is cleared.
    """

    def __init__(self, map_: PartialMap, limit: int, work: Workspace) -> None:
        """Make a field in which nothing is settled."""
        self._map, self._limit, self._read = map_, limit, int(map_.written[CHANGES])
        self._work = work._replace(trail=np.empty_like(work.trail))  # its trail must outlive the searches of others
        self._touched = 0
        self._values = open_field(map_.status, limit)

    def settle(self, source: int, targets: Indices) -> Field:
        """Return the distances from the flat cell ``source``, final at ``targets`` and up to there (all if none)."""
        written = int(self._map.written[CHANGES])
        changed = self._map.changes[self._read : written]
        reopen(self._values, self._map.status, self._limit, self._work.trail[: self._touched], changed)
        self._read = written
        self._touched = settle(self._values, self._map.status.shape[1], source, targets, self._work)
        return self._values
