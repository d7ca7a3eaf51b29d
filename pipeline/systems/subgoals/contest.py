"""Who drives to a goal: the optimist, planners over subgoals with any estimator, anybody's planner, and the bounds."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.errors import PartError
from pipeline.evaluation.competitors import Competitor, Outcome, Role
from pipeline.evaluation.driving import Rules, drive_to_goal, enter_driver, outcome_of, rules_of, warm_up
from pipeline.evaluation.trials import Mark
from pipeline.files import digest_file
from pipeline.grids.store import Pair
from pipeline.learning.provenance import made_differently
from pipeline.learning.weights import load_weights
from pipeline.parts import Part, find_part, make_part, named, settings_of
from pipeline.planning.protocols import Estimator
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.simulation.ground import Ground
from pipeline.source_code import digest_part
from pipeline.systems.subgoals.estimates import EstimateRow, estimates_table, measure_estimates
from pipeline.systems.subgoals.labels import LabelBook
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK
from pipeline.systems.subgoals.planner import Estimated, SubgoalPlanner
from pipeline.systems.subgoals.settings import EvaluateConfig, PlannerConfig
from pipeline.systems.system import Contest, Entrant, Job

HERE = "pipeline.systems.subgoals"
PARTS = {
    "optimistic": "pipeline.planning.optimistic:OptimisticPlanner",
    "subgoals": f"{HERE}.contest:SubgoalEntrant",
    "known_map": "pipeline.evaluation.driving:KnownMap",
}
ESTIMATORS = {
    "network": f"{HERE}.estimator:load_estimator",
    "labels": f"{HERE}.perfect:PerfectEstimator",
}


CHOSE = {
    "train": "The network learned from these very plans (evaluate.split = train): ratio and calibration flatter it.",
    "validation": "These plans chose the network's step and calibration (evaluate.split = validation): ratio and "
    "calibration flatter it.",
}


@dataclass(frozen=True, kw_only=True)
class SubgoalSettings:
    """Settings of a competitor that plans over subgoals; null takes what the section planner says."""

    estimator: str = "network"
    """network: the trained one; labels: the truth, for a bound; or ``my_package.my_module:factory``."""
    estimator_settings: dict[str, Any] = field(default_factory=dict)
    """Typed by the estimator itself."""
    network: str | None = None
    """Its weights; null takes evaluate.network, and where that is null those of this run's training."""
    max_subgoals: int | None = None
    failure_penalty_m: float | None = None
    rescale_probabilities: bool | None = None
    optimism: float | None = None


class SubgoalEntrant:
    """Drives with a planner over subgoals; each trial begins with a fresh one, the network is loaded once."""

    def __init__(self, settings: SubgoalSettings, competitor: Competitor, job: Job) -> None:
        """Load the estimator.

        Raises:
            ConfigError, PartError, TableError: no such estimator or network, or settings of the planner that are off.
        """
        config = job.section("evaluate", EvaluateConfig)
        self._competitor, self._floor_m = competitor, config.weight_floor_m
        self._rules = _rules(job)
        self._planner = _planner_settings(settings, job)
        self._make_estimator = estimator_maker(settings, competitor, job)
        network = network_of(settings, job) if settings.estimator == "network" else None
        self._estimator, _ = _estimator_of(competitor, settings)
        self.reads = _digest_of(self._estimator, network_of(settings, job))
        self.weights = _weights_of(self._estimator, network_of(settings, job))
        self.made_with = load_weights(network, SUBGOAL_NETWORK)[0].made_with if network else None
        self.remarks = [] if self.made_with is None else _differences(self.made_with, job)

        warm_up(f"{settings.estimator} {self.reads}", self._drive, self._rules)

    def drive(self, ground: Ground, pair: Pair, rng: np.random.Generator) -> Outcome:
        """Drive from the pair's start to its goal."""
        return self._drive(ground, pair, self._rules, rng)

    def _drive(self, ground: Ground, pair: Pair, rules: Rules, rng: np.random.Generator | None = None) -> Outcome:
        witness = _Witness(ground, pair, self._competitor, self._floor_m)
        planner = SubgoalPlanner(
            estimator=self._make_estimator(ground), on_estimate=witness.note, **asdict(self._planner)
        )
        noise = rng or np.random.default_rng(0)
        with named(self._estimator):
            episode = drive_to_goal(planner, ground, pair, rules, noise, aside=witness.write_down)
        return outcome_of(episode, side={"estimates": witness.estimates}, marks=witness.marks)


def estimator_maker(settings: SubgoalSettings, competitor: Competitor, job: Job) -> Callable[[Ground], Estimator]:
    """Return what gives a trial its estimator: one for all trials, or one of each ground if it reads the truth."""
    part, typed = _estimator_of(competitor, settings)
    if "world" in inspect.signature(part.make).parameters:
        if competitor.role is not Role.bound:
            raise PartError(
                f"{part} takes the true world, which no robot has: expected the role bound, found {competitor.role}"
            )
        return lambda ground: make_part(part, typed, expected=Estimator, world=ground.world)
    made = make_part(
        part,
        typed,
        expected=Estimator,
        network=network_of(settings, job),
        input_beams=job.section("sensor", SensorConfig).input_beams,
        job=job,
    )
    return lambda ground: made


