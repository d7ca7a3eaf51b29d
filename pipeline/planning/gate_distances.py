"""Travel distances between frontiers, from one decision to the next.

Most frontiers lie where they lay, and what was seen since hardly concerns them. So a frontier that stays has a field of
its own, which is repaired. One that is new has a search, as far as the other new ones, which are mostly near; once its
searches have cost a good part of what a field does, it is given one.
"""

from collections import OrderedDict

import numpy as np

from pipeline.grids.distances import Field, Indices, Workspace, descend
from pipeline.grids.fields import MapField, RovingField
from pipeline.grids.partial_map import CHANGES, CLEAR, PartialMap

_KEPT = 16  # fields at least, those used last: each takes 8 bytes a cell
_SHARE = 0.3  # of the cells that a field settles, after which one is made; 0 to 1 make little difference


class GateDistances:
    """Distances through known free space between cells that are asked for again and again. Serves one map."""

    def __init__(self, map_: PartialMap, work: Workspace) -> None:
        """Know nothing yet of ``map_``."""
        self._map, self._work = map_, work
        self._cols = map_.status.shape[1]
        self._fields: OrderedDict[int, MapField] = OrderedDict()
        self._spent: dict[int, int] = {}  # cells that searches from a gate without a field have touched
        self._search = RovingField(map_, CLEAR, work)

    def between(self, gates: Indices) -> Field:
        """Return the distances [cells] between the flat cells ``gates``: [n, n] float64, symmetric, inf if apart."""
        cells: list[int] = gates.tolist()
        pairs = np.zeros((gates.size, gates.size))
        searched = []
        for place, gate in enumerate(cells):
            field = self._field_of(gate)
            if field is None:
                searched.append(place)
            else:
                pairs[place] = field[gates]
                pairs[:, place] = pairs[place]
        for k, place in enumerate(searched[:-1]):
            others = np.array(searched[k + 1 :])
            found = self._search.settle(cells[place], gates[others])[gates[others]]
            pairs[place, others], pairs[others, place] = found, found
            self._spent[cells[place]] = self._spent.get(cells[place], 0) + self._search.touched
        self._spent = {gate: cost for gate, cost in self._spent.items() if gate in cells}
        self._drop(max(_KEPT, gates.size))
        return pairs

    def path_between(self, start: int, gate: int) -> Indices:
        """Return the flat cells of a shortest path from ``start`` to ``gate``: [k] int32."""
        kept = self._fields.get(gate)
        field = kept.catch_up() if kept is not None else self._search.settle(gate, np.array([start], dtype=np.int32))
        return descend(field, self._cols, start, gate)

    def _field_of(self, gate: int) -> Field | None:
        """Return the distances from ``gate``, or None if they are not worth having yet."""
        kept = self._fields.get(gate)
        if kept is not None:
            self._fields.move_to_end(gate)
            return kept.catch_up()
        settled = int(self._map.written[CHANGES])  # by a field, about: the cells that were seen
        if gate not in self._spent or self._spent[gate] < _SHARE * settled:
            return None
        del self._spent[gate]
        self._fields[gate] = MapField(self._map, CLEAR, gate, self._work)
        return self._fields[gate].values

    def _drop(self, most: int) -> None:
        while len(self._fields) > most:
            self._fields.popitem(last=False)
