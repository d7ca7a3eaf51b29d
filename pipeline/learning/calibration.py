"""Make a classifier's probability mean what it says: slope and offset on its logit (Platt scaling)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Values = NDArray[np.float64]


class Calibration(NamedTuple):
    """P = sigmoid(slope * logit + offset)."""

    slope: float = 1.0
    offset: float = 0.0


def sigmoid(logit: Values) -> Values:
    """Return 1 / (1 + exp(-logit)) without overflow."""
    return 0.5 * (1.0 + np.tanh(0.5 * logit))


def calibrate(logit: Values, leads: NDArray[np.bool_], *, iterations: int = 100) -> Calibration:
    """Return the calibration that makes ``leads`` [N] most likely given ``logit`` [N], each row counting once.

    The weights of the training loss push P_S away from frequencies; this pulls it back. Needs both classes; with one
    missing, or where the best slope is not positive (logits worse than useless), nothing is changed. Targets are
    drawn in by one pseudo-count per class as Platt (1999) does, so that perfect separation keeps a finite slope.
    """
    ones = int(leads.sum())
    zeros = len(leads) - ones
    if not ones or not zeros:
        return Calibration()
    target = np.where(leads, (ones + 1.0) / (ones + 2.0), 1.0 / (zeros + 2.0))
    center, spread = float(logit.mean()), float(logit.std()) or 1.0
    features = np.stack([(logit - center) / spread, np.ones_like(logit)], axis=1)
    weights = np.array([1.0, np.log(ones / zeros)])
    loss = _loss(features, weights, target)
    for _ in range(iterations):
        p = sigmoid(features @ weights)
        gradient = features.T @ (p - target)
        curvature = (features * (p * (1.0 - p))[:, None]).T @ features + 1e-9 * np.eye(2)
        step = np.linalg.solve(curvature, gradient)
        while _loss(features, weights - step, target) > loss and np.abs(step).max() > 1e-12:
            step = 0.5 * step  # Newton overshoots where the sigmoid is flat
        weights, before = weights - step, loss
        loss = _loss(features, weights, target)
        if before - loss <= 1e-12 * max(1.0, abs(loss)):
            break
    slope = float(weights[0]) / spread
    return Calibration(slope, float(weights[1]) - slope * center) if slope > 0.0 else Calibration()


def _loss(features: Values, weights: Values, target: Values) -> float:
    logit = features @ weights
    return float((np.logaddexp(0.0, logit) - target * logit).sum())
