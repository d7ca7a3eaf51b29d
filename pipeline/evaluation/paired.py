"""Costs of two competitors on the same trials, side by side; what cannot be compared is counted, never just dropped."""

from collections import Counter
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipeline.evaluation.competitors import Role
from pipeline.evaluation.trials import FINISHED, TrialRow, trial_rows

Costs = NDArray[np.float64]


class PairedCosts(NamedTuple):
    """Costs of a competitor and of the baseline on the trials that both finished.

    trial_ids, buildings: [n], in the order of trial_id. baseline_m, ours_m: [n] distance travelled [m], positive.
    excluded: reason in words -> number of trials for which no ratio can be formed.
    """

    trial_ids: tuple[str, ...]
    buildings: tuple[str, ...]
    baseline_m: Costs
    ours_m: Costs
    excluded: dict[str, int]


def pair_costs(trials: pa.Table, competitor: str) -> PairedCosts:
    """Pair ``competitor`` with the one in the role baseline by trial_id.

    A pair is formed only where both finished and paid more than 0 m: the cost of an unreachable or cut off trial is no
    more than a lower bound. Every other trial of either is counted in ``excluded``.
    """
    rows = trial_rows(trials)
    theirs = {row.trial_id: row for row in rows if row.role == Role.baseline}
    ours = {row.trial_id: row for row in rows if row.competitor == competitor}
    baseline = next((row.competitor for row in theirs.values()), str(Role.baseline))
    excluded: Counter[str] = Counter()
    kept: list[tuple[TrialRow, TrialRow]] = []
    for trial_id in sorted(theirs.keys() | ours.keys()):
        reason = _obstacle(theirs.get(trial_id), ours.get(trial_id), competitor, baseline)
        if reason:
            excluded[reason] += 1
        else:
            kept.append((theirs[trial_id], ours[trial_id]))
    return PairedCosts(
        trial_ids=tuple(row.trial_id for _, row in kept),
        buildings=tuple(row.building for _, row in kept),
        baseline_m=np.array([row.cost_m for row, _ in kept], dtype=np.float64),
        ours_m=np.array([row.cost_m for _, row in kept], dtype=np.float64),
        excluded=dict(sorted(excluded.items())),
    )


def restrict(paired: PairedCosts, building: str) -> PairedCosts:
    """Return the pairs of one building; what was excluded is not broken down and comes back empty."""
    keep = np.array([name == building for name in paired.buildings], dtype=bool)
    chosen = np.flatnonzero(keep)
    return PairedCosts(
        trial_ids=tuple(paired.trial_ids[index] for index in chosen),
        buildings=tuple(paired.buildings[index] for index in chosen),
        baseline_m=paired.baseline_m[keep],
        ours_m=paired.ours_m[keep],
        excluded={},
    )


def _obstacle(theirs: TrialRow | None, ours: TrialRow | None, competitor: str, baseline: str) -> str:
    """Return why no ratio can be formed, empty where it can."""
    for row, name in ((theirs, baseline), (ours, competitor)):
        if row is None:
            return f"{name} did not drive this trial"
        if row.ending not in FINISHED:
            return f"{name} ended {row.ending}"
        if row.cost_m <= 0.0:
            return f"{name} travelled 0 m"
    return ""
