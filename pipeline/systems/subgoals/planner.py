"""The subgoal planner: estimate what lies beyond each frontier, solve for the best order, take its first (LSP 2)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.errors import PlannerError
from pipeline.planning.expected_cost import order_subgoals
from pipeline.planning.gate_distances import GateDistances
from pipeline.planning.protocols import Estimates, Estimator
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings


class Properties(NamedTuple):
    """The stored estimate of one subgoal: P_S, delta success cost [m], exploration cost [m]."""

    p_success: float
    delta_success: float
    exploration: float


class _Stored(NamedTuple):
    """An estimate and the flat cell that its costs are measured from."""

    properties: Properties
    gate: int


class Estimated(NamedTuple):
    """The subgoals passed to the estimator at one step, with what it said."""

    seen: Seen
    around: Surroundings
    subgoals: Sequence[Subgoal]
    properties: Sequence[Properties]


@dataclass(kw_only=True)
class SubgoalPlanner:
    """Plans over subgoals with any estimator; one instance serves one trial.

    estimator: learned, perfect or otherwise; asked about subgoals that are new or whose frontier changed, and about
        all of them where its estimates do not last.
    max_subgoals: only so many enter the ordering: the two of least optimistic cost, then the most likely ones.
    failure_penalty_m: cost added when every subgoal has failed; 0 is equation (4) to the letter.
    rescale_probabilities: where they sum to less than 1, scale the P_S of all subgoals to sum to 1.
    optimism: added to the log-odds of every P_S; 0 takes the estimates as they are.
    on_estimate: told of every call of the estimator, for records and pictures.
    """

    estimator: Estimator
    max_subgoals: int = 12
    failure_penalty_m: float = 0.0
    rescale_probabilities: bool = False
    optimism: float = 0.0
    on_estimate: Callable[[Estimated], None] | None = None
    _stored: dict[bytes, "_Stored"] = field(default_factory=dict, init=False)
    _around: Surroundings | None = field(default=None, init=False)
    _distances: GateDistances | None = field(default=None, init=False)

    def plan(self, seen: Seen) -> NDArray[np.int32] | None:
        """Return the path through the chosen subgoal's frontier, or to the goal once it is in reach.

        Raises:
            PlannerError: an estimate is no probability or no cost.
        """
        if self._around is None or self._distances is None or not self._around.are_of(seen.map):
            self._around = Surroundings(seen)
            self._distances = GateDistances(seen.map, self._around.work)
        else:
            self._around.update(seen)
        around, cols = self._around, seen.map.status.shape[1]
        if around.goal_in_reach:
            return around.reach.path_to(seen.goal.row * cols + seen.goal.col)
        if not around.subgoals:
            return None
        self._estimate_changed(seen, around)
        gate = self._choose(seen, around, self._distances)
        return self._distances.path_between(seen.pose.row * cols + seen.pose.col, gate)

    def _estimate_changed(self, seen: Seen, around: Surroundings) -> None:
        changed = [subgoal for subgoal in around.subgoals if subgoal.key not in self._stored]
        kept = {subgoal.key: self._stored[subgoal.key] for subgoal in around.subgoals if subgoal.key in self._stored}
        asked = changed if self.estimator.lasting else around.subgoals
        if asked:
            estimates = self.estimator.estimate(seen, around, asked)
            properties = _checked(estimates, len(asked), f"{type(self.estimator).__name__}, scan {seen.step + 1}")
            stored = map(_Stored, properties, around.gates_of(asked))
            kept |= {subgoal.key: found for subgoal, found in zip(asked, stored, strict=True)}
        self._stored = kept
        if changed and self.on_estimate is not None:
            self.on_estimate(Estimated(seen, around, changed, [kept[subgoal.key].properties for subgoal in changed]))

    def _choose(self, seen: Seen, around: Surroundings, distances: GateDistances) -> int:
        """Return the flat cell of the gate to go to, priced from the gates that the estimates were made for."""
        stored = [self._stored[subgoal.key] for subgoal in around.subgoals]
        gates = np.array([each.gate for each in stored], dtype=np.int32)
        if gates.size == 1:
            return int(gates[0])
        reach, onward = around.reach.distance_to(gates), around.onward[gates]
        p_success, delta, exploration = np.array([each.properties for each in stored]).T
        kept = most_promising(p_success, reach + onward, self.max_subgoals)
        points, reach, onward = gates[kept], reach[kept], onward[kept]
        p_success, delta, exploration = p_success[kept], delta[kept], exploration[kept]
        if self.rescale_probabilities and 0.0 < p_success.sum() < 1.0:
            p_success = p_success / p_success.sum()
        metres = seen.resolution
        order, *_ = order_subgoals(
            reach * metres,
            distances.between(points) * metres,
            _shift(p_success, self.optimism),
            onward * metres + delta,
            exploration,
            failure_penalty=self.failure_penalty_m,
        )
        return int(points[order[0]])


def _checked(estimates: Estimates, asked: int, by: str) -> list[Properties]:
    """Return the estimates of ``asked`` subgoals one by one.

    by: whose they are, for the message.

    Raises:
        PlannerError: they are not ``asked`` of each kind, or one is no probability or no cost.
    """
    shapes = [np.shape(values) for values in estimates]
    if shapes != [(asked,)] * len(Properties._fields):
        raise PlannerError(f"{by}: estimates of shapes {shapes} for {asked} subgoals, expected three of ({asked},).")
    properties = [Properties(*map(float, values)) for values in zip(*estimates, strict=True)]
    for place, each in enumerate(properties):
        if not (0.0 <= each.p_success <= 1.0 and 0.0 <= each.delta_success < inf and 0.0 <= each.exploration < inf):
            raise PlannerError(
                f"{by}: of subgoal {place} it says P_S = {each.p_success}, delta success {each.delta_success} m, "
                f"exploration {each.exploration} m, expected a probability from 0 to 1 and two finite costs of at "
                "least 0 m. No cost is recorded; mend the estimator."
            )
    return properties


def _shift(p_success: NDArray[np.float64], optimism: float) -> NDArray[np.float64]:
    """Return the probabilities with ``optimism`` added to their log-odds."""
    odds = p_success * np.exp(optimism)
    shifted: NDArray[np.float64] = odds / (odds + 1.0 - p_success)
    return shifted


@njit(cache=True, nogil=True)
def most_promising(p_success: NDArray[np.float64], through: NDArray[np.float64], most: int) -> NDArray[np.int64]:
    """Return the places, ascending, of ``most`` subgoals: two of least optimistic cost, then the most likely ones."""
    kept = np.zeros(p_success.size, dtype=np.bool_)
    for count in range(min(most, kept.size)):
        best = -1
        for place in range(kept.size):
            if kept[place]:
                continue
            nearer = best < 0 or through[place] < through[best]
            likelier = best < 0 or p_success[place] > p_success[best]
            equal = best >= 0 and p_success[place] == p_success[best]
            if nearer if count < 2 else likelier or (equal and nearer):
                best = place
        kept[best] = True
    return np.flatnonzero(kept)
