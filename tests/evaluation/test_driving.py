"""Anybody's planner as a competitor drives in our loop; whatever is wrong with it is a sentence that names it."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.errors import ConfigError, PartError, TrialError
from pipeline.evaluation import driving
from pipeline.evaluation.competitors import Competitor, Outcome, Role
from pipeline.evaluation.driving import KnownMap, PlannerEntrant, Rules, drive_to_goal, enter_driver, rules_of, warm_up
from pipeline.evaluation.trials import Replay
from pipeline.files import write_text
from pipeline.grids.occupancy import Cell
from pipeline.grids.store import GridRecord, Pair
from pipeline.parts import Part, add_to_path, find_part, settings_of
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.simulation.ground import Ground
from pipeline.simulation.world import known_map_distance
from tests.worlds import DEAD_END, draw

OWN = """
from dataclasses import dataclass
import numpy as np
from pipeline.planning.optimistic import OptimisticPlanner

@dataclass(frozen=True)
class Settings:
    patience: int = 3

class Patient:
    made = 0
    def __init__(self, settings: Settings):
        Patient.made += 1
        self.left, self.inner, self.goal = settings.patience, OptimisticPlanner(), None
    def plan(self, seen):
        assert self.goal in (None, seen.goal), "one planner met two trials"
        self.goal = seen.goal
        return self.inner.plan(seen)

class Lame:
    def steer(self, seen):
        return None

class Broken:
    def __init__(self):
        raise KeyError("no map of mine")

class Failing(OptimisticPlanner):
    def plan(self, seen):
        return {}["a way"]

class FailsHere(OptimisticPlanner):
    def plan(self, seen):
        if seen.map.status.shape == (13, 20):
            raise ValueError("too large\\nfor me")
        return super().plan(seen)

class GivesUp(OptimisticPlanner):
    def plan(self, seen):
        return None

class Jumps(OptimisticPlanner):
    def plan(self, seen):
        return super().plan(seen)[[0, -1]]

class Enters:
    def __init__(self, competitor, job):
        self.competitor, self.job = competitor, job
    def drive(self, ground, pair, rng):
        return None
