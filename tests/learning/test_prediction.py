from pathlib import Path

import numpy as np
import pytest
import torch

from models.subgoals import SubgoalNet, SubgoalTraining, subgoal_losses
from pipeline.learning.calibration import Calibration, sigmoid
from pipeline.learning.examples import Examples
from pipeline.learning.metrics import Predicted, score
from pipeline.learning.prediction import logits_of, predictions, score_network, validate
from tests.learning.synthetic import make_examples


@pytest.fixture
def net() -> SubgoalNet:
    torch.manual_seed(0)
    return SubgoalNet(inputs=12, hidden=(8,))


def at_once(net: SubgoalNet, examples: Examples) -> torch.Tensor:
    with torch.no_grad():
        return net.eval()(examples.inputs)  # type: ignore[no-any-return]


def test_predictions_come_in_order_and_leave_the_mode_alone(net: SubgoalNet) -> None:
    examples = make_examples(70_000, 0)
    for training in (True, False):
        net.train(training)
        blocks = list(predictions(net, examples))
        assert net.training is training
    assert len(blocks) == 2
    torch.testing.assert_close(torch.cat([raw for _, raw in blocks]), at_once(net, examples))
    assert torch.equal(torch.cat([batch.leads_B for batch, _ in blocks]), examples.labels[:, 0])


@pytest.mark.parametrize(("count", "tolerance"), [(20_000, 0.0), (70_000, 1e-6)])
def test_validation_losses_are_those_of_one_batch_of_all(net: SubgoalNet, count: int, tolerance: float) -> None:
    examples = make_examples(count, 0)
    training = SubgoalTraining(net, success_weight=0.5, exploration_weight=2.0)
    found = validate(training, examples)
    whole = examples.batch(torch.arange(count), torch.device("cpu"))
    expected = subgoal_losses(
        at_once(net, examples), net.scale(whole.targets_m_BT), whole, success_weight=0.5, exploration_weight=2.0
    )
    assert [float(part) for part in found] == pytest.approx([float(part) for part in expected], rel=tolerance, abs=0)


def test_logits_and_scores_are_those_of_all_rows_at_once(net: SubgoalNet, tmp_path: Path) -> None:
    examples, calibration, means_m = make_examples(70_000, 1), Calibration(1.5, -0.2), np.array([3.0, 4.0])
    raw = at_once(net, examples)
    assert logits_of(net, examples, tmp_path) == pytest.approx(raw[:, 0].numpy(), rel=1e-5, abs=1e-6)
    labels = examples.labels.numpy().astype(np.float64)
    whole = Predicted(
        p=sigmoid(1.5 * raw[:, 0].numpy().astype(np.float64) - 0.2),
        costs_m=net.unscale(raw[:, 1:]).numpy().astype(np.float64),
        leads=labels[:, 0] > 0.5,
        targets_m=labels[:, 1:3],
    )
    found = score_network(net, examples, calibration, means_m, tmp_path)
    assert found == pytest.approx(score([whole], means_m, tmp_path), rel=1e-5)
    assert list(tmp_path.iterdir()) == []
