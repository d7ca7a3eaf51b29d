"""A look all around that is entered into the map while it is cast: what `Lidar` and `PartialMapper` do, in one go.

Most looks of most trials are such; apart, they made whole trials of cheap planners a quarter slower.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from pipeline.grids.raycast import Ranges, scan, scan_into
from pipeline.planning.seen import CELLS, OCCUPANCY, RANGES, Belief, Observation, Pose
from pipeline.simulation.lidar import Lidar, beams_in
from pipeline.simulation.mapper import PartialBelief, PartialMapper
from pipeline.simulation.protocols import Mapper, Sensor
from pipeline.simulation.world import World

_NAMES = (CELLS, OCCUPANCY, RANGES)


class Sweep(Mapping[str, Any]):
    """The channels of an exact look. Few ask for its cells, so they are listed when somebody does."""

    def __init__(self, world: World, lidar: Lidar, pose: Pose, ranges: Ranges) -> None:
        self._of, self._made = (world, lidar, pose, ranges), dict[str, Any]()

    def __getitem__(self, name: str) -> Any:
        """Return a channel."""
        if name not in self._made:
            world, lidar, pose, ranges = self._of
            if name == RANGES:
                self._made[RANGES] = lidar.ahead(ranges, pose, world.grid.resolution)
            elif name in _NAMES:
                beams = beams_in(world, lidar)
                _, *found = scan(world.grid.cells, pose.row, pose.col, beams, 0, lidar.beams)
                self._made[CELLS], self._made[OCCUPANCY] = found
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        """Go through the names."""
        return iter(_NAMES)

    def __len__(self) -> int:
        """Return how many channels there are."""
        return len(_NAMES)


def sweep_with(sensor: Sensor, mapper: Mapper, world: World) -> Callable[[Pose], tuple[Observation, Belief]] | None:
    """Return what looks from a pose and enters what is seen: ``sensor.observe``, then ``mapper.update``.

    None where the two are not the parts that this stands for.
    """
    if type(sensor) is not Lidar or not sensor.exact or type(mapper) is not PartialMapper:
        return None
    beams, map_, disk, truth = beams_in(world, sensor), mapper.map, mapper.disk, world.grid.cells

    def sweep(pose: Pose) -> tuple[Observation, Belief]:
        ranges, fresh = scan_into(truth, map_, pose.row, pose.col, beams, disk)
        return Observation(pose, Sweep(world, sensor, pose, ranges)), PartialBelief(map_, fresh, {})

    return sweep
