import pytest
import torch
from torch import nn

from pipeline.learning.prediction import predictions
from tests.learning.synthetic import PictureNet, make_examples, make_pictures


def test_predictions_come_in_order_and_leave_the_mode_alone() -> None:
    torch.manual_seed(0)
    net, examples = nn.Sequential(nn.Linear(12, 8), nn.Dropout(), nn.Linear(8, 3)), make_examples(70_000, 0)
    with torch.no_grad():
        expected = net.eval()(examples["inputs"])
    for training in (True, False):
        net.train(training)
        blocks = list(predictions(net, examples))
        assert net.training is training
    assert [(block.start, block.stop) for block, _ in blocks] == [(0, 65536), (65536, 70_000)]
    found = torch.cat([out for _, out in blocks])
    torch.testing.assert_close(found, expected)
    assert not found.requires_grad


@pytest.mark.parametrize("inputs_at_once", [3, 1024])
def test_any_tensor_of_any_shape_is_predicted_from(inputs_at_once: int) -> None:
    net, rows = PictureNet(), make_pictures(10, 0)
    ((block, found),) = predictions(net, rows, name="picture", inputs_at_once=inputs_at_once)
    assert block == slice(0, 10)
    with torch.no_grad():
        torch.testing.assert_close(found, net.eval()(rows["picture"]))
