"""Competitors of learned subgoal planning, entered as the evaluate stage enters them, without a configuration file."""

from pathlib import Path
from typing import Any

from pipeline.evaluation.competitors import CompetitorConfig, Role, make_roster
from pipeline.grids.store import GridRecord, Pair
from pipeline.parts import find_part, settings_of
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.simulation.ground import Ground
from pipeline.simulation.world import known_map_distance
from pipeline.systems.subgoals.contest import CONTEST
from pipeline.systems.subgoals.settings import EvaluateConfig, PlannerConfig
from pipeline.systems.system import Entrant, Job
from tests.worlds import Drawing

NAMES = ("optimistic", "learned", "perfect")


def contestant(
    name: str, *, frame: str = "subgoal", reach: float = 3.0, noise: float = 0.0, step: float = 1.0, merge: float = 0.0,
    max_subgoals: int = 12,
) -> Entrant:  # fmt: skip
    """Return one of NAMES; the learned one drives with random weights for inputs of ``frame``."""
    entries = {
        "optimistic": CompetitorConfig(use="optimistic", role=Role.baseline),
        "learned": CompetitorConfig(use="subgoals", settings={"estimator": f"tests.systems.networks:{frame}_network"}),
        "perfect": CompetitorConfig(use="subgoals", role=Role.bound, settings={"estimator": "labels"}),
    }
    sections: dict[str, Any] = {
        "sensor": SensorConfig(beams=256, input_beams=256, max_range_m=reach, noise_m=noise),
        "robot": RobotConfig(radius_m=0.0, step_m=step, merge_m=merge),
        "planner": PlannerConfig(max_subgoals=max_subgoals),
        "evaluate": EvaluateConfig(competitors=entries),
    }
    job = Job(seed=0, artifacts=Path("nowhere"), sections=sections)
    (competitor,) = (each for each in make_roster(entries) if each.name == name)
    part = find_part(competitor.key, competitor.use, CONTEST.parts)
    return CONTEST.enter(competitor, part, settings_of(part, competitor.settings, f"{competitor.key}.settings"), job)


def ground_of(drawn: Drawing, radius: float = 0.0, trial: str = "a/1") -> tuple[Ground, Pair]:
    """Return the drawn world as an evaluation has it, and its start and goal."""
    ground = Ground(GridRecord("a", "a", "drawn", "test", drawn.grid, radius))
    shortest = known_map_distance(ground.world, drawn.start, drawn.goal)
    return ground, Pair(trial, "a", "a", "drawn", "test", drawn.start, drawn.goal, shortest)
