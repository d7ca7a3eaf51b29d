from itertools import pairwise

import numpy as np
import pytest
import torch
from torch import nn

from pipeline.learning.dense import DenseNetwork


def dense_of(net: nn.Sequential) -> DenseNetwork:
    layers = [layer for layer in net if isinstance(layer, nn.Linear)]
    return DenseNetwork([(layer.weight.detach().numpy(), layer.bias.detach().numpy()) for layer in layers])


def make_net(*widths: int) -> nn.Sequential:
    parts: list[nn.Module] = []
    for fan_in, fan_out in pairwise(widths):
        parts += [nn.Linear(fan_in, fan_out), nn.Sigmoid()]
    return nn.Sequential(*parts[:-1])


@pytest.mark.parametrize("widths", [(5, 3), (9, 7, 2), (33, 16, 8, 1)])
def test_it_equals_torch_on_a_thousand_rows(widths: tuple[int, ...]) -> None:
    torch.manual_seed(0)
    net, inputs = make_net(*widths), torch.randn(1500, widths[0]) * 3
    with torch.no_grad():
        expected = net(inputs).numpy()
    np.testing.assert_allclose(dense_of(net).run(inputs.numpy()), expected, rtol=1e-5, atol=1e-5)


def test_a_row_is_the_same_bits_alone_and_among_others() -> None:
    dense, inputs = dense_of(make_net(9, 7, 2)), np.random.default_rng(0).random((50, 9)).astype(np.float32)
    assert np.array_equal(dense.run(inputs), np.concatenate([dense.run(row[None]) for row in inputs]))


def test_other_widths_are_refused() -> None:
    with pytest.raises(ValueError, match=r"shape \(2, 8\), expected \[n, 9\]"):
        dense_of(make_net(9, 7, 2)).run(np.zeros((2, 8), np.float32))