"""
RULES = rules_of(SensorConfig(beams=256, input_beams=256, max_range_m=4.0), RobotConfig(radius_m=0.0, step_m=0.7), None)


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    name = f"planners_{tmp_path.name.replace('-', '_')}"
    write_text(tmp_path / f"{name}.py", OWN)
    monkeypatch.setattr("sys.path", list(sys.path))
    monkeypatch.setattr(driving, "_WARM", set[str]())
    add_to_path(tmp_path)
    return name


def entrant(use: str, **settings: Any) -> PlannerEntrant:
    competitor = Competitor("mine", Role.candidate, "mine", use, settings, 1)
    part = find_part(f"{competitor.key}.use", use, {})
    return PlannerEntrant(part, settings_of(part, settings, f"{competitor.key}.settings"), RULES)


def trial(start: Cell | None = None, goal: Cell | None = None) -> tuple[Ground, Pair]:
    drawn = draw(*DEAD_END)
    identity = ("dead_end", "hall", "drawn", "test")
    ground = Ground(GridRecord(*identity, drawn.grid, 0.0))
    ends = start or drawn.start, goal or drawn.goal
    return ground, Pair("dead_end/0", *identity, *ends, known_map_distance(ground.world, *ends))


def noise() -> np.random.Generator:
    return np.random.default_rng(5)


def test_a_planner_from_outside_drives_as_its_like_within(own: str) -> None:
    ground, pair = trial()
    episode = drive_to_goal(OptimisticPlanner(), ground, pair, RULES, noise())
    found = entrant(f"{own}:Patient", patience=9).drive(ground, pair, noise())
    assert (found.cost_m, found.ending) == (episode.travelled, "reached")
    assert (found.steps, found.decisions) == (episode.steps, episode.decisions)
    assert found.cost_m > pair.known_map_m, "the pocket misleads it"
    assert found.side == {}
    assert isinstance(found.replay, Replay)
    assert np.array_equal(found.replay.path, episode.path)
    assert np.array_equal(found.replay.known, episode.known)
    assert found.replay.marks == []


def test_each_trial_begins_with_a_new_planner(own: str) -> None:
    mine = entrant(f"{own}:Patient")
    made = sys.modules[own].Patient
    before = made.made
    for goal in (Cell(1, 1), Cell(11, 18), Cell(6, 18)):
        mine.drive(*trial(goal=goal), noise())
    assert made.made == before + 3


REFUSED = [
    ("Lame", "made a Lame without plan: expected a Planner (pipeline.planning.protocols.Planner)"),
    ("Broken", "failed: KeyError: 'no map of mine' ({own}.py, line 26)"),
    ("Failing", "failed: KeyError: 'a way' ({own}.py, line 30)"),
    ("GivesUp", ": GivesUp on practice, scan 1: the goal was given up, although free or unseen space leads there"),
    ("Jumps", ": Jumps on practice, scan 1: the path jumps from row 10, col 4 to row 4, col 31 at place 1"),
]


@pytest.mark.parametrize(("name", "said"), REFUSED)
def test_what_is_wrong_with_a_planner_is_told_before_the_first_trial(own: str, name: str, said: str) -> None:
    for _ in range(2):  # and again in the same process: a first drive that failed has warmed nobody up
        with pytest.raises(PartError) as refusal:
            entrant(f"{own}:{name}")
        message = str(refusal.value)
        assert message.startswith(f"evaluate.competitors.mine.use = {own}:{name}")
        assert said.format(own=own) in message
        assert "\n" not in message


def test_a_planner_that_fails_on_a_trial_is_named_with_its_line(own: str) -> None:
    mine = entrant(f"{own}:FailsHere")
    with pytest.raises(PartError) as refusal:
        mine.drive(*trial(), noise())
    place = f"{own}:FailsHere failed: ValueError: too large for me ({own}.py, line 35)"
    assert str(refusal.value) == f"evaluate.competitors.mine.use = {place}"


@pytest.mark.parametrize(
    ("name", "settings", "said"),
    [
        ("Patient", {"patiense": 2}, "unknown key evaluate.competitors.mine.settings.patiense. Did you mean "
                                     "evaluate.competitors.mine.settings.patience?"),
        ("Patient", {"patience": "long"}, "evaluate.competitors.mine.settings.patience = 'long': expected a whole "
                                          "number. Change it in conf/evaluate/"),
        ("Failing", {"patience": 2}, "evaluate.competitors.mine.settings holds patience, but {own}:Failing takes no"),
        ("Patiant", {}, "evaluate.competitors.mine.use = {own}:Patiant: module {own} has no 'Patiant'. Did you mean "
                        "Patient?"),
    ],
)  # fmt: skip
def test_a_wrong_setting_is_named_by_its_whole_key(own: str, name: str, settings: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        entrant(f"{own}:{name}", **settings)
    assert said.format(own=own) in str(refusal.value)


def test_pairs_of_another_map_are_not_the_planners_fault(own: str) -> None:
    ground, pair = trial()
    with pytest.raises(TrialError, match=r"Patient on dead_end/0: reached the goal after .* rasterize again"):
        entrant(f"{own}:Patient").drive(ground, pair._replace(known_map_m=1e3), noise())


def test_the_first_drive_is_made_once_in_a_process_with_rules_that_end_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driving, "_WARM", set[str]())
    met: list[tuple[Ground, Pair, Rules]] = []

    def drive(ground: Ground, pair: Pair, rules: Rules) -> None:
        met.append((ground, pair, rules))
        drive_to_goal(OptimisticPlanner(), ground, pair, rules, noise())

    for key in ("a", "a", "b"):
        warm_up(key, drive, RULES._replace(max_steps=1))
    assert len(met) == 2
    ground, pair, rules = met[0]
    assert rules.max_steps is None, "a limit for large trials must not cut it off"
    assert ground.record.grid.resolution == pytest.approx(4.0 / 8.0)
    assert pair.known_map_m > 4.0, "no look from the start shows the goal"


def test_the_known_map_costs_the_shortest_way() -> None:
    ground, pair = trial()
    assert KnownMap().drive(ground, pair, noise()) == Outcome(cost_m=pair.known_map_m, ending="reached")


def test_what_drives_by_itself_is_made_and_what_plans_is_driven(own: str) -> None:
    competitor = Competitor("mine", Role.bound, "mine", f"{own}:Enters", {}, 1)

    def entered(name: str) -> Any:
        part: Part = find_part("x.use", f"{own}:{name}", {})
        return enter_driver(competitor, part, settings_of(part, {}, "x.settings"), RULES, job="the job", more="unasked")

    made = entered("Enters")
    assert (made.competitor, made.job) == (competitor, "the job")
    assert isinstance(entered("Patient"), PlannerEntrant)
