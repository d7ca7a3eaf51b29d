"""A planar lidar that sees all around."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import ConfigError
from pipeline.grids.raycast import Ranges, Scan, beam_directions, cast_rays
from pipeline.planning.seen import Pose
from pipeline.simulation.world import World


class Lidar(NamedTuple):
    """A range sensor of 360 degrees.

    directions: [beams, 2] unit vectors in the world frame; all of them update the map.
    input_beams: how many equally spaced ones a planner's network receives.
    max_range: [m].
    noise: standard deviation [m] of the ranges that planners receive; the map is updated without noise.
    """

    directions: NDArray[np.float64]
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
    return Lidar(beam_directions(beams), input_beams, max_range_m, noise_m)


def sense(world: World, lidar: Lidar, pose: Pose) -> Scan:
    """Return an exact scan in the world frame, per direction of ``lidar``."""
    reach = lidar.max_range / world.grid.resolution
    return cast_rays(world.grid.cells, pose.row, pose.col, lidar.directions, reach)


def robot_frame_ranges(
    lidar: Lidar, ranges: Ranges, pose: Pose, resolution: float, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Return what a planner receives: [input_beams] float32 ranges [m], beam 0 along the heading, noise added."""
    beams = lidar.directions.shape[0]
    turn = round(pose.heading / (2.0 * np.pi) * beams)
    ahead = np.roll(ranges, -turn)[:: beams // lidar.input_beams] * resolution
    if lidar.noise > 0.0:
        ahead = np.clip(ahead + rng.normal(0.0, lidar.noise, ahead.size), 0.0, lidar.max_range)
    return ahead.astype(np.float32)
