import numpy as np
import pytest
import torch

from models.subgoals import SubgoalNet
from pipeline.learning.rows import Rows
from pipeline.systems.subgoals.scaling import mean_costs
from pipeline.systems.subgoals.training import scale_network
from tests.learning.synthetic import make_examples


def test_the_scaling_uses_each_target_only_where_it_applies() -> None:
    examples = make_examples(500, seed=0)
    examples["inputs"][:, 7] = 3.0  # never varies
    net = SubgoalNet(inputs=12, hidden=(4,))
    scale_network(net, examples)
    leads, targets = examples["leads"] > 0.5, examples["targets_m"]
    assert net.target_mean[0] == pytest.approx(float(targets[leads, 0].mean()), rel=1e-5)
    scaled = net.scale(targets)
    assert float(scaled[leads, 0].std(correction=0)) == pytest.approx(1.0, rel=1e-4)
    assert float(scaled[~leads, 1].mean()) == pytest.approx(0.0, abs=1e-4)
    assert net.input_std[7] == 1.0


@pytest.mark.parametrize("target_scaling", ["standardise", "log"])
def test_blocks_give_the_bits_of_whole_arrays(target_scaling: str) -> None:
    examples = make_examples(30_000, seed=1)
    net = SubgoalNet(inputs=12, hidden=(4,), target_scaling=target_scaling)  # type: ignore[arg-type]
    scale_network(net, examples)
    whole = examples["inputs"].double()
    assert torch.equal(net.input_mean, whole.mean(dim=0).float())
    assert torch.equal(net.input_std, whole.std(dim=0, correction=0).float())
    unscaled = SubgoalNet(inputs=12, hidden=(4,), target_scaling=target_scaling)  # type: ignore[arg-type]
    targets, leads = unscaled.scale(examples["targets_m"]).double(), examples["leads"] > 0.5
    for column, applies in enumerate((leads, ~leads)):
        assert net.target_mean[column] == targets[applies, column].mean().float()
        assert net.target_std[column] == targets[applies, column].std(correction=0).float()


def test_mean_costs_are_over_the_rows_to_which_they_apply() -> None:
    rows = Rows(
        {
            "inputs": torch.zeros(3, 1),
            "leads": torch.tensor([1.0, 0.0, 1.0]),
            "targets_m": torch.tensor([[2.0, 0.0], [0.0, 5.0], [4.0, 0.0]]),
        }
    )
    assert mean_costs(rows).tolist() == [3.0, 5.0]
    assert mean_costs(Rows(rows.batch(torch.tensor([0, 2]), torch.device("cpu")))).tolist() == [3.0, 0.0]
    many = make_examples(20_000, seed=2)
    leads = many["leads"].numpy() > 0.5
    whole = [
        many["targets_m"].numpy()[rows, column].mean(dtype=np.float64) for rows, column in ((leads, 0), (~leads, 1))
    ]
    assert mean_costs(many) == pytest.approx(whole, rel=1e-12)
