import numpy as np
import pytest
from sklearn.metrics import roc_auc_score

from pipeline.systems.subgoals.scores import Predicted, score


def draw(count: int, seed: int = 0) -> Predicted:
    rng = np.random.default_rng(seed)
    leads = rng.random(count) < 0.3
    return Predicted(rng.integers(0, 50, count) / 50.0, rng.random((count, 2)), leads, rng.random((count, 2)))


@pytest.mark.parametrize("count", [300, 300_000])
def test_auc_equals_a_peers_with_ties(count: int) -> None:
    rows = draw(count)
    assert score([rows], np.zeros(2))["auc"] == pytest.approx(roc_auc_score(rows.leads, rows.p), rel=1e-12)


def test_scores_by_hand() -> None:
    rows = Predicted(
        p=np.array([0.9, 0.6, 0.2, 0.4]),
        costs_m=np.array([[3.0, 9.0], [9.0, 5.0], [9.0, 1.0], [1.0, 9.0]]),
        leads=np.array([True, False, False, True]),
        targets_m=np.array([[2.0, 0.0], [0.0, 5.0], [0.0, 3.0], [4.0, 0.0]]),
    )
    found = score([rows], np.array([2.0, 4.0]))
    assert found["accuracy"] == 0.5
    assert found["accuracy_base"] == 0.5
    assert found["auc"] == 0.75
    assert found["cross_entropy"] == pytest.approx(-np.log([0.9, 0.4, 0.8, 0.4]).mean())
    assert found["cross_entropy_base"] == pytest.approx(np.log(2.0))
    assert (found["delta_success_mae_m"], found["delta_success_mae_base_m"]) == (2.0, 1.0)
    assert (found["exploration_mae_m"], found["exploration_mae_base_m"]) == (1.0, 1.0)


def test_the_base_rate_is_the_cross_entropy_of_always_saying_it() -> None:
    rows = draw(1000)
    found = score([rows._replace(p=np.full(1000, rows.leads.mean()))], np.zeros(2))
    assert found["cross_entropy"] == pytest.approx(found["cross_entropy_base"], rel=1e-12)
    assert found["accuracy_base"] == pytest.approx(max(rows.leads.mean(), 1 - rows.leads.mean()))


def test_blocks_give_what_all_rows_at_once_give() -> None:
    whole = draw(1000)
    blocks = [Predicted(*(part[first : first + 70] for part in whole)) for first in range(0, 1000, 70)]
    means_m = np.array([0.5, 0.4])
    assert score(blocks, means_m) == pytest.approx(score([whole], means_m), rel=1e-12)


def test_scores_of_one_class_leave_out_what_it_cannot_tell() -> None:
    one = Predicted(np.array([0.5]), np.zeros((1, 2)), np.array([True]), np.zeros((1, 2)))
    found = score([one], np.zeros(2))
    assert "auc" not in found
    assert "exploration_mae_m" not in found
    assert found["cross_entropy_base"] == 0.0
    assert score([], np.zeros(2)) == {"rows": 0.0}
