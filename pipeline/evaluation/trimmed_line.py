"""A robust line through the origin: the slope of cost on baseline cost, with 95 % of the trials as inliers.

Stein, Bradley and Roy 2018 speak of RANSAC "with 95 % of the data" as inliers: the share is fixed and the residual
threshold follows. The RANSAC of scikit-learn and scikit-image fixes the threshold instead and would have to be wrapped
in a search over thresholds, with a draw of hypotheses for each; the one-parameter line needs neither. The authors'
published code fits another quantity, a line with an intercept: see `pipeline.evaluation.ransac`.
"""

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

INLIER_SHARE = 0.95
MAX_HYPOTHESES = 1_000
# Each step lowers the trimmed sum of squares over finitely many subsets, so it ends long before this.
_MAX_STEPS = 100
_BLOCK_CELLS = 500_000


class OriginLine(NamedTuple):
    """A line y = slope * x with its evidence.

    slope: [m/m]. inliers: [n] bool, the ceil(share * n) trials closest to the line. residual_m: largest distance
    |y - slope * x| among the inliers [m].
    """

    slope: float
    inliers: NDArray[np.bool_]
    residual_m: float


def fit_origin_line(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    *,
    rng: np.random.Generator,
    share: float = INLIER_SHARE,
    max_hypotheses: int = MAX_HYPOTHESES,
) -> OriginLine:
    """Fit y = slope * x to [n] costs [m] so that exactly ceil(share * n) of the trials are inliers.

    Each hypothesis is the line through one trial (all trials, or ``max_hypotheses`` drawn from ``rng``); the one that
    keeps the asked number of trials at the smallest threshold wins. It is refitted by least squares on its inliers and
    the inliers taken anew until both agree. ``x`` must be positive.

    Raises ValueError for arrays that are empty, differ in shape or hold an x that is not positive.
    """
    if x.ndim != 1 or x.shape != y.shape or x.size == 0:
        raise ValueError(f"got costs of shape {x.shape} and {y.shape}, expected two equal arrays [n], n > 0")
    if not (np.all(x > 0) and np.all(np.isfinite(x)) and np.all(np.isfinite(y))):
        raise ValueError("every baseline cost must be positive and every cost finite")
    count = kept_count(x.size, share)
    chosen = np.arange(x.size)
    if x.size > max_hypotheses:
        chosen = np.sort(rng.choice(x.size, size=max_hypotheses, replace=False))
    slope = _best_hypothesis(x, y, y[chosen] / x[chosen], count)
    inliers = _closest(x, y, slope, count)
    for _ in range(_MAX_STEPS):
        slope = float(x[inliers] @ y[inliers] / (x[inliers] @ x[inliers]))
        renewed = _closest(x, y, slope, count)
        if np.array_equal(renewed, inliers):
            break
        inliers = renewed
    return OriginLine(slope=slope, inliers=inliers, residual_m=float(np.abs(y - slope * x)[inliers].max()))


def kept_count(size: int, share: float = INLIER_SHARE) -> int:
    """Return ceil(share * size), free of the rounding that turns 0.95 * 20 into 20."""
    return min(size, max(1, ceil(round(share * size, 9))))


def resampled_slopes(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    *,
    start: float,
    share: float = INLIER_SHARE,
    steps: int = 20,
) -> NDArray[np.float64]:
    """Return the trimmed slope of each row of ``x``, ``y`` [resamples, n], concentrated from ``start``.

    The refit steps of fit_origin_line, without a new search for hypotheses: a resample lies close to the sample it was
    drawn from, so the fit of the sample is a good start, and 10,000 resamples take seconds.
    """
    last = kept_count(x.shape[1], share) - 1
    slopes = np.full(x.shape[0], start)
    xx, xy = x * x, x * y
    moving = np.arange(x.shape[0])
    for _ in range(steps):
        residual = np.abs(y[moving] - slopes[moving, None] * x[moving])
        threshold = np.partition(residual, last, axis=1)[:, last, None]
        kept = residual <= threshold
        renewed = np.where(kept, xy[moving], 0.0).sum(axis=1) / np.where(kept, xx[moving], 0.0).sum(axis=1)
        settled = np.isclose(renewed, slopes[moving], rtol=1e-10, atol=0.0)
        slopes[moving] = renewed
        moving = moving[~settled]
        if moving.size == 0:
            break
    return slopes


def weighted_slopes(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    weights: NDArray[np.int64],
    *,
    start: float,
    share: float = INLIER_SHARE,
    steps: int = 20,
) -> NDArray[np.float64]:
    """Return the trimmed slope of each resample that holds trial i of ``x``, ``y`` [n] ``weights[r, i]`` times.

    As resampled_slopes, for resamples of unequal size: every row of ``weights`` [resamples, n] holds a trial at least.
    """
    last = np.array([kept_count(int(size), share) for size in weights.sum(axis=1)])
    slopes = np.full(weights.shape[0], start)
    moving = np.arange(weights.shape[0])
    for _ in range(steps):
        order = np.argsort(np.abs(y - slopes[moving, None] * x), axis=1, kind="stable")
        counts = np.take_along_axis(weights[moving], order, axis=1)
        closer = np.cumsum(counts, axis=1) - counts
        kept = np.clip(last[moving, None] - closer, 0, counts)  # of the last trial kept perhaps not every copy
        renewed = (kept * (x * y)[order]).sum(axis=1) / (kept * (x * x)[order]).sum(axis=1)
        settled = np.isclose(renewed, slopes[moving], rtol=1e-10, atol=0.0)
        slopes[moving] = renewed
        moving = moving[~settled]
        if moving.size == 0:
            break
    return slopes


def _best_hypothesis(x: NDArray[np.float64], y: NDArray[np.float64], slopes: NDArray[np.float64], count: int) -> float:
    """Return the slope that needs the smallest threshold to keep ``count`` trials; the first of equals."""
    block = max(1, _BLOCK_CELLS // x.size)
    thresholds = [
        np.partition(np.abs(y - part[:, None] * x), count - 1, axis=1)[:, count - 1]
        for part in (slopes[first : first + block] for first in range(0, slopes.size, block))
    ]
    return float(slopes[int(np.argmin(np.concatenate(thresholds)))])


def _closest(x: NDArray[np.float64], y: NDArray[np.float64], slope: float, count: int) -> NDArray[np.bool_]:
    """Return the mask of exactly ``count`` trials closest to the line; of equals, the earlier ones."""
    mask = np.zeros(x.size, dtype=bool)
    mask[np.argsort(np.abs(y - slope * x), kind="stable")[:count]] = True
    return mask
