"""Numbers from paired costs: total ratio, per-trial ratios, shares lost, and bootstrap intervals of them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.evaluation.paired import Costs
from pipeline.evaluation.trimmed_line import resampled_slopes, weighted_slopes

RESAMPLES = 10_000
CONFIDENCE = 0.95
# Costs are sums of a few hundred step lengths: equal drives differ by rounding only, far below this.
TIE_TOLERANCE = 1e-9
CLEAR_LOSS = 0.10
_BLOCK_CELLS = 500_000


class Interval(NamedTuple):
    """A two-sided interval at CONFIDENCE."""

    low: float
    high: float


class Ratios(NamedTuple):
    """What paired costs say; all dimensionless, below 1 is better than the baseline.

    total: sum of costs / sum of baseline costs. median, mean: of per-trial ratios. won, tied, lost: shares of trials
    that are cheaper, equal within TIE_TOLERANCE (relative), dearer; they add up to 1. clearly_lost: dearer by more
    than CLEAR_LOSS.
    """

    total: float
    median: float
    mean: float
    won: float
    tied: float
    lost: float
    clearly_lost: float


class Intervals(NamedTuple):
    """Bootstrap intervals of the total ratio, the trimmed slope, the median and the mean ratio."""

    total: Interval
    slope: Interval
    median: Interval
    mean: Interval


def trial_ratios(baseline_m: Costs, ours_m: Costs) -> Costs:
    """Return ours / baseline per trial [n]; baseline costs are positive."""
    return ours_m / baseline_m


def cost_ratios(baseline_m: Costs, ours_m: Costs) -> Ratios:
    """Return the ratios of [n] paired costs [m], n > 0. Raises ValueError for no pairs or a baseline of 0 m."""
    if baseline_m.shape != ours_m.shape or baseline_m.size == 0 or not np.all(baseline_m > 0):
        raise ValueError("cost ratios need at least one pair, and baseline costs above 0 m")
    ratios = trial_ratios(baseline_m, ours_m)
    lost = ratios > 1.0 + TIE_TOLERANCE
    won = ratios < 1.0 - TIE_TOLERANCE
    return Ratios(
        total=float(ours_m.sum() / baseline_m.sum()),
        median=float(np.median(ratios)),
        mean=float(ratios.mean()),
        won=float(won.mean()),
        tied=float((~won & ~lost).mean()),
        lost=float(lost.mean()),
        clearly_lost=float((ratios > 1.0 + CLEAR_LOSS).mean()),
    )


def bootstrap(
    baseline_m: Costs, ours_m: Costs, *, slope: float, rng: np.random.Generator, resamples: int = RESAMPLES
) -> Intervals:
    """Return percentile bootstrap intervals of [n] paired costs [m], n > 0.

    Trials are drawn with replacement, a trial's two costs together (Efron's percentile interval). ``slope`` is the
    fit on all trials. All four numbers of a resample come from the same draw.
    """
    size = baseline_m.size
    drawn: list[NDArray[np.float64]] = []
    block = max(1, min(resamples, _BLOCK_CELLS // size))
    for first in range(0, resamples, block):
        index = rng.integers(size, size=(min(block, resamples - first), size))
        drawn.append(_resampled(baseline_m[index], ours_m[index], slope))
    return _intervals(drawn)


def bootstrap_buildings(
    baseline_m: Costs,
    ours_m: Costs,
    buildings: Sequence[str],
    *,
    slope: float,
    rng: np.random.Generator,
    resamples: int = RESAMPLES,
) -> Intervals | None:
    """Return intervals as bootstrap does, with whole buildings drawn: they speak of other buildings of the kind.

    A resample is as many buildings as there are, drawn with replacement, each with all its trials ([n] costs [m], the
    building of each in ``buildings``). Trials of one building resemble each other, and drawn one by one they would
    count as so many independent ones (Field and Welsh 2007). None where all trials lie in one building: nothing then
    says how far buildings differ.
    """
    names, place = np.unique(np.asarray(buildings, dtype=object).astype(str), return_inverse=True)
    if names.size < 2:
        return None
    drawn: list[NDArray[np.float64]] = []
    block = max(1, min(resamples, _BLOCK_CELLS // baseline_m.size))
    for first in range(0, resamples, block):
        chosen = rng.integers(names.size, size=(min(block, resamples - first), names.size))
        times = np.stack([np.bincount(row, minlength=names.size) for row in chosen])
        drawn.append(_weighted(baseline_m, ours_m, times[:, place], slope))
    return _intervals(drawn)


def _intervals(drawn: list[NDArray[np.float64]]) -> Intervals:
    """Return the percentile intervals of blocks [4, resamples]."""
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(np.concatenate(drawn, axis=1), [tail, 100.0 - tail], axis=1)
    return Intervals(*(Interval(float(a), float(b)) for a, b in zip(low, high, strict=True)))


def _weighted(baseline_m: Costs, ours_m: Costs, weights: NDArray[np.int64], slope: float) -> NDArray[np.float64]:
    """Return [4, resamples]: total, slope, median, mean of the trials, each taken ``weights[r, i]`` times."""
    ratios = ours_m / baseline_m
    sizes = weights.sum(axis=1)
    return np.stack(
        [
            (weights @ ours_m) / (weights @ baseline_m),
            weighted_slopes(baseline_m, ours_m, weights, start=slope),
            _weighted_medians(ratios, weights, sizes),
            (weights @ ratios) / sizes,
        ]
    )


def _weighted_medians(values: Costs, weights: NDArray[np.int64], sizes: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the median [resamples] of ``values`` [n], each taken ``weights[r, i]`` times."""
    order = np.argsort(values, kind="stable")
    seen = np.cumsum(weights[:, order], axis=1)
    below, above = (np.argmax(seen > rank[:, None], axis=1) for rank in ((sizes - 1) // 2, sizes // 2))
    ranked = values[order]
    medians: Costs = 0.5 * (ranked[below] + ranked[above])
    return medians


def _resampled(baseline_m: Costs, ours_m: Costs, slope: float) -> NDArray[np.float64]:
    """Return [4, resamples]: total, slope, median, mean of each row of [resamples, n] costs."""
    ratios = ours_m / baseline_m
    return np.stack(
        [
            ours_m.sum(axis=1) / baseline_m.sum(axis=1),
            resampled_slopes(baseline_m, ours_m, start=slope),
            np.median(ratios, axis=1),
            ratios.mean(axis=1),
        ]
    )
