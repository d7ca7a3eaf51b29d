"""The estimator of the authors' published code: RANSAC of a line with an intercept, by scikit-image.

Their plotting code (lsp/utils/plotting.py, plot_results_data) fits ``skimage.measure.LineModelND``, a line by total
least squares, with min_samples = min(800, n - 1), residual_threshold = 200 and max_trials = 1000, and prints the slope
alone. Their costs are in grid cells of 0.1 m, so that the threshold is 20 m. It is another quantity than the line
through the origin of `pipeline.evaluation.trimmed_line`: beside an intercept of 45 cells a slope of 0.541 stands for a
total ratio of 0.768.
"""

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

THRESHOLD_M = 20.0
MOST_SAMPLES = 800
MAX_TRIALS = 1_000
# A line in the plane has two parameters; with n - 1 samples in a draw, two need a third trial beside them.
_FEWEST_TRIALS = 3


class RansacLine(NamedTuple):
    """A line y = slope * x + intercept_m with its evidence.

    slope: [m/m]. intercept_m: [m]. inliers: [n] bool, the trials within the threshold, at right angles to the line.
    """

    slope: float
    intercept_m: float
    inliers: NDArray[np.bool_]


def fit_ransac_line(
    x: NDArray[np.float64], y: NDArray[np.float64], *, rng: np.random.Generator, threshold_m: float = THRESHOLD_M
) -> RansacLine | None:
    """Fit y = slope * x + intercept to [n] costs [m] as the authors' code does; the draws come from ``rng``.

    threshold_m: an inlier lies less than this from the line, at right angles to it [m]. The costs may be in any unit
    that the threshold shares. With up to 801 trials a draw leaves out a single one, so that the fit is one of total
    least squares, renewed on its inliers: robust it is only with more.

    Returns None where no line with a slope is found: fewer than three trials, all in one place, or a vertical line.
    Raises ValueError for arrays that differ in shape or hold a value that is not finite.
    """
    if x.ndim != 1 or x.shape != y.shape:
        raise ValueError(f"got costs of shape {x.shape} and {y.shape}, expected two equal arrays [n]")
    if not (np.all(np.isfinite(x)) and np.all(np.isfinite(y))):
        raise ValueError("every cost must be finite")
    if x.size < _FEWEST_TRIALS or np.ptp(x) == 0.0:
        return None
    from skimage.measure import LineModelND, ransac

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # no line found is a value here; its deprecations are met by predict_y
        line, inliers = ransac(  # type: ignore[no-untyped-call]
            np.stack([x, y], axis=1),
            LineModelND,
            min_samples=min(MOST_SAMPLES, x.size - 1),
            residual_threshold=threshold_m,
            max_trials=MAX_TRIALS,
            rng=rng,
        )
        if line is None or inliers is None:
            return None
        at_zero, at_one = line.predict_y(np.array([0.0, 1.0]))
    slope = float(at_one - at_zero)
    return RansacLine(slope, float(at_zero), inliers) if np.isfinite(slope) else None
