"""Travel distances between frontiers, from one decision to the next.

Most frontiers lie where they lay, and what was seen since hardly concerns them. So a frontier that stays has a field of
its own, which is repaired; only those that are new need a search, and only as far as the other new ones.
"""

from collections import OrderedDict

import numpy as np

from pipeline.grids.distances import Field, Indices, Workspace, descend
from pipeline.grids.fields import MapField, RovingField
from pipeline.grids.partial_map import CLEAR, PartialMap

_KEPT = 24  # fields, those used last: each takes 8 bytes a cell


class GateDistances:
    """Distances through known free space between cells that are asked for again and again. Serves one map."""

    def __init__(self, map_: PartialMap, work: Workspace) -> None:
        """Know nothing yet of ``map_``."""
        self._map, self._work = map_, work
        self._cols = map_.status.shape[1]
        self._fields: OrderedDict[int, MapField] = OrderedDict()
        self._once: set[int] = set()  # asked for the last time, and without a field
        self._search = RovingField(map_, CLEAR, work)

    def between(self, gates: Indices) -> Field:
        """Return the distances [cells] between the flat cells ``gates``: [n, n] float64, symmetric, inf if apart."""
        cells: list[int] = gates.tolist()
        pairs = np.zeros((gates.size, gates.size))
        new = []
        for place, gate in enumerate(cells):
            field = self._field_of(gate)
            if field is None:
                new.append(place)
            else:
                pairs[place] = field[gates]
                pairs[:, place] = pairs[place]
        for k, place in enumerate(new[:-1]):
            others = np.array(new[k + 1 :])
            found = self._search.settle(cells[place], gates[others])[gates[others]]
            pairs[place, others], pairs[others, place] = found, found
        self._once = {cells[place] for place in new}
        return pairs

    def path_between(self, start: int, gate: int) -> Indices:
        """Return the flat cells of a shortest path from ``start`` to ``gate``: [k] int32."""
        kept = self._fields.get(gate)
        field = kept.catch_up() if kept is not None else self._search.settle(gate, np.array([start], dtype=np.int32))
        return descend(field, self._cols, start, gate)

    def _field_of(self, gate: int) -> Field | None:
        """Return the distances from ``gate``, or None for one that is met for the first time."""
        if gate in self._fields:
            self._fields.move_to_end(gate)
            return self._fields[gate].catch_up()
        if gate not in self._once:
            return None
        self._fields[gate] = MapField(self._map, CLEAR, gate, self._work)
        if len(self._fields) > _KEPT:
            self._fields.popitem(last=False)
        return self._fields[gate].values
