"""Explorations in drawn worlds, without a configuration file."""

import numpy as np

from pipeline.grids.distances import travel_field
from pipeline.planning.protocols import Planner
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import Episode, Robot, run_trial
from pipeline.simulation.world import World, make_world
from pipeline.systems.exploration.explorers import GainSettings, InformationGain, Largest, Nearest, TrueGain
from pipeline.systems.exploration.growth import Survey
from pipeline.systems.exploration.settings import PlannerConfig
from tests.worlds import Drawing

NAMES = ("nearest", "largest", "exponential", "per_distance", "true_gain")


def robot_of(reach: float, view: float = 360.0, step: float = 1.0) -> Robot:
    return Robot(make_lidar(beams=256, input_beams=64, max_range_m=reach, field_of_view_deg=view), step_m=step)


def explorer(name: str, robot: Robot, world: World, *, commit: bool = True) -> Planner:
    config = PlannerConfig(commit=commit, gain_beams=64)
    if name == "nearest":
        return Nearest(robot, config)
    if name == "largest":
        return Largest(robot, config)
    if name == "true_gain":
        return TrueGain(GainSettings(), robot, config, world)
    return InformationGain(GainSettings(rule=name), robot, config)


def explore(name: str, drawn: Drawing, robot: Robot, *, radius: float = 0.0, commit: bool = True,
            ) -> tuple[Episode, Survey, World]:  # fmt: skip
    world = make_world("drawn", drawn.grid, radius)
    survey = Survey(world, drawn.start)
    planner = explorer(name, robot, world, commit=commit)
    return run_trial(world, drawn.start, survey, planner, robot=robot, rng=np.random.default_rng(0)), survey, world


def in_reach(world: World, drawn: Drawing) -> np.ndarray:
    free = world.blocked == 0
    return np.isfinite(travel_field(free, drawn.start.row, drawn.start.col))
