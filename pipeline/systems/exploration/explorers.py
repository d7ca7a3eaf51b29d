"""Planners that see a whole building: each drives to one frontier after another, and they differ in which is next."""

from dataclasses import dataclass
from math import exp
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.grids.partial_map import UNSEEN
from pipeline.planning.protocols import Course
from pipeline.planning.seen import Seen
from pipeline.settings import require
from pipeline.simulation.lidar import ALL_AROUND
from pipeline.simulation.trial import Robot
from pipeline.simulation.world import World
from pipeline.systems.exploration.frontiers import Frontiers
from pipeline.systems.exploration.gain import Lookout
from pipeline.systems.exploration.settings import PlannerConfig

RULES = ("exponential", "per_distance")


class Target(NamedTuple):
    """Where to look from. cell: flat, of a frontier. heading: [rad], None for a robot that sees all around."""

    cell: int
    heading: float | None


class Explorer:
    """Drives to the frontier it chose, looks, and chooses the next. One instance serves one trial.

    From a frontier's cell its unseen neighbour is in sight, so each target shows something new, and where no frontier
    is left all that can be reached was seen.

    target: where it is driving to.
    """

    target: Target | None

    def __init__(self, robot: Robot, planner: PlannerConfig) -> None:
        """Plan for ``robot``; ``planner`` as in `PlannerConfig`."""
        self._sensor, self._config = robot.sensor, planner
        self._narrow = robot.sensor.field_of_view < ALL_AROUND
        self._frontiers: Frontiers | None = None
        self.target = None

    def choose(self, seen: Seen, frontiers: Frontiers) -> Target:
        """Return the next target; there is at least one frontier."""
        raise NotImplementedError

    def plan(self, seen: Seen) -> NDArray[np.int32] | Course | None:
        """Return the way to the target, or None where no frontier is left."""
        if self._frontiers is None:
            self._frontiers = Frontiers(seen)
        else:
            self._frontiers.update(seen)
        found = self._frontiers
        if not found.cells.size:
            self.target = None
            return None
        if self.target is None or not self._holds(self.target, seen, found):
            self.target = self.choose(seen, found)
        path = found.reach.path_to(self.target.cell)
        return path if self.target.heading is None else Course(path, self.target.heading)

    def _holds(self, target: Target, seen: Seen, found: Frontiers) -> bool:
        """Whether there is still something to see at ``target``, and it has not been looked at from there."""
        if not self._config.commit or not found.hold(target.cell):
            return False
        return target.cell != found.home or (target.heading is not None and target.heading != seen.pose.heading)

    def _facing(self, seen: Seen, cell: int) -> Target:
        """Return ``cell`` as a target from which its first unseen neighbour is ahead."""
        if not self._narrow:
            return Target(cell, None)
        cols, status = seen.map.status.shape[1], seen.map.status.ravel()
        ahead = next(k for k, step in enumerate((1, cols, -1, -cols)) if status[cell + step] == UNSEEN)
        return Target(cell, ahead * ALL_AROUND / 4.0)


class Nearest(Explorer):
    """Drives to the frontier cell that is nearest by way of known free space (Yamauchi 1997)."""

    def choose(self, seen: Seen, frontiers: Frontiers) -> Target:
        """Return the nearest cell, of equal ones the first."""
        distances = frontiers.reach.distance_to(frontiers.cells)
        return self._facing(seen, int(frontiers.cells[np.argmin(distances)]))


class Largest(Explorer):
    """Drives to the middle of the frontier with most cells."""

    def choose(self, seen: Seen, frontiers: Frontiers) -> Target:
        """Return the middle of the largest, of equal ones the nearest."""
        distances = frontiers.reach.distance_to(frontiers.middles)
        best = np.lexsort((distances, -frontiers.sizes()))[0]
        return self._facing(seen, int(frontiers.middles[best]))


@dataclass(frozen=True, kw_only=True)
class GainSettings:
    """How a view's gain is weighed against the way to it."""

    rule: str = "exponential"
    """exponential: gain x exp(-decay_per_m x distance), as in the paper; per_distance: their quotient."""
    decay_per_m: float = 0.2
    """Of the exponential rule [1/m]: large stays near, small goes far for much."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(self.rule in RULES, "settings.rule", self.rule, f"one of {', '.join(RULES)}")
        require(0 <= self.decay_per_m <= 100, "settings.decay_per_m", self.decay_per_m, "from 0 to 100 per metre")

    def score(self, gain: float, distance_m: float, least_m: float) -> float:
        """Return the worth of ``gain`` at ``distance_m``, which never rises with the distance.

        least_m: a distance that is never undercut where one divides by it.
        """
        if self.rule == "exponential":
            return gain * exp(-self.decay_per_m * distance_m)
        return gain / max(distance_m, least_m)


class InformationGain(Explorer):
    """Drives to the view with the best expected gain for its way (Gonzalez-Banos and Latombe 2002).

    The gain is the unseen area within the sensor's reach, were nothing in the way but the obstacles already seen.
    """

    def __init__(self, settings: GainSettings, robot: Robot, planner: PlannerConfig) -> None:
        """Weigh by ``settings``."""
        super().__init__(robot, planner)
        self._settings = settings
        self._lookout: Lookout | None = None

    def choose(self, seen: Seen, frontiers: Frontiers) -> Target:
        """Return the best view, of equal ones the nearest."""
        lookout = self._lookout = self._lookout or self._look_out(seen)
        places = frontiers.viewpoints(self._config.spacing_m / seen.resolution)
        distances = frontiers.reach.distance_to(places) * seen.resolution
        best, most = self._facing(seen, int(places[np.argmin(distances)])), 0.0
        for k in np.argsort(distances, kind="stable"):
            distance = float(distances[k])
            if self._settings.score(lookout.most, distance, seen.resolution) <= most:
                break  # no view from there on can be better
            view = lookout.view(int(places[k]))
            worth = self._settings.score(view.unseen, distance, seen.resolution)
            if worth > most:
                best, most = Target(int(places[k]), view.heading), worth
        return best

    def _look_out(self, seen: Seen) -> Lookout:
        return Lookout(self._sensor, self._config.gain_beams, seen.map.known, seen.map.known, seen.resolution)


class TrueGain(InformationGain):
    """The same with the gain that the view will truly have: what perfect prediction of the unseen would bring."""

    def __init__(self, settings: GainSettings, robot: Robot, planner: PlannerConfig, world: World) -> None:
        """Look up views in ``world``, which no robot knows."""
        super().__init__(settings, robot, planner)
        self._truth = world.grid.cells

    def _look_out(self, seen: Seen) -> Lookout:
        return Lookout(self._sensor, self._config.gain_beams, seen.map.known, self._truth, seen.resolution)
