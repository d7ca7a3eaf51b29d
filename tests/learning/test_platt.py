import numpy as np
import pytest

from pipeline.learning import platt
from pipeline.learning.platt import PlattScaling, fit_platt, sigmoid


def calibration_error(p: np.ndarray, leads: np.ndarray) -> float:
    """The mean gap between p and frequency over ten bins."""
    bins = np.minimum((10 * p).astype(int), 9)
    return float(sum(abs((p - leads)[bins == index].sum()) for index in range(10)) / len(p))


def draw(slope: float, offset: float, count: int = 20_000) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    logit = rng.normal(1.0, 2.0, count)
    return logit, rng.random(count) < sigmoid(slope * logit + offset)


@pytest.mark.parametrize(("slope", "offset"), [(1.0, 0.0), (0.5, -1.0), (2.0, 0.7), (1.0, -3.0)])
def test_the_true_scaling_is_found(slope: float, offset: float) -> None:
    logit, leads = draw(slope, offset)
    found = fit_platt(logit, leads)
    assert found.slope == pytest.approx(slope, abs=0.06)
    assert found.offset == pytest.approx(offset, abs=0.1)
    assert calibration_error(sigmoid(found.slope * logit + found.offset), leads) < 0.01


def test_class_weights_in_training_are_undone() -> None:
    logit, leads = draw(1.0, -2.0)
    before = calibration_error(sigmoid(logit), leads)
    found = fit_platt(logit, leads)
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
    assert fit_platt(np.array(logit), np.array(leads, dtype=bool)) == PlattScaling()


def test_perfect_separation_stays_finite() -> None:
    found = fit_platt(np.array([-100.0, -99.0, 99.0, 100.0]), np.array([False, False, True, True]))
    assert np.isfinite(found).all()
    assert found.slope > 0


def test_sigmoid_does_not_overflow() -> None:
    with np.errstate(all="raise"):
        assert sigmoid(np.array([-1e4, 0.0, 1e4])).tolist() == [0.0, 0.5, 1.0]


def test_blocks_give_what_whole_arrays_give(monkeypatch: pytest.MonkeyPatch) -> None:
    logit, leads = draw(0.7, -0.4, 150_000)
    found = fit_platt(logit.astype(np.float32), leads.astype(np.float32))
    monkeypatch.setattr(platt, "row_blocks", lambda count: [slice(0, count)])
    assert found == pytest.approx(fit_platt(logit.astype(np.float32), leads), rel=1e-9)
