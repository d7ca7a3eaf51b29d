"""The perfect estimator: true labels as estimates. A bound to report, never a competitor, since it knows the plan."""

from collections.abc import Sequence

import numpy as np

from pipeline.planning.protocols import Estimates
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings
from pipeline.simulation.world import World
from pipeline.systems.subgoals.beyond import Beyond
from pipeline.systems.subgoals.labels import Label, label_subgoals


class PerfectEstimator:
    """Knows the building: shows how much of the remaining gap is the abstraction's and not the network's."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._beyond: Beyond | None = None

    @property
    def lasting(self) -> bool:
        """True: a label holds until its frontier changes, as in the datum table."""
        return True

    def estimate(self, seen: Seen, around: Surroundings, subgoals: Sequence[Subgoal]) -> Estimates:
        """Return the true labels of ``subgoals``; costs that do not apply are 0."""
        if self._beyond is None or not self._beyond.is_of(around):
            self._beyond = Beyond(self._world, seen, around)
        return true_estimates(label_subgoals(self._beyond, seen, around, subgoals))


def true_estimates(labels: Sequence[Label]) -> Estimates:
    """Return labels in the form of estimates; costs that do not apply are 0."""
    return Estimates(
        np.array([float(label.leads) for label in labels]),
        np.array([label.delta_success if label.leads else 0.0 for label in labels]),
        np.array([label.exploration for label in labels]),
    )
