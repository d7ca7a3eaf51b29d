from math import ceil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.evaluation.trimmed_line import fit_origin_line, kept_count, resampled_slopes


def noisy_costs(seed: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    x = rng.uniform(5.0, 50.0, size)
    return x, x * rng.uniform(0.4, 1.1, size)


@given(seed=st.integers(0, 10_000), size=st.integers(20, 300), slope=st.floats(0.1, 3.0))
def test_a_planted_slope_is_found_among_five_percent_outliers(seed: int, size: int, slope: float) -> None:
    rng = np.random.default_rng(seed)
    x = rng.uniform(5.0, 50.0, size)
    y = slope * x
    wrong = rng.choice(size, size=size - ceil(round(0.95 * size, 9)), replace=False)
    y[wrong] += rng.uniform(20.0, 200.0, wrong.size)
    line = fit_origin_line(x, y, rng=rng)
    assert line.slope == pytest.approx(slope, rel=1e-9)
    assert sorted(np.flatnonzero(~line.inliers)) == sorted(wrong)
    assert line.residual_m < 1e-9


@given(seed=st.integers(0, 10_000), size=st.integers(1, 200))
def test_exactly_the_asked_share_is_kept(seed: int, size: int) -> None:
    line = fit_origin_line(*noisy_costs(seed, size), rng=np.random.default_rng(0))
    assert int(line.inliers.sum()) == kept_count(size)


@given(seed=st.integers(0, 10_000), size=st.integers(5, 200))
def test_slope_inliers_and_threshold_agree(seed: int, size: int) -> None:
    x, y = noisy_costs(seed, size)
    slope, inliers, residual_m = fit_origin_line(x, y, rng=np.random.default_rng(0))
    distance = np.abs(y - slope * x)
    assert slope == pytest.approx(float(np.linalg.lstsq(x[inliers, None], y[inliers], rcond=None)[0][0]))
    assert residual_m == distance[inliers].max()
    assert np.all(distance[~inliers] >= residual_m)


@given(seed=st.integers(0, 10_000), size=st.integers(5, 100), power=st.integers(-6, 6))
def test_scaling_both_costs_leaves_the_slope(seed: int, size: int, power: int) -> None:
    x, y = noisy_costs(seed, size)
    plain = fit_origin_line(x, y, rng=np.random.default_rng(0))
    scaled = fit_origin_line(x * 2.0**power, y * 2.0**power, rng=np.random.default_rng(0))
    assert scaled.slope == plain.slope
    assert np.array_equal(scaled.inliers, plain.inliers)


def test_drawn_hypotheses_are_seeded() -> None:
    x, y = noisy_costs(3, 400)
    first, second = (fit_origin_line(x, y, rng=np.random.default_rng(5), max_hypotheses=50) for _ in range(2))
    assert first.slope == second.slope
    assert first.slope == pytest.approx(fit_origin_line(x, y, rng=np.random.default_rng(5)).slope, rel=0.02)


def slow_slope(x: np.ndarray, y: np.ndarray, start: float) -> float:
    """Twin of resampled_slopes for one resample: sort, keep, refit, until nothing moves."""
    slope = start
    for _ in range(50):
        kept = sorted(range(x.size), key=lambda index: abs(y[index] - slope * x[index]))[: kept_count(x.size)]
        renewed = sum(x[i] * y[i] for i in kept) / sum(x[i] * x[i] for i in kept)
        if abs(renewed - slope) < 1e-13:
            break
        slope = renewed
    return float(slope)


def test_resampled_slopes_equal_their_slow_twin() -> None:
    x, y = noisy_costs(8, 80)
    start = fit_origin_line(x, y, rng=np.random.default_rng(0)).slope
    index = np.random.default_rng(1).permuted(np.tile(np.arange(80), (40, 1)), axis=1)[:, :60]
    fast = resampled_slopes(x[index], y[index], start=start)
    slow = [slow_slope(x[row], y[row], start) for row in index]
    np.testing.assert_allclose(fast, slow, rtol=1e-9)


def test_a_resample_refitted_from_the_start_agrees_with_a_new_search() -> None:
    x, y = noisy_costs(8, 120)
    start = fit_origin_line(x, y, rng=np.random.default_rng(0)).slope
    index = np.random.default_rng(1).integers(120, size=(60, 120))
    near = resampled_slopes(x[index], y[index], start=start)
    anew = [fit_origin_line(x[row], y[row], rng=np.random.default_rng(0)).slope for row in index]
    assert np.median(np.abs(near - anew)) < 0.002
    assert abs(np.std(near) - np.std(anew)) < 0.25 * np.std(anew)


@pytest.mark.parametrize(("size", "kept"), [(1, 1), (19, 19), (20, 19), (100, 95), (300, 285), (1200, 1140), (21, 20)])
def test_kept_count(size: int, kept: int) -> None:
    assert kept_count(size) == kept


@pytest.mark.parametrize(
    ("x", "y", "message"),
    [
        ([], [], "n > 0"),
        ([1.0, 2.0], [1.0], "two equal arrays"),
        ([0.0, 1.0], [1.0, 1.0], "must be positive"),
        ([1.0, 1.0], [np.nan, 1.0], "finite"),
    ],
)
def test_bad_costs_are_refused(x: list[float], y: list[float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        fit_origin_line(np.array(x), np.array(y), rng=np.random.default_rng(0))
