"""The subgoal planner: estimate what lies beyond each frontier, solve for the best order, take its first (LSP 2)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.grids.distances import NO_TARGETS, Field, descend, pair_distances, settle
from pipeline.grids.partial_map import CLEAR, UNSEEN
from pipeline.planning.expected_cost import order_subgoals
from pipeline.planning.protocols import Estimator
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings, find_subgoals


class Properties(NamedTuple):
    """The stored estimate of one subgoal: P_S, delta success cost [m], exploration cost [m]."""

    p_success: float
    delta_success: float
    exploration: float


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
    _stored: dict[bytes, Properties] = field(default_factory=dict, init=False)

    def plan(self, seen: Seen) -> NDArray[np.int32] | None:
        """Return the path through the chosen subgoal's frontier, or to the goal once it is in reach."""
        cols = seen.map.status.shape[1]
        goal = seen.goal.row * cols + seen.goal.col
        around = find_subgoals(seen)
        if np.isfinite(around.reach[seen.goal.row, seen.goal.col]):
            return descend(around.reach, seen.map.status, CLEAR, goal)[::-1].copy()
        if not around.subgoals:
            return None
        self._estimate_changed(seen, around)
        optimistic = settle(seen.map.status, UNSEEN, goal, NO_TARGETS)
        chosen = self._choose(seen, around, optimistic)
        return _path_through(chosen, seen, around.reach, optimistic)

    def _estimate_changed(self, seen: Seen, around: Surroundings) -> None:
        changed = [subgoal for subgoal in around.subgoals if subgoal.key not in self._stored]
        kept = {subgoal.key: self._stored[subgoal.key] for subgoal in around.subgoals if subgoal.key in self._stored}
        asked = changed if self.estimator.lasting else around.subgoals
        if asked:
            estimates = self.estimator.estimate(seen, around, asked)
            properties = [Properties(*map(float, values)) for values in zip(*estimates, strict=True)]
            kept |= {subgoal.key: found for subgoal, found in zip(asked, properties, strict=True)}
        self._stored = kept
        if changed and self.on_estimate is not None:
            self.on_estimate(Estimated(seen, around, changed, [kept[subgoal.key] for subgoal in changed]))

    def _choose(self, seen: Seen, around: Surroundings, optimistic: Field) -> Subgoal:
        if len(around.subgoals) == 1:
            return around.subgoals[0]
        stored = np.array([self._stored[subgoal.key] for subgoal in around.subgoals])
        gates = np.array([_gate(subgoal, around.reach, optimistic) for subgoal in around.subgoals], dtype=np.int32)
        through = around.reach.ravel()[gates] + optimistic.ravel()[gates]
        kept = _most_promising(stored[:, 0], through, self.max_subgoals)
        subgoals: list[Subgoal] = [around.subgoals[index] for index in kept]
        points = gates[kept]
        p_success, delta, exploration = stored[kept].T
        if self.rescale_probabilities and 0.0 < p_success.sum() < 1.0:
            p_success = p_success / p_success.sum()
        metres = seen.resolution
        p_success = _shift(p_success, self.optimism)
        order, _ = order_subgoals(
            around.reach.ravel()[points] * metres,
            pair_distances(seen.map.status, CLEAR, points) * metres,
            p_success,
            optimistic.ravel()[points] * metres + delta,
            exploration,
            failure_penalty=self.failure_penalty_m,
        )
        return subgoals[order[0]]


def _path_through(subgoal: Subgoal, seen: Seen, reach: Field, optimistic: Field) -> NDArray[np.int32]:
    """Return the path to the frontier cell on the shortest way robot -> frontier -> goal."""
    gate = _gate(subgoal, reach, optimistic)
    robot = seen.pose.row * reach.shape[1] + seen.pose.col
    field = settle(seen.map.status, CLEAR, gate, np.array([robot], dtype=np.int32))
    return descend(field, seen.map.status, CLEAR, robot)


def _shift(p_success: NDArray[np.float64], optimism: float) -> NDArray[np.float64]:
    """Return the probabilities with ``optimism`` added to their log-odds."""
    odds = p_success * np.exp(optimism)
    shifted: NDArray[np.float64] = odds / (odds + 1.0 - p_success)
    return shifted


def _most_promising(p_success: NDArray[np.float64], through: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Return the places of ``count`` subgoals: the two of least optimistic cost, then the most likely ones."""
    nearest = np.argsort(through, kind="stable")[: min(2, count)]
    rank = np.lexsort((through, -p_success))
    others = rank[~np.isin(rank, nearest)]
    return np.sort(np.concatenate([nearest, others[: count - nearest.size]]))


def _gate(subgoal: Subgoal, reach: Field, optimistic: Field) -> int:
    through = reach.ravel()[subgoal.cells] + optimistic.ravel()[subgoal.cells]
    return int(subgoal.cells[int(np.argmin(through))])
