import numpy as np
import pytest
import torch

from models.subgoals import SubgoalNet
from pipeline.learning.examples import Examples
from pipeline.learning.scaling import Moments, fit_scaling, mean_costs
from tests.learning.synthetic import make_examples


def test_the_scaling_uses_each_target_only_where_it_applies() -> None:
    examples = make_examples(500, seed=0)
    examples.inputs[:, 7] = 3.0  # never varies
    net = SubgoalNet(inputs=12, hidden=(4,))
    fit_scaling(net, examples)
    leads, targets = examples.labels[:, 0] > 0.5, examples.labels[:, 1:3]
    assert net.target_mean[0] == pytest.approx(float(targets[leads, 0].mean()), rel=1e-5)
    scaled = net.scale(targets)
    assert float(scaled[leads, 0].std(correction=0)) == pytest.approx(1.0, rel=1e-4)
    assert float(scaled[~leads, 1].mean()) == pytest.approx(0.0, abs=1e-4)
    assert net.input_std[7] == 1.0


@pytest.mark.parametrize("target_scaling", ["standardise", "log"])
def test_blocks_give_the_bits_of_whole_arrays(target_scaling: str) -> None:
    examples = make_examples(30_000, seed=1)
    net = SubgoalNet(inputs=12, hidden=(4,), target_scaling=target_scaling)  # type: ignore[arg-type]
    fit_scaling(net, examples)
    whole = examples.inputs.double()
    assert torch.equal(net.input_mean, whole.mean(dim=0).float())
    assert torch.equal(net.input_std, whole.std(dim=0, correction=0).float())
    unscaled = SubgoalNet(inputs=12, hidden=(4,), target_scaling=target_scaling)  # type: ignore[arg-type]
    targets, leads = unscaled.scale(examples.labels[:, 1:3]).double(), examples.labels[:, 0] > 0.5
    for column, applies in enumerate((leads, ~leads)):
        assert net.target_mean[column] == targets[applies, column].mean().float()
        assert net.target_std[column] == targets[applies, column].std(correction=0).float()


def test_moments_of_blocks_are_those_of_all_rows() -> None:
    values = torch.rand(1000, 3, dtype=torch.float64) * torch.tensor([1.0, 10.0, 0.01]) + 1e4  # far from 0
    moments = Moments(3)
    for first, last in ((0, 1), (1, 1), (1, 400), (400, 1000)):
        moments.add(values[first:last])
    assert moments.count == 1000
    torch.testing.assert_close(moments.mean, values.mean(dim=0), rtol=1e-14, atol=0.0)
    torch.testing.assert_close(moments.spread[:2], values.std(dim=0, correction=0)[:2], rtol=1e-9, atol=0.0)
    assert moments.spread[2] == 1.0  # hardly varies
    assert Moments(1).spread == 1.0


def test_mean_costs_are_over_the_rows_to_which_they_apply() -> None:
    labels = torch.tensor([[1.0, 2.0, 0.0, 1.0], [0.0, 0.0, 5.0, 1.0], [1.0, 4.0, 0.0, 1.0]])
    assert mean_costs(Examples(inputs=torch.zeros(3, 1), labels=labels)).tolist() == [3.0, 5.0]
    assert mean_costs(Examples(inputs=torch.zeros(2, 1), labels=labels[[0, 2]])).tolist() == [3.0, 0.0]
    many = make_examples(20_000, seed=2)
    leads = many.leads > 0.5
    whole = [many.labels.numpy()[rows, column].mean(dtype=np.float64) for rows, column in ((leads, 1), (~leads, 2))]
    assert mean_costs(many) == pytest.approx(whole, rel=1e-12)
