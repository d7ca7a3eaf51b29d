"""Robots from their settings."""

from dataclasses import asdict

from pipeline.settings import RobotConfig, SensorConfig
from pipeline.simulation.car import Car
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.motion import Walk
from pipeline.simulation.protocols import Motion
from pipeline.simulation.trial import Robot


def make_robot(sensor: SensorConfig, robot: RobotConfig) -> Robot:
    """Return the robot that the sections sensor and robot of the configuration describe.

    Raises:
        ConfigError: the numbers of beams do not divide evenly.
    """
    motion: Motion = Walk(robot.turn_m)
    if robot.motion == "car":
        motion = Car(robot.turning_radius_m, robot.primitives)
    return Robot(make_lidar(**asdict(sensor)), robot.step_m, robot.merge_m, motion)
