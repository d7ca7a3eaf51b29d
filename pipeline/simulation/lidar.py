"""A planar lidar that sees all around, or a fan of beams about the robot's heading."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.errors import ConfigError
from pipeline.grids.beams import BeamTree, beam_tree
from pipeline.grids.raycast import Ranges, scan
from pipeline.planning.seen import CELLS, OCCUPANCY, RANGES, Labelled, Observation, Pose
from pipeline.simulation.world import World

ALL_AROUND = 2.0 * np.pi


class Lidar(NamedTuple):
    """A range sensor. It looks from the centre of the cell that the robot stands in.

    beams: how many equally spaced ones a full circle has; the first along +x, counter-clockwise. Those within the
        field of view are cast.
    input_beams: how many equally spaced ones of a full circle a planner's network receives.
    max_range: [m].
    noise: standard deviation [m] of the ranges that planners receive; the map is updated without noise.
    field_of_view: [rad], the heading in its middle.
    layers: names of layers of the world whose values are read wherever a beam passes or ends.
    """

    beams: int
    input_beams: int
    max_range: float
    noise: float = 0.0
    field_of_view: float = ALL_AROUND
    layers: tuple[str, ...] = ()

    @property
    def reach_m(self) -> float:
        """How far it sees [m]."""
        return self.max_range

    def observe(self, world: World, pose: Pose, rng: np.random.Generator) -> Observation:
        """Return what the beams meet: CELLS, OCCUPANCY, RANGES, and each of its layers."""
        first, count = self._fan(pose.heading)
        ranges, cells, occupancy = scan(world.grid.cells, pose.row, pose.col, beams_in(world, self), first, count)
        seen: dict[str, Any] = {
            CELLS: cells,
            OCCUPANCY: occupancy,
            RANGES: self._in_robot_frame(ranges, pose, world.grid.resolution, rng),
        }
        for name in self.layers:
            seen[name] = Labelled(cells, world.layer(name).ravel()[cells])
        return Observation(pose, seen)

    @property
    def exact(self) -> bool:
        """Whether a look is a function of the place alone: all around, without noise, without layers."""
        return self.noise <= 0.0 and self.field_of_view >= ALL_AROUND and not self.layers

    def _fan(self, heading: float) -> tuple[int, int]:
        """Return the first beam within the field of view and how many are."""
        if self.field_of_view >= ALL_AROUND:
            return 0, self.beams
        spacing, half = ALL_AROUND / self.beams, self.field_of_view / 2.0
        first, last = np.ceil((heading - half) / spacing - 1e-9), np.floor((heading + half) / spacing + 1e-9)
        return int(first) % self.beams, int(last - first) + 1

    def _in_robot_frame(
        self, ranges: Ranges, pose: Pose, resolution: float, rng: np.random.Generator
    ) -> NDArray[np.float32]:
        """Return [input_beams] float32 ranges [m], beam 0 along the heading, noise added, 0 out of view."""
        turn = self._turn(pose)
        if self.noise <= 0.0 and self.field_of_view >= ALL_AROUND:
            return self.ahead(ranges, pose, resolution)
        every = self.beams // self.input_beams
        ahead = np.concatenate((ranges[turn:], ranges[:turn]))[::every] * resolution
        if self.noise > 0.0:
            ahead = np.clip(ahead + rng.normal(0.0, self.noise, ahead.size), 0.0, self.max_range)
        if self.field_of_view < ALL_AROUND:
            angle = ALL_AROUND / self.input_beams * np.arange(self.input_beams)
            ahead[np.minimum(angle, ALL_AROUND - angle) > self.field_of_view / 2.0 + 1e-9] = 0.0
        return ahead.astype(np.float32)

    def _turn(self, pose: Pose) -> int:
        """Return the beam straight ahead."""
        return round(pose.heading / ALL_AROUND * self.beams) % self.beams

    def ahead(self, ranges: Ranges, pose: Pose, resolution: float) -> NDArray[np.float32]:
        """Return what a planner receives of the ranges [cells] of an exact look: [input_beams] float32 [m]."""
        return _turned(ranges, self._turn(pose), self.input_beams, resolution)


@njit(cache=True, nogil=True)
def _turned(ranges: Ranges, turn: int, count: int, resolution: float) -> NDArray[np.float32]:
    """Return ``count`` of the ranges [cells] in metres, evenly spaced, the one at ``turn`` first: [count] float32."""
    ahead = np.empty(count, dtype=np.float32)
    every = ranges.size // count
    for k in range(count):
        ahead[k] = np.float32(ranges[(turn + k * every) % ranges.size] * resolution)
    return ahead


def make_lidar(
    *,
    beams: int,
    input_beams: int,
    max_range_m: float,
    noise_m: float = 0.0,
    field_of_view_deg: float = 360.0,
    layers: Sequence[str] = (),
) -> Lidar:
    """Return a lidar. Headings are mostly multiples of 45 degrees, so both counts must be multiples of 8.

    Raises:
        ConfigError: the counts do not divide evenly.
    """
    if input_beams % 8 or beams % input_beams:
        raise ConfigError(
            f"sensor.beams = {beams}, sensor.input_beams = {input_beams}: input_beams must be a multiple of 8 and "
            "divide beams. Try 1024 and 256."
        )
    view = ALL_AROUND if field_of_view_deg >= 360.0 else float(np.radians(field_of_view_deg))
    return Lidar(beams, input_beams, max_range_m, noise_m, view, tuple(layers))


def beams_in(world: World, lidar: Lidar) -> BeamTree:
    """Return the beams of ``lidar`` in cells of ``world``."""
    return beam_tree(lidar.beams, lidar.max_range / world.grid.resolution, world.grid.cells.shape[1])
