"""Who explores: planners of this system, anybody's planner, and one that knows the truth, all in the one loop."""

import inspect
from typing import Any

import numpy as np

from pipeline.errors import PartError
from pipeline.evaluation.competitors import Competitor, Outcome, Role
from pipeline.evaluation.driving import Rules, outcome_of, rules_of, warm_up
from pipeline.evaluation.trials import Mark
from pipeline.grids.store import Pair
from pipeline.parts import Part, make_part, named
from pipeline.planning.protocols import Planner
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.simulation.ground import Ground
from pipeline.simulation.practice import practice_ground
from pipeline.simulation.trial import run_trial
from pipeline.systems.exploration.curves import measure_growth
from pipeline.systems.exploration.growth import Survey, growth_table
from pipeline.systems.exploration.settings import EvaluateConfig, PlannerConfig
from pipeline.systems.system import Contest, Entrant, Job

HERE = "pipeline.systems.exploration.explorers"
PARTS = {
    "nearest": f"{HERE}:Nearest",
    "largest": f"{HERE}:Largest",
    "information_gain": f"{HERE}:InformationGain",
    "true_gain": f"{HERE}:TrueGain",
}


class ExplorationEntrant:
    """Explores with planners that ``part`` makes, a new one for each trial.

    A planner is one of ours or anybody's that needs no goal: its factory may take its settings, ``robot``, ``planner``
    (the section of the configuration) and, as a bound, ``world``. One that has a ``target`` gets its places drawn.
    """

    def __init__(self, competitor: Competitor, part: Part, settings: Any, job: Job) -> None:
        """Make one planner to see that it can be made.

        Raises:
            PartError: the part fails, makes something else than a planner, or takes the truth and is no bound.
        """
        if "world" in inspect.signature(part.make).parameters and competitor.role is not Role.bound:
            raise PartError(
                f"{part} takes the true world, which no robot has: expected the role bound, found {competitor.role}"
            )
        config = job.section("evaluate", EvaluateConfig)
        self._competitor, self._part, self._settings = competitor, part, settings
        self._planner, self._coverage = job.section("planner", PlannerConfig), config.coverage
        self._rules = rules_of(job.section("sensor", SensorConfig), job.section("robot", RobotConfig), config.max_steps)
        self._new_planner(practice_ground(1.0)[0], self._rules)
        warm_up(f"{part} {settings}", self._explore, self._rules)

    def drive(self, ground: Ground, pair: Pair, rng: np.random.Generator) -> Outcome:
        """Explore from the pair's start, see `_explore`.

        Raises:
            PartError: the planner fails, answers what no robot can follow, or says too early that all was seen.
        """
        return self._explore(ground, pair, self._rules, rng)

    def _explore(self, ground: Ground, pair: Pair, rules: Rules, rng: np.random.Generator | None = None) -> Outcome:
        """Return the drive until nothing is left to see; it costs what was travelled until most had been seen."""
        planner, survey = self._new_planner(ground, rules), Survey(ground.world, pair.start)
        notes = _Notes(planner, survey)
        with named(self._part):
            episode = run_trial(
                ground.world,
                pair.start,
                survey,
                planner,
                robot=rules.robot,
                rng=rng or np.random.default_rng(0),
                max_steps=rules.max_steps,
                aside=notes.take,
            )
            survey.vouch(episode, f"{type(planner).__name__} on {pair.pair_id}")
        rows = survey.rows(pair.pair_id, self._competitor.name)
        return outcome_of(episode, side={"growth": rows}, marks=notes.marks)._replace(
            cost_m=survey.cost_m(self._coverage)
        )

    def _new_planner(self, ground: Ground, rules: Rules) -> Planner:
        offered = {"robot": rules.robot, "planner": self._planner, "world": ground.world}
        planner: Planner = make_part(self._part, self._settings, expected=Planner, **offered)
        return planner


class _Notes:
    """Notes after each decision where the planner is driving to, and how much had been seen when it chose that."""

    def __init__(self, planner: Planner, survey: Survey) -> None:
        self._planner, self._survey = planner, survey
        self._before: object = None
        self._step = 0
        self.marks: list[Mark] = []

    def take(self) -> None:
        self._step += 1
        target = getattr(self._planner, "target", None)
        if target is not None and target is not self._before:
            self.marks.append(Mark(self._step, np.array([target.cell], dtype=np.int32), self._survey.share))
        self._before = target


def enter(competitor: Competitor, part: Part, settings: Any, job: Job) -> Entrant:
    """Return the entrant of ``competitor``."""
    return ExplorationEntrant(competitor, part, settings, job)


CONTEST = Contest(
    parts=PARTS, enter=enter, tables={"growth": growth_table}, measure=measure_growth, goals=False
)  # fmt: skip
