"""One trial, every planner: the same world, start, goal, sensor and motion; only the choice differs."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from pipeline.evaluation.trials import EstimateRow
from pipeline.grids.distances import Indices
from pipeline.grids.occupancy import Cell
from pipeline.planning.expected_cost import order_subgoals
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.ordering import MOST_EXACT
from pipeline.planning.protocols import Estimator, Planner
from pipeline.simulation.lidar import Lidar
from pipeline.simulation.trial import Episode, run_trial
from pipeline.simulation.world import World
from pipeline.systems.subgoals.labels import LabelBook
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import Estimated, SubgoalPlanner
from pipeline.systems.subgoals.practice import practice_world

PLANNERS = ("optimistic", "learned", "perfect")

_WARM: set[tuple[str, bool | None]] = set()  # planners that have driven in this process, and with what estimates


class EstimatedFrontier(NamedTuple):
    """A frontier when it was estimated, for pictures: its flat cells [k] int32."""

    step: int
    cells: Indices
    p_success: float


class Drive(NamedTuple):
    """One planner's drive: the episode, and what its estimator said beside the truth."""

    planner: str
    episode: Episode
    estimates: list[EstimateRow]
    frontiers: list[EstimatedFrontier]


class Rules(NamedTuple):
    """What every planner of a trial shares.

    lidar, step_m [m], merge_m [m], max_steps: see run_trial; weight_floor_m [m]: see LabelBook.
    plan_over: builds a subgoal planner on an estimator, with the ordering's settings.
    """

    lidar: Lidar
    step_m: float
    merge_m: float
    weight_floor_m: float
    max_steps: int | None
    plan_over: Callable[[Estimator], SubgoalPlanner]


def drive(
    planner: str,
    world: World,
    start: Cell,
    goal: Cell,
    rules: Rules,
    *,
    trial_id: str,
    learned: Estimator | None,
    rng: np.random.Generator,
) -> Drive:
    """Let the planner named ``planner`` (one of PLANNERS) drive one trial.

    ``learned`` is the estimator of the planner "learned". ``rng`` feeds the sensor's noise. The episode's ``seconds``
    are the robot's own: true labels are worked out beside its clock, and the planner's kernels are compiled before.
    """
    warm_up(planner, rules, learned)
    return _drive(planner, world, start, goal, rules, trial_id=trial_id, learned=learned, rng=rng)


def warm_up(planner: str, rules: Rules, learned: Estimator | None) -> None:
    """Drive through a small world where this process has not yet: kernels are compiled or read from their cache."""
    kind = planner, learned.lasting if learned is not None and planner == "learned" else None
    if kind in _WARM:
        return
    _WARM.add(kind)
    reach = rules.lidar.max_range
    drawn = practice_world(reach / 8.0)
    practice = rules._replace(step_m=reach / 4.0, merge_m=reach / 4.0, max_steps=None)
    _drive(planner, *drawn, practice, trial_id="", learned=learned, rng=np.random.default_rng(0))
    if planner != "optimistic":
        many = np.ones(MOST_EXACT + 1)  # more than any small world has, and solved by other kernels
        order_subgoals(many, np.ones((many.size, many.size)), 0.5 * many, many, many)


def _drive(
    planner: str,
    world: World,
    start: Cell,
    goal: Cell,
    rules: Rules,
    *,
    trial_id: str,
    learned: Estimator | None,
    rng: np.random.Generator,
) -> Drive:
    witness = _Witness(world, trial_id, rules.weight_floor_m, beside_truth=planner == "learned")
    driver = _make_planner(planner, world, rules, learned, witness.note)
    episode = run_trial(
        world,
        start,
        goal,
        driver,
        lidar=rules.lidar,
        step_m=rules.step_m,
        rng=rng,
        merge_m=rules.merge_m,
        max_steps=rules.max_steps,
        aside=witness.write_down,
    )
    return Drive(planner, episode, witness.estimates, witness.frontiers)


def _make_planner(
    name: str,
    world: World,
    rules: Rules,
    learned: Estimator | None,
    note: Callable[[Estimated], None],
) -> Planner:
    if name == "optimistic":
        return OptimisticPlanner()
    if name == "perfect":
        planner = rules.plan_over(PerfectEstimator(world))
    elif name == "learned" and learned is not None:
        planner = rules.plan_over(learned)
    else:
        raise ValueError(f"planner {name!r}: expected one of {PLANNERS}, with an estimator for 'learned'")
    planner.on_estimate = note
    return planner


class _Witness:
    """Writes down each estimate while a planner drives, beside the truth where that is asked for.

    It takes note during a decision, which costs nothing, and looks up the truth after it, before the map changes.
    """

    def __init__(self, world: World, trial_id: str, floor_m: float, *, beside_truth: bool) -> None:
        self._book = LabelBook(world, floor_m=floor_m) if beside_truth else None
        self._trial_id = trial_id
        self.estimates: list[EstimateRow] = []
        self.frontiers: list[EstimatedFrontier] = []
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
            self.frontiers.append(EstimatedFrontier(step, subgoal.cells, found.p_success))
        if self._book is None:
            return
        marked = {mark.subgoal.key: mark for mark in self._book.mark_changed(estimated.seen, estimated.around)}
        for subgoal, found in zip(estimated.subgoals, estimated.properties, strict=True):
            label, cost = marked[subgoal.key].label, marked[subgoal.key].cost
            self.estimates.append(
                EstimateRow(
                    self._trial_id,
                    step,
                    *found,
                    leads_to_goal=label.leads,
                    true_delta_success_m=label.delta_success if label.leads else None,
                    true_exploration_m=None if label.leads else label.exploration,
                    weight_m=cost,
                )
            )