def check_estimator(competitor: Competitor, settings: Any) -> None:
    """Refuse an estimator that is not there, and settings that it does not take."""
    if isinstance(settings, SubgoalSettings):
        _estimator_of(competitor, settings)


def _estimator_of(competitor: Competitor, settings: SubgoalSettings) -> tuple[Part, Any]:
    key = f"{competitor.key}.settings.estimator"
    part = find_part(key, settings.estimator, ESTIMATORS)
    return part, settings_of(part, settings.estimator_settings, f"{key}_settings")


def _digest_of(estimator: Part, network: Path) -> str:
    """Return of what estimates depend on: the code of an estimator that is not ours, and the weights it takes."""
    code = digest_part(estimator.make) if ":" in estimator.use else ""
    return code + _weights_of(estimator, network)


def _weights_of(estimator: Part, network: Path) -> str:
    """Return the digest of the weights that an estimator takes, empty where it takes none."""
    taken = "network" in inspect.signature(estimator.make).parameters
    return digest_file(network) if taken and network.is_file() else ""


def network_of(settings: SubgoalSettings, job: Job) -> Path:
    """Return the weights that a competitor drives with."""
    named_there = settings.network or job.section("evaluate", EvaluateConfig).network
    return Path(named_there) if named_there else job.folder("train") / "network.safetensors"


def _differences(made_with: Mapping[str, Any], job: Job) -> list[str]:
    """Return in what these trials differ from the data that the network was made with, and whether they made it."""
    sections = {
        "sensor": asdict(job.section("sensor", SensorConfig)),
        "robot": asdict(job.section("robot", RobotConfig)),
    }
    present = {f"{name}.{key}": value for name, section in sections.items() for key, value in section.items()}
    present |= {"rasterize.resolution_m": job.resolution_m}
    split = job.section("evaluate", EvaluateConfig).split
    return [*made_differently(made_with, present), *([CHOSE[split]] if split in CHOSE else [])]


def _planner_settings(settings: SubgoalSettings, job: Job) -> PlannerConfig:
    shared = asdict(job.section("planner", PlannerConfig))
    own = {each.name: getattr(settings, each.name) for each in fields(PlannerConfig)}
    return PlannerConfig(**shared | {name: value for name, value in own.items() if value is not None})


class _Witness:
    """Writes down each estimate while a planner drives, beside the truth unless it is the truth.

    It takes note during a decision, which costs nothing, and looks up the truth after it, before the map changes.
    """

    def __init__(self, ground: Ground, pair: Pair, competitor: Competitor, floor_m: float) -> None:
        beside_truth = competitor.role is not Role.bound
        self._book = LabelBook(ground.world, floor_m=floor_m) if beside_truth else None
        self._pair, self._competitor = pair, competitor
        self.estimates: list[EstimateRow] = []
        self.marks: list[Mark] = []
        self._noted: list[Estimated] = []

    def note(self, estimated: Estimated) -> None:
        self._noted.append(estimated)

    def write_down(self) -> None:
        for estimated in self._noted:
            self._write(estimated)
        self._noted.clear()

    def _write(self, estimated: Estimated) -> None:
        step = estimated.seen.step
        for subgoal, found in zip(estimated.subgoals, estimated.properties, strict=True):
            self.marks.append(Mark(step, subgoal.cells, found.p_success))
        if self._book is None:
            return
        marked = {mark.subgoal.key: mark for mark in self._book.mark_changed(estimated.seen, estimated.around)}
        for subgoal, found in zip(estimated.subgoals, estimated.properties, strict=True):
            label, cost = marked[subgoal.key].label, marked[subgoal.key].cost
            self.estimates.append(
                EstimateRow(
                    self._pair.pair_id,
                    self._competitor.name,
                    step,
                    *found,
                    leads_to_goal=label.leads,
                    true_delta_success_m=label.delta_success if label.leads else None,
                    true_exploration_m=None if label.leads else label.exploration,
                    weight_m=cost,
                )
            )


def enter(competitor: Competitor, part: Part, settings: Any, job: Job) -> Entrant:
    """Return the entrant of ``competitor``: what its part made, or its planner in our loop."""
    return enter_driver(competitor, part, settings, _rules(job), job=job)


def _rules(job: Job) -> Rules:
    sensor, robot = job.section("sensor", SensorConfig), job.section("robot", RobotConfig)
    return rules_of(sensor, robot, job.section("evaluate", EvaluateConfig).max_steps)


CONTEST = Contest(
    parts=PARTS,
    enter=enter,
    tables={"estimates": estimates_table},
    measure=measure_estimates,
    check=check_estimator,
)
