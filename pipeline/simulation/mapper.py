"""The partial map: each cell as it was first seen, and layers beside it where a sensor reads them."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.grids.partial_map import PartialMap, enter, unseen_map
from pipeline.planning.seen import CELLS, OCCUPANCY, Labelled, Observation

NOT_SEEN = -1


class PartialBelief(NamedTuple):
    """A partly seen map. layers: by name [rows, cols] int32 of the values seen, NOT_SEEN where none was."""

    map: PartialMap
    fresh: int
    layers: dict[str, NDArray[np.int32]]


class PartialMapper:
    """Enters exact observations into a partial map; one instance serves one trial."""

    def __init__(self, rows: int, cols: int, disk: NDArray[np.int32]) -> None:
        """Begin with nothing seen of ``rows`` x ``cols`` cells; ``disk`` as in `World`."""
        self.map, self.disk = unseen_map(rows, cols), disk
        self._layers: dict[str, NDArray[np.int32]] = {}

    def update(self, observation: Observation) -> PartialBelief:
        """Enter what was seen and return the belief."""
        channels = observation.channels
        fresh = enter(self.map, channels[CELLS], channels[OCCUPANCY], self.disk)
        for name, channel in channels.items():
            if isinstance(channel, Labelled):
                self._label(name, channel)
        return PartialBelief(self.map, fresh, self._layers)

    def _label(self, name: str, seen: Labelled) -> None:
        if name not in self._layers:
            self._layers[name] = np.full(self.map.known.shape, NOT_SEEN, dtype=np.int32)
        self._layers[name].ravel()[seen.cells] = seen.values


def contact(pose: Any, cells: NDArray[np.int32]) -> Observation:
    """Return the observation of a robot that touched the obstacle ``cells``."""
    return Observation(pose, {CELLS: cells, OCCUPANCY: np.ones(cells.size, dtype=np.uint8)})
