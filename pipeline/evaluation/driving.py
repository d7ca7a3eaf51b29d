"""A trial of driving to a goal: any planner in the one loop, and what is recorded of it."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from pipeline.evaluation.competitors import Competitor, Outcome
from pipeline.evaluation.trials import Mark, Replay
from pipeline.grids.store import Pair
from pipeline.parts import Part, make_part, named
from pipeline.planning.protocols import Planner
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.simulation.ground import Ground
from pipeline.simulation.practice import practice_ground
from pipeline.simulation.robots import make_robot
from pipeline.simulation.trial import Episode, Robot, require_possible, run_trial


class Rules(NamedTuple):
    """What every drive of an evaluation shares; fields as in `run_trial`."""

    robot: Robot
    max_steps: int | None


def rules_of(sensor: SensorConfig, robot: RobotConfig, max_steps: int | None) -> Rules:
    """Return the rules that the sections sensor and robot make."""
    return Rules(make_robot(sensor, robot), max_steps)


def drive_to_goal(
    planner: Planner,
    ground: Ground,
    pair: Pair,
    rules: Rules,
    rng: np.random.Generator,
    aside: Callable[[], None] | None = None,
) -> Episode:
    """Let ``planner`` drive from the start of ``pair`` to its goal; ``aside`` as in `run_trial`.

    Raises:
        TrialError, PlannerError: as `run_trial`, and for a cost below the shortest way in the true map.
    """
    episode = run_trial(
        ground.world,
        pair.start,
        pair.goal,
        planner,
        robot=rules.robot,
        rng=rng,
        max_steps=rules.max_steps,
        aside=aside,
    )
    least = pair.known_map_m * rules.robot.motion.undercut
    require_possible(episode, least, f"{type(planner).__name__} on {pair.pair_id}")
    return episode


_WARM: set[str] = set()  # what has driven in this process


def warm_up(key: str, drive: Callable[[Ground, Pair, Rules], object], rules: Rules) -> None:
    """Drive through a small world where ``key`` has not in this process: kernels are compiled before one is timed.

    drive: lets the planner that ``key`` stands for drive.
    """
    if key in _WARM:
        return
    reach = rules.robot.sensor.reach_m
    ground, pair = practice_ground(reach / 8.0, sorted(getattr(rules.robot.sensor, "layers", ())))
    drive(ground, pair, Rules(rules.robot._replace(step_m=reach / 4.0, merge_m=reach / 4.0), None))
    _WARM.add(key)


def outcome_of(
    episode: Episode, *, side: Mapping[str, list[Any]] | None = None, marks: list[Mark] | None = None
) -> Outcome:
    """Return what is recorded of ``episode``: side rows and, for pictures, what frontiers were thought of."""
    return Outcome(
        cost_m=episode.travelled,
        ending=episode.ending.name.lower(),
        steps=episode.steps,
        decisions=episode.decisions,
        seconds=episode.seconds,
        side=side or {},
        replay=Replay(episode.known, episode.path, marks or []),
    )


class PlannerEntrant:
    """Drives with planners that ``part`` makes: a new one for each trial.

    Where a planner has ``reads``, a digest of what it read, such as weights, other ones make new trials.
    """

    def __init__(self, part: Part, settings: Any, rules: Rules, **given: Any) -> None:
        """Make one planner to see that it can be made; ``given`` is what its factory may ask for by name.

        Raises:
            PartError: the part fails, or makes something else than a planner.
        """
        self._part, self._settings, self._rules, self._given = part, settings, rules, given
        self.reads = getattr(self._new_planner(), "reads", None)
        warm_up(str(part), self._drive, rules)

    def drive(self, ground: Ground, pair: Pair, rng: np.random.Generator) -> Outcome:
        """Drive from the pair's start to its goal.

        Raises:
            PartError: the planner fails, or answers what no robot can follow.
        """
        return outcome_of(self._drive(ground, pair, self._rules, rng))

    def _drive(self, ground: Ground, pair: Pair, rules: Rules, rng: np.random.Generator | None = None) -> Episode:
        planner = self._new_planner()
        with named(self._part):
            return drive_to_goal(planner, ground, pair, rules, rng or np.random.default_rng(0))

    def _new_planner(self) -> Planner:
        planner: Planner = make_part(self._part, self._settings, expected=Planner, **self._given)
        return planner


class KnownMap:
    """The shortest way in the true map: a bound on any planner, needing no drive."""

    def drive(self, ground: Ground, pair: Pair, rng: np.random.Generator) -> Outcome:
        """Return the length of the way."""
        return Outcome(cost_m=pair.known_map_m, ending="reached")


@runtime_checkable
class Drives(Protocol):
    """What enters an evaluation by itself, rather than as a planner."""

    def drive(self, ground: Ground, pair: Pair, rng: np.random.Generator) -> Outcome:
        """Return how it fared on one trial."""
        ...


def enter_driver(competitor: Competitor, part: Part, settings: Any, rules: Rules, **given: Any) -> Drives:
    """Return the entrant of ``competitor``: what its part makes if that drives, else its planners.

    given: what the part may ask for by name.
    """
    if hasattr(part.make, "drive"):
        made: Drives = make_part(part, settings, expected=Drives, competitor=competitor, **given)
        return made
    return PlannerEntrant(part, settings, rules, **given)
