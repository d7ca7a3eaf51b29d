"""How good the network's three outputs are, apart from the drive: calibration of P_S, errors of the two costs."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

BINS = 10
_Z_95 = 1.959963984540054


@dataclass(frozen=True, kw_only=True)
class ReliabilityBin:
    """Subgoals whose predicted P_S lies in [low, high) (the last bin includes 1).

    predicted: mean P_S; observed: share that did lead to the goal, with its 95 % Wilson interval; None where empty.
    """

    low: float
    high: float
    count: int
    predicted: float | None
    observed: float | None
    observed_low: float | None
    observed_high: float | None


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Quality of P_S over ``count`` subgoals of which ``positives`` lead to the goal.

    ece: mean |observed - predicted| over bins, weighted by their counts. brier: mean squared error of P_S.
    auc: chance that a subgoal that leads to the goal is rated above one that does not; None with one class only.
    """

    count: int
    positives: int
    ece: float
    brier: float
    auc: float | None
    bins: tuple[ReliabilityBin, ...]


@dataclass(frozen=True, kw_only=True)
class RegressionError:
    """Errors of a predicted cost over ``count`` subgoals [m]; r2 is the share of variance explained, None if none.

    bias: mean of predicted - true. mean_true: mean of the truth.
    """

    count: int
    mean_true: float
    bias: float
    mae: float
    rmse: float
    median_error: float
    r2: float | None


def wilson(successes: int, count: int) -> tuple[float, float]:
    """Return the 95 % Wilson score interval of a share (Wilson 1927); (0, 1) where there is nothing to count."""
    if count == 0:
        return 0.0, 1.0
    share, z2 = successes / count, _Z_95**2
    middle = (share + z2 / (2 * count)) / (1 + z2 / count)
    half = _Z_95 / (1 + z2 / count) * sqrt(share * (1 - share) / count + z2 / (4 * count**2))
    return max(0.0, middle - half), min(1.0, middle + half)


def calibrate(predicted: NDArray[np.float64], leads: NDArray[np.bool_], *, bins: int = BINS) -> Calibration:
    """Compare P_S [n] with whether each subgoal led to the goal [n], n > 0, in ``bins`` of equal width.

    Raises ValueError for no subgoals, arrays of different shape or a P_S outside [0, 1].
    """
    if predicted.shape != leads.shape or predicted.size == 0:
        raise ValueError(f"got P_S {predicted.shape} and outcomes {leads.shape}, expected two equal arrays [n], n > 0")
    if not np.all((predicted >= 0) & (predicted <= 1)):
        raise ValueError("P_S must lie in [0, 1]")
    place = np.minimum((predicted * bins).astype(np.int64), bins - 1)
    table = tuple(
        _bin(index / bins, (index + 1) / bins, predicted[place == index], leads[place == index])
        for index in range(bins)
    )
    gaps = [
        row.count * abs(row.observed - row.predicted)
        for row in table
        if row.observed is not None and row.predicted is not None
    ]
    return Calibration(
        count=predicted.size,
        positives=int(leads.sum()),
        ece=float(sum(gaps) / predicted.size),
        brier=float(np.mean((predicted - leads) ** 2)),
        auc=area_under_curve(predicted, leads),
        bins=table,
    )


def area_under_curve(predicted: NDArray[np.float64], leads: NDArray[np.bool_]) -> float | None:
    """Return the area under the ROC curve by ranks, ties counted half; None where one class is missing."""
    positives = int(leads.sum())
    negatives = leads.size - positives
    if positives == 0 or negatives == 0:
        return None
    _, inverse, counts = np.unique(predicted, return_inverse=True, return_counts=True)
    ranks = (np.cumsum(counts) - (counts - 1) / 2)[inverse]
    return float((ranks[leads].sum() - positives * (positives + 1) / 2) / (positives * negatives))


def regression_error(predicted: NDArray[np.float64], true: NDArray[np.float64]) -> RegressionError | None:
    """Compare a predicted cost [n] with the truth [n], in metres; None where there is nothing to compare."""
    if predicted.size == 0:
        return None
    error = predicted - true
    spread = float(np.sum((true - true.mean()) ** 2))
    return RegressionError(
        count=predicted.size,
        mean_true=float(true.mean()),
        bias=float(error.mean()),
        mae=float(np.abs(error).mean()),
        rmse=float(sqrt(np.mean(error**2))),
        median_error=float(np.median(np.abs(error))),
        r2=1.0 - float(np.sum(error**2)) / spread if spread > 0 else None,
    )


def _bin(low: float, high: float, predicted: NDArray[np.float64], leads: NDArray[np.bool_]) -> ReliabilityBin:
    count = predicted.size
    below, above = wilson(int(leads.sum()), count)
    return ReliabilityBin(
        low=low,
        high=high,
        count=count,
        predicted=float(predicted.mean()) if count else None,
        observed=float(leads.mean()) if count else None,
        observed_low=below if count else None,
        observed_high=above if count else None,
    )
