import numpy as np
import pytest
from sklearn.metrics import roc_auc_score

from pipeline.learning.calibration import Calibration, calibrate, sigmoid
from pipeline.learning.metrics import auc, calibration_error, score


def draw(slope: float, offset: float, count: int = 20_000) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    logit = rng.normal(1.0, 2.0, count)
    return logit, rng.random(count) < sigmoid(slope * logit + offset)


@pytest.mark.parametrize(("slope", "offset"), [(1.0, 0.0), (0.5, -1.0), (2.0, 0.7), (1.0, -3.0)])
def test_the_true_calibration_is_found(slope: float, offset: float) -> None:
    logit, leads = draw(slope, offset)
    found = calibrate(logit, leads)
    assert found.slope == pytest.approx(slope, abs=0.06)
    assert found.offset == pytest.approx(offset, abs=0.1)
    assert calibration_error(sigmoid(found.slope * logit + found.offset), leads) < 0.01


def test_class_weights_in_training_are_undone() -> None:
    logit, leads = draw(1.0, -2.0)
    before = calibration_error(sigmoid(logit), leads)
    found = calibrate(logit, leads)
    assert calibration_error(sigmoid(found.slope * logit + found.offset), leads) < 0.1 * before


@pytest.mark.parametrize(
    ("logit", "leads"),
    [
        ([1.0, 2.0], [True, True]),
        ([1.0, 2.0], [False, False]),
        ([], []),
        ([1.0, 2.0, 3.0, 4.0], [True, True, False, False]),  # worse than useless: a slope below 0 is refused
    ],
)
def test_without_evidence_nothing_is_changed(logit: list[float], leads: list[bool]) -> None:
    assert calibrate(np.array(logit), np.array(leads, dtype=bool)) == Calibration()


def test_perfect_separation_stays_finite() -> None:
    found = calibrate(np.array([-100.0, -99.0, 99.0, 100.0]), np.array([False, False, True, True]))
    assert np.isfinite(found).all()
    assert found.slope > 0


def test_sigmoid_does_not_overflow() -> None:
    with np.errstate(all="raise"):
        assert sigmoid(np.array([-1e4, 0.0, 1e4])).tolist() == [0.0, 0.5, 1.0]


def test_auc_equals_a_peers_with_ties() -> None:
    rng = np.random.default_rng(1)
    p, leads = rng.integers(0, 7, 300) / 7.0, rng.random(300) < 0.3
    assert auc(p, leads) == pytest.approx(roc_auc_score(leads, p))


def test_scores_by_hand() -> None:
    p = np.array([0.9, 0.6, 0.2, 0.4])
    leads = np.array([True, False, False, True])
    costs = np.array([[3.0, 9.0], [9.0, 5.0], [9.0, 1.0], [1.0, 9.0]])
    truth = np.array([[2.0, 0.0], [0.0, 5.0], [0.0, 3.0], [4.0, 0.0]])
    found = score(p, costs, leads, truth, np.array([2.0, 4.0]))
    assert found["accuracy"] == 0.5
    assert found["accuracy_base"] == 0.5
    assert found["auc"] == 0.75
    assert found["cross_entropy"] == pytest.approx(-np.log([0.9, 0.4, 0.8, 0.4]).mean())
    assert found["calibration_error"] == pytest.approx((0.1 + 0.6 + 0.2 + 0.6) / 4)
    assert (found["delta_success_mae_m"], found["delta_success_mae_base_m"]) == (2.0, 1.0)
    assert (found["exploration_mae_m"], found["exploration_mae_base_m"]) == (1.0, 1.0)


def test_scores_of_one_class_leave_out_what_it_cannot_tell() -> None:
    found = score(np.array([0.5]), np.zeros((1, 2)), np.array([True]), np.zeros((1, 2)), np.zeros(2))
    assert "auc" not in found
    assert "exploration_mae_m" not in found
    assert score(np.empty(0), np.empty((0, 2)), np.empty(0, bool), np.empty((0, 2)), np.zeros(2)) == {"rows": 0.0}
