"""True labels of subgoals, from the building that the robot cannot see (LSP section 2.2 and 2.3).

U is the true traversable space that the robot cannot reach through known free space, F_s the frontier of subgoal s.
Distances from s run over U and F_s; along the frontier itself, which lies in free space, they are octile. They begin at
the gate (``Surroundings.gates``), where the planner begins to count too.
Space that was glimpsed but is not connected to the robot by known space belongs to U: the way there is unknown.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings
from pipeline.simulation.world import World
from pipeline.systems.subgoals.beyond import Beyond


class Label(NamedTuple):
    """What truly lies beyond one subgoal.

    leads: whether the goal lies in the part of U that touches F_s.
    success: shortest distance from the gate of s to the goal inside U and F_s [m]; inf unless it leads.
    delta_success: ``success`` minus the optimistic distance gate -> goal [m], never negative; inf unless it leads.
    exploration: 2 x (largest - smallest travel distance from the gate over that part of U) [m]; 0 where it leads.
    """

    leads: bool
    success: float
    delta_success: float
    exploration: float


def label_subgoals(beyond: Beyond, seen: Seen, around: Surroundings, subgoals: Sequence[Subgoal]) -> list[Label]:
    """Return the true labels of ``subgoals`` at this step. ``beyond`` is of the same trial."""
    if not subgoals:
        return []
    beyond.follow()
    labels = []
    for subgoal, gate in zip(subgoals, around.gates_of(subgoals), strict=True):
        success = beyond.way_to_goal(subgoal.cells, gate)
        if np.isfinite(success):
            delta = max(0.0, success - float(around.onward[gate]))
            labels.append(Label(True, success * seen.resolution, delta * seen.resolution, 0.0))
        else:
            nearest, farthest = beyond.extent(subgoal.cells, gate)
            labels.append(Label(False, np.inf, np.inf, 2.0 * (farthest - nearest) * seen.resolution))
    return labels


def misclassification_costs(labels: Sequence[Label], floor_m: float) -> NDArray[np.float64]:
    """Return what it costs [m] to misjudge each subgoal of one step, at least ``floor_m`` (LSP section 2.2).

    Not leading: the exploration cost. Leading: the greatest exploration cost of a *different* subgoal that does
    not lead to the goal, which is where the robot might be sent instead.
    """
    vain = np.array([0.0 if label.leads else label.exploration for label in labels])
    worst = float(vain.max(initial=0.0))
    costs = np.array([worst if label.leads else label.exploration for label in labels])
    floored: NDArray[np.float64] = np.maximum(costs, floor_m)
    return floored


class Marked(NamedTuple):
    """A subgoal with its label, its misclassification cost [m] and its place among the step's subgoals."""

    subgoal: Subgoal
    label: Label
    cost: float
    place: int


class LabelBook:
    """The labels of one trial's subgoals, each made when its frontier appeared or changed.

    One instance serves one trial. Labels of unchanged frontiers are kept, just as a planner keeps its estimates.
    """

    def __init__(self, world: World, *, floor_m: float) -> None:
        """``floor_m``: the least misclassification cost [m]."""
        self._world = world
        self._beyond: Beyond | None = None
        self._floor = floor_m
        self._labels: dict[bytes, Label] = {}

    def mark_changed(self, seen: Seen, around: Surroundings) -> list[Marked]:
        """Label the subgoals that are new or changed at this step, and return them."""
        changed = [(k, subgoal) for k, subgoal in enumerate(around.subgoals) if subgoal.key not in self._labels]
        if self._beyond is None or not self._beyond.is_of(around):
            self._beyond = Beyond(self._world, seen, around)
        fresh = label_subgoals(self._beyond, seen, around, [subgoal for _, subgoal in changed])
        known = self._labels | {subgoal.key: label for (_, subgoal), label in zip(changed, fresh, strict=True)}
        self._labels = {subgoal.key: known[subgoal.key] for subgoal in around.subgoals}
        if not changed:
            return []
        costs = misclassification_costs(list(self._labels.values()), self._floor)
        return [Marked(subgoal, self._labels[subgoal.key], float(costs[k]), k) for k, subgoal in changed]
