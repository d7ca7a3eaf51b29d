"""How well a network predicts, in numbers that can be compared between runs."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.evaluation.calibration import area_under_curve

Values = NDArray[np.float64]


class Predicted(NamedTuple):
    """n predictions and what is true."""

    p: Values  # [n] P_S
    costs_m: Values  # [n, 2] predicted delta success and exploration
    leads: NDArray[np.bool_]  # [n]
    targets_m: Values  # [n, 2] true delta success and exploration; only that which applies counts


def score(blocks: Iterable[Predicted], means_m: Values) -> dict[str, float]:
    """Return the scores of N predictions, seen once, block by block; one that needs a missing class is left out.

    means_m: [2] the mean of each target in training: what one would predict knowing nothing of the input.
    Each p and its label are kept, 9 bytes a row, to rank them.

    rows, base_rate: how many, and the share that leads to the goal. cross_entropy: mean, unweighted [nat];
    cross_entropy_base: that of always saying the base rate. accuracy: share on the right side of 0.5;
    accuracy_base: that of always naming the larger class. auc: chance that a row that leads gets the larger p.
    delta_success_mae_m, exploration_mae_m: mean error where the cost applies; the same with _base predicts the mean.
    """
    rows, right, entropy = 0, 0, 0.0
    errors_m, errors_base_m, counts = np.zeros(2), np.zeros(2), np.zeros(2, dtype=np.int64)
    ranked: list[tuple[Values, NDArray[np.bool_]]] = []
    for p, costs_m, leads, targets_m in blocks:
        ranked.append((p, leads))
        rows += len(p)
        right += int(((p > 0.5) == leads).sum())
        entropy += _cross_entropy(p, leads)
        for index, applies in enumerate((leads, ~leads)):
            truth = targets_m[applies, index]
            counts[index] += truth.size
            errors_m[index] += np.abs(costs_m[applies, index] - truth).sum()
            errors_base_m[index] += np.abs(means_m[index] - truth).sum()
    scores = {"rows": float(rows)}
    if not rows:
        return scores
    rate = int(counts[0]) / rows
    scores |= {
        "base_rate": rate,
        "cross_entropy": entropy / rows,
        "cross_entropy_base": rate * _surprise(rate) + (1.0 - rate) * _surprise(1.0 - rate),
        "accuracy": right / rows,
        "accuracy_base": max(rate, 1.0 - rate),
    }
    auc = area_under_curve(*(np.concatenate(parts) for parts in zip(*ranked, strict=True)))
    if auc is not None:
        scores["auc"] = auc
    for index, name in enumerate(("delta_success", "exploration")):
        if count := int(counts[index]):
            scores[f"{name}_mae_m"] = float(errors_m[index] / count)
            scores[f"{name}_mae_base_m"] = float(errors_base_m[index] / count)
    return scores


def _cross_entropy(p: Values, leads: NDArray[np.bool_]) -> float:
    clipped = np.clip(p, 1e-12, 1.0 - 1e-12)
    return float(-np.where(leads, np.log(clipped), np.log1p(-clipped)).sum())


def _surprise(p: float) -> float:
    return float(-np.log(max(p, 1e-12)))
