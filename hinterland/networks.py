"""Trained networks, without the library they were trained with."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hinterland.plans import ROBOT, read_map
from pipeline.grids.occupancy import OccupancyGrid
from pipeline.settings import RobotConfig
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.robot_map import MapEstimate, estimate_on_map


def load_network(path: str | Path) -> LearnedEstimator:
    """Return the network of the weights file at ``path``; loading runs no code.

    ``network.header.made_with`` tells of the sensor, robot and resolution behind it.

    Raises:
        TableError: the file is missing, damaged or of another version.
    """
    return LearnedEstimator.load(Path(path))


def estimate(
    network: LearnedEstimator,
    map: OccupancyGrid | str | Path,  # noqa: A002 - what it is
    pose: tuple[float, float, float],
    goal: tuple[float, float],
    *,
    robot: RobotConfig | None = None,
    ranges: NDArray[np.floating] | None = None,
    max_subgoals: int = 12,
) -> MapEstimate:
    """Return what the network says of the frontiers of a robot's map, the one to try next first.

    map: cells, or the file of a map, which is then read on cells of the size that the network was made with.
    pose: x, y [m] and yaw [rad] of the robot, goal: x, y [m], in the frame of the map. The goal may lie outside of it.
    robot: its radius and how frontiers are merged; None takes those that the network was made with.
    ranges: the last scan [m], beam 0 ahead, counter-clockwise; None makes it from the map.
    max_subgoals: how many frontiers enter the ordering.

    Raises:
        PlanError, ConfigError: the map cannot be read, or its cells are larger than those of the network.
        TrialError: the robot stands in an obstacle of its map or off it, or the goal lies in one.
        TableError: the scan has another number of ranges than the network takes.
    """
    made_with = network.header.made_with
    if not isinstance(map, OccupancyGrid):
        side = made_with.get("rasterize.resolution_m")
        map = read_map(map, resolution_m=side if isinstance(side, float) else None)  # noqa: A001
    if robot is None:
        names = ("radius_m", "step_m", "merge_m")
        robot = replace(ROBOT, **{name: made_with[f"robot.{name}"] for name in names if f"robot.{name}" in made_with})
    return estimate_on_map(network, map, pose, goal, robot=robot, ranges=ranges, max_subgoals=max_subgoals)
