"""What an evaluation and a harvest record of explorations."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.errors import PartError
from pipeline.evaluation.competitors import CompetitorConfig, Outcome, Role, make_roster
from pipeline.planning.seen import NO_GOAL
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.systems.exploration.contest import CONTEST
from pipeline.systems.exploration.harvest import MAP_GROWTH, harvest_trial
from pipeline.systems.exploration.settings import EvaluateConfig, PlannerConfig
from pipeline.systems.system import Job
from tests.systems.contestants import ground_of
from tests.systems.exploration.explorations import robot_of
from tests.worlds import DEAD_END, draw


def driven(use: str, role: Role = Role.baseline, coverage: float = 0.95, view: float = 360.0) -> Outcome:
    others = {} if role is Role.baseline else {"base": CompetitorConfig(use="nearest", role=Role.baseline)}
    entries = {"ours": CompetitorConfig(use=use, role=role)} | others
    sections: dict[str, Any] = {
        "sensor": SensorConfig(beams=256, input_beams=256, max_range_m=3.0, field_of_view_deg=view),
        "robot": RobotConfig(radius_m=0.0, step_m=1.0),
        "planner": PlannerConfig(),
        "evaluate": EvaluateConfig(competitors=entries, coverage=coverage),
    }
    (competitor,) = (each for each in make_roster(entries) if each.name == "ours")
    part, settings = CONTEST.part_of(competitor)
    entrant = CONTEST.enter(competitor, part, settings, Job(seed=0, artifacts=Path("nowhere"), sections=sections))
    ground, pair = ground_of(draw(*DEAD_END))
    return entrant.drive(ground, pair._replace(goal=NO_GOAL), np.random.default_rng(0))


@pytest.mark.parametrize("view", [360.0, 90.0])
@pytest.mark.parametrize("use", ["nearest", "largest", "information_gain"])
def test_an_exploration_ends_covered_and_costs_what_it_took_to_see_most(use: str, view: float) -> None:
    most, whole = driven(use, view=view), driven(use, coverage=1.0, view=view)
    assert most.ending == whole.ending == "covered"
    assert 0.0 < most.cost_m <= whole.cost_m
    assert most.side["growth"] == whole.side["growth"] and most.side["growth"][-1].share == 1.0
    assert next(row.travelled_m for row in most.side["growth"] if row.share >= 0.95) == most.cost_m
    assert all(0.0 <= mark.value <= 1.0 and mark.cells.size == 1 for mark in most.replay.marks) and most.replay.marks


def test_who_takes_the_truth_is_a_bound() -> None:
    assert driven("true_gain", Role.bound).ending == "covered"
    with pytest.raises(PartError, match="takes the true world, which no robot has: expected the role bound"):
        driven("true_gain", Role.candidate)


def test_the_harvest_says_of_each_frontier_what_it_shows() -> None:
    ground, pair = ground_of(draw(*DEAD_END))
    datums = harvest_trial(ground, pair, robot_of(3.0), np.random.default_rng(0), None)
    assert len(datums) > 5 and MAP_GROWTH.stack(datums).num_rows == len(datums)
    for datum in datums:
        assert 0.0 <= datum.shown_m2 <= datum.unseen_m2 == pytest.approx(sum(datum.bearing_m2))
    assert any(datum.shown_m2 < datum.unseen_m2 for datum in datums)
    assert max(datum.seen_m2 for datum in datums) < (ground.world.blocked == 0).sum()
