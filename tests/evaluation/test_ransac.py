import numpy as np
import pytest

from pipeline.evaluation.ransac import fit_ransac_line

RNG = 0


def planted(size: int = 900) -> tuple[np.ndarray, np.ndarray]:
    """Return costs on y = 0.5 x + 12 m; each eleventh trial lies 60 m above, at right angles more than 20 m away."""
    x = np.random.default_rng(1).uniform(10.0, 200.0, size)
    y = 0.5 * x + 12.0
    y[::11] += 60.0
    return x, y


def test_a_planted_line_is_found_with_its_intercept() -> None:
    x, y = planted()
    line = fit_ransac_line(x, y, rng=np.random.default_rng(RNG))
    assert line is not None
    assert (line.slope, line.intercept_m) == pytest.approx((0.5, 12.0))
    assert np.array_equal(np.flatnonzero(~line.inliers), np.arange(0, 900, 11))


def test_it_is_a_line_by_total_least_squares() -> None:
    """Through (0, 0), (2, 0), (4, 4), (6, 4) the residuals at right angles are least; ordinary ones would say 0.8."""
    x, y = np.array([0.0, 2.0, 4.0, 6.0]), np.array([0.0, 0.0, 4.0, 4.0])
    line = fit_ransac_line(x, y, rng=np.random.default_rng(RNG))
    assert line is not None
    # scatter: xx = 20, yy = 16, xy = 16; tan = (yy - xx + sqrt((yy - xx)^2 + 4 xy^2)) / (2 xy)
    slope = (-4.0 + np.sqrt(16.0 + 4.0 * 256.0)) / 32.0
    assert line.slope == pytest.approx(slope)
    assert line.intercept_m == pytest.approx(2.0 - 3.0 * slope)


def test_the_threshold_has_the_unit_of_the_costs() -> None:
    x, y = planted()
    metres = fit_ransac_line(x, y, rng=np.random.default_rng(RNG))
    cells = fit_ransac_line(10.0 * x, 10.0 * y, rng=np.random.default_rng(RNG), threshold_m=200.0)
    assert metres is not None
    assert cells is not None
    assert (cells.slope, cells.intercept_m) == pytest.approx((metres.slope, 10.0 * metres.intercept_m))


def test_equal_seeds_give_equal_lines() -> None:
    rng = np.random.default_rng(2)
    x = rng.uniform(10.0, 300.0, 950)
    y = x * rng.uniform(0.4, 1.6, 950)
    first, second = (fit_ransac_line(x, y, rng=np.random.default_rng(4)) for _ in range(2))
    assert first is not None
    assert second is not None
    assert first.slope == second.slope
    assert np.array_equal(first.inliers, second.inliers)


@pytest.mark.parametrize(
    ("x", "y"), [([], []), ([4.0, 9.0], [1.0, 2.0]), ([5.0] * 4, [1.0, 2.0, 3.0, 4.0]), ([5.0] * 4, [2.0] * 4)]
)
def test_no_line_is_a_value(x: list[float], y: list[float]) -> None:
    assert fit_ransac_line(np.array(x), np.array(y), rng=np.random.default_rng(RNG)) is None


@pytest.mark.parametrize(("x", "y"), [([1.0, 2.0], [1.0]), ([1.0, np.nan, 3.0], [1.0, 2.0, 3.0])])
def test_bad_costs_are_refused(x: list[float], y: list[float]) -> None:
    with pytest.raises(ValueError, match=r"equal arrays|finite"):
        fit_ransac_line(np.array(x), np.array(y), rng=np.random.default_rng(RNG))
