"""Make a classifier's probability mean what it says: slope and offset on its logit (Platt scaling)."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.learning.scratch import row_blocks

Values = NDArray[np.float64]


class PlattScaling(NamedTuple):
    """P = sigmoid(slope * logit + offset)."""

    slope: float = 1.0
    offset: float = 0.0


def sigmoid(logit: Values) -> Values:
    """Return 1 / (1 + exp(-logit)) without overflow."""
    return 0.5 * (1.0 + np.tanh(0.5 * logit))


def fit_platt(
    logit: NDArray[np.floating], positive: NDArray[np.bool_ | np.floating], *, iterations: int = 100
) -> PlattScaling:
    """Return the scaling that makes ``positive`` [N] most likely given ``logit`` [N], each row counting once.

    The weights of the training loss push a probability away from frequencies; this pulls it back. Needs both classes;
    with one missing, or where the best slope is not positive (logits worse than useless), nothing is changed. Targets
    are drawn in by one pseudo-count per class as Platt (1999) does, so that perfect separation keeps a finite slope.
    Both arrays are read in blocks, some ten times.
    """
    ones = sum(int((positive[block] > 0.5).sum()) for block in row_blocks(len(positive)))
    zeros = len(positive) - ones
    if not ones or not zeros:
        return PlattScaling()
    likelihood = _Likelihood(logit, positive, high=(ones + 1.0) / (ones + 2.0), low=1.0 / (zeros + 2.0))
    weights = np.array([1.0, np.log(ones / zeros)])
    loss = likelihood.loss(weights)
    for _ in range(iterations):
        gradient, curvature = likelihood.derivatives(weights)
        step = np.linalg.solve(curvature + 1e-9 * np.eye(2), gradient)
        while likelihood.loss(weights - step) > loss and np.abs(step).max() > 1e-12:
            step = 0.5 * step  # Newton overshoots where the sigmoid is flat
        weights, before = weights - step, loss
        loss = likelihood.loss(weights)
        if before - loss <= 1e-12 * max(1.0, abs(loss)):
            break
    slope = float(weights[0]) / likelihood.spread
    return PlattScaling(slope, float(weights[1]) - slope * likelihood.center) if slope > 0.0 else PlattScaling()


class _Likelihood:
    """The negative logarithm of the likelihood of the labels, as a function of [2] weights.

    They multiply the standardised logit and 1. high, low: what is wanted of a positive row, and of another.
    """

    def __init__(
        self, logit: NDArray[np.floating], positive: NDArray[np.bool_ | np.floating], *, high: float, low: float
    ) -> None:
        self._logit, self._positive, self._high, self._low = logit, positive, high, low
        count = len(logit)
        self.center = float(sum(wide.sum() for wide in self._logits()) / count)
        self.spread = float(np.sqrt(sum(np.square(wide - self.center).sum() for wide in self._logits()) / count)) or 1.0

    def loss(self, weights: Values) -> float:
        total = 0.0
        for features, target in self._blocks():
            logit = features @ weights
            total += float((np.logaddexp(0.0, logit) - target * logit).sum())
        return total

    def derivatives(self, weights: Values) -> tuple[Values, Values]:
        """Return the gradient [2] and the curvature [2, 2]."""
        gradient, curvature = np.zeros(2), np.zeros((2, 2))
        for features, target in self._blocks():
            p = sigmoid(features @ weights)
            gradient += features.T @ (p - target)
            curvature += (features * (p * (1.0 - p))[:, None]).T @ features
        return gradient, curvature

    def _logits(self) -> Iterator[Values]:
        for block in row_blocks(len(self._logit)):
            yield self._logit[block].astype(np.float64)

    def _blocks(self) -> Iterator[tuple[Values, Values]]:
        """Yield features [n, 2] and targets [n]."""
        for block, logit in zip(row_blocks(len(self._logit)), self._logits(), strict=True):
            features = np.stack([(logit - self.center) / self.spread, np.ones_like(logit)], axis=1)
            yield features, np.where(self._positive[block] > 0.5, self._high, self._low)
