import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sklearn.metrics import brier_score_loss, roc_auc_score

from pipeline.evaluation.calibration import area_under_curve, calibrate, regression_error, wilson


def test_reliability_computed_by_hand() -> None:
    predicted = np.array([0.05, 0.05, 0.15, 0.95, 1.0])
    leads = np.array([False, True, False, True, True])
    found = calibrate(predicted, leads)
    assert [row.count for row in found.bins] == [2, 1, 0, 0, 0, 0, 0, 0, 0, 2]
    assert (found.bins[0].predicted, found.bins[0].observed) == (pytest.approx(0.05), 0.5)
    assert (found.bins[2].predicted, found.bins[2].observed_low) == (None, None)
    assert found.ece == pytest.approx((2 * 0.45 + 1 * 0.15 + 2 * 0.025) / 5)
    assert found.brier == pytest.approx((0.05**2 + 0.95**2 + 0.15**2 + 0.05**2 + 0.0) / 5)
    assert found.auc == pytest.approx((0.5 + 0 + 2 + 2) / 6)  # the pair (0.05, 0.05) is a tie


def test_certainty_that_is_right_is_perfect() -> None:
    leads = np.array([True, False, True])
    found = calibrate(leads.astype(float), leads)
    assert (found.ece, found.brier, found.auc) == (0.0, 0.0, 1.0)


@given(st.integers(0, 10_000), st.integers(2, 200))
def test_scores_equal_scikit_learn(seed: int, size: int) -> None:
    rng = np.random.default_rng(seed)
    predicted, leads = rng.integers(0, 12, size) / 11.0, rng.random(size) < 0.4
    assert calibrate(predicted, leads).brier == pytest.approx(brier_score_loss(leads, predicted))
    if 0 < leads.sum() < size:
        assert area_under_curve(predicted, leads) == pytest.approx(roc_auc_score(leads, predicted))
    else:
        assert area_under_curve(predicted, leads) is None


def test_wilson_against_published_values() -> None:
    # Newcombe 1998, table I: 81 of 263 and 0 of 20
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)
    assert wilson(0, 0) == (0.0, 1.0)


def test_regression_errors_by_hand() -> None:
    found = regression_error(np.array([1.0, 2.0, 6.0]), np.array([2.0, 2.0, 3.0]))
    assert found is not None
    assert (found.count, found.mean_true) == (3, pytest.approx(7 / 3))
    assert (found.bias, found.mae, found.median_error) == pytest.approx((2 / 3, 4 / 3, 1.0))
    assert found.rmse == pytest.approx((10 / 3) ** 0.5)
    assert found.r2 == pytest.approx(1 - 10 / (2 / 3))


def test_nothing_to_compare_is_none_and_a_constant_has_no_variance() -> None:
    assert regression_error(np.array([]), np.array([])) is None
    constant = regression_error(np.array([1.0, 2.0]), np.array([1.0, 1.0]))
    assert constant is not None
    assert constant.r2 is None


@pytest.mark.parametrize(
    ("predicted", "leads", "message"),
    [
        ([], [], "n > 0"),
        ([0.5], [True, False], "two equal arrays"),
        ([1.5], [True], "lie in"),
        ([np.nan], [True], "lie in"),
    ],
)
def test_bad_estimates_are_refused(predicted: list[float], leads: list[bool], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        calibrate(np.array(predicted, dtype=float), np.array(leads, dtype=bool))
