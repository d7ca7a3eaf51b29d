"""How well a network predicts, in numbers that can be compared between runs."""

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]


def score(
    p: Values, costs_m: Values, leads: NDArray[np.bool_], targets_m: Values, means_m: Values, *, bins: int = 10
) -> dict[str, float]:
    """Return the scores of N predictions; a score that needs a class that is missing is left out.

    p: [N] predicted P_S. costs_m: [N, 2] predicted delta success and exploration. leads: [N]. targets_m: [N, 2].
    means_m: [2] the mean of each target in training: what one would predict knowing nothing of the input.

    rows, base_rate: how many, and the share that leads to the goal. cross_entropy: mean, unweighted [nat];
    cross_entropy_base: that of always saying the base rate. accuracy: share on the right side of 0.5;
    accuracy_base: that of always naming the larger class. auc: chance that a row that leads gets the larger p.
    calibration_error: mean gap between p and frequency over ``bins`` equal bins of p, weighted by rows.
    delta_success_mae_m, exploration_mae_m: mean error where the cost applies; the same with _base predicts the mean.
    """
    scores: dict[str, float] = {"rows": float(len(p))}
    if not len(p):
        return scores
    rate = float(leads.mean())
    scores |= {
        "base_rate": rate,
        "cross_entropy": _cross_entropy(p, leads),
        "cross_entropy_base": _cross_entropy(np.full_like(p, rate), leads),
        "accuracy": float(((p > 0.5) == leads).mean()),
        "accuracy_base": max(rate, 1.0 - rate),
        "calibration_error": calibration_error(p, leads, bins=bins),
    }
    if 0.0 < rate < 1.0:
        scores["auc"] = auc(p, leads)
    for index, (name, applies) in enumerate((("delta_success", leads), ("exploration", ~leads))):
        if applies.any():
            truth = targets_m[applies, index]
            scores[f"{name}_mae_m"] = float(np.abs(costs_m[applies, index] - truth).mean())
            scores[f"{name}_mae_base_m"] = float(np.abs(means_m[index] - truth).mean())
    return scores


def auc(p: Values, leads: NDArray[np.bool_]) -> float:
    """Return the chance that a random row that leads gets a larger ``p`` than one that does not; ties count half."""
    _, inverse, counts = np.unique(p, return_inverse=True, return_counts=True)
    ranks = (np.cumsum(counts) - (counts - 1) / 2.0)[inverse]  # mean rank of equal values, from 1
    ones = int(leads.sum())
    zeros = len(leads) - ones
    return float((ranks[leads].sum() - ones * (ones + 1) / 2.0) / (ones * zeros))


def calibration_error(p: Values, leads: NDArray[np.bool_], *, bins: int = 10) -> float:
    """Return the mean gap between predicted and observed frequency over ``bins`` equal bins, weighted by rows."""
    index = np.minimum((p * bins).astype(np.int64), bins - 1)
    gap = np.bincount(index, weights=p - leads, minlength=bins)
    return float(np.abs(gap).sum() / len(p))


def _cross_entropy(p: Values, leads: NDArray[np.bool_]) -> float:
    clipped = np.clip(p, 1e-12, 1.0 - 1e-12)
    return float(-np.where(leads, np.log(clipped), np.log1p(-clipped)).mean())
