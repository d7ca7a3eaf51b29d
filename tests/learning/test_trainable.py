from collections.abc import Iterable, Mapping

import pytest
import torch
from torch import Tensor

from pipeline.learning.trainable import Trainable, validate
from tests.learning.synthetic import PictureTraining, make_pictures, picture_training


class Counting(PictureTraining):
    """Validates by itself: how many rows, and the worst of their losses."""

    def validate(self, blocks: Iterable[Mapping[str, Tensor]]) -> dict[str, float]:
        assert not self.training and not torch.is_grad_enabled()
        sizes, losses = zip(*((len(block["side"]), float(self.losses(block)["loss"])) for block in blocks), strict=True)
        return {"loss": max(losses), "rows": sum(sizes), "blocks": len(sizes)}


@pytest.mark.parametrize("rows_at_once", [7, 33, 1000])
def test_by_default_each_loss_is_averaged_over_rows_in_evaluation_mode(rows_at_once: int) -> None:
    training, rows = picture_training(), make_pictures(100, 0)
    before = {name: value.clone() for name, value in training.state_dict().items()}
    found = validate(training, rows, rows_at_once)
    assert training.training
    training.eval()
    with torch.no_grad():
        expected = training.losses(rows.tensors)
    assert found == pytest.approx({name: float(value) for name, value in expected.items()}, rel=1e-5)
    assert all(torch.equal(before[name], value) for name, value in training.state_dict().items())


def test_a_module_may_validate_itself() -> None:
    training = Counting(picture_training().net)
    found = validate(training, make_pictures(100, 0), 40)
    assert (found["rows"], found["blocks"]) == (100, 3)
    assert found["loss"] > validate(picture_training(), make_pictures(100, 0), 40)["loss"]


def test_what_says_no_losses_is_no_trainable() -> None:
    assert isinstance(picture_training(), Trainable)
    assert not isinstance(torch.nn.Linear(2, 2), Trainable)
