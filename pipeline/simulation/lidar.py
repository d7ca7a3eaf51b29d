"""A planar lidar that sees all around."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import ConfigError
from pipeline.grids.beams import BeamTree, beam_tree
from pipeline.grids.partial_map import PartialMap
from pipeline.grids.raycast import Ranges, scan
from pipeline.planning.seen import Pose
from pipeline.simulation.world import World


class Lidar(NamedTuple):
    """A range sensor of 360 degrees.

    beams: how many equally spaced ones update the map; the first along +x, counter-clockwise.
    input_beams: how many equally spaced ones a planner's network receives.
    max_range: [m].
    noise: standard deviation [m] of the ranges that planners receive; the map is updated without noise.
    """

    beams: int
    input_beams: int
    max_range: float
    noise: float = 0.0


def make_lidar(*, beams: int, input_beams: int, max_range_m: float, noise_m: float = 0.0) -> Lidar:
    """Return a lidar. Headings are multiples of 45 degrees, so both counts must be multiples of 8.

    Raises:
        ConfigError: the counts do not divide evenly.
    """
    if input_beams % 8 or beams % input_beams:
        raise ConfigError(
            f"sensor.beams = {beams}, sensor.input_beams = {input_beams}: input_beams must be a multiple of 8 and "
            "divide beams. Try 1024 and 256."
        )
    return Lidar(beams, input_beams, max_range_m, noise_m)


def beams_in(world: World, lidar: Lidar) -> BeamTree:
    """Return the beams of ``lidar`` in cells of ``world``."""
    return beam_tree(lidar.beams, lidar.max_range / world.grid.resolution, world.grid.cells.shape[1])


def sense(world: World, beams: BeamTree, map_: PartialMap, pose: Pose) -> tuple[Ranges, int]:
    """Scan from ``pose`` and enter what is seen into ``map_``.

    Returns exact ranges [cells] in the world frame, one for each beam, and the number of cells not seen before.
    """
    ranges, fresh = scan(world.grid.cells, map_, pose.row, pose.col, beams, world.disk)
    return ranges, fresh


def robot_frame_ranges(
    lidar: Lidar, ranges: Ranges, pose: Pose, resolution: float, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Return what a planner receives: [input_beams] float32 ranges [m], beam 0 along the heading, noise added."""
    turn = round(pose.heading / (2.0 * np.pi) * lidar.beams)
    every = lidar.beams // lidar.input_beams
    ahead = np.concatenate((ranges[turn::every], ranges[:turn:every])) * resolution  # `turn` is a multiple of `every`
    if lidar.noise > 0.0:
        ahead = np.clip(ahead + rng.normal(0.0, lidar.noise, ahead.size), 0.0, lidar.max_range)
    return ahead.astype(np.float32)
