import torch

from pipeline.learning.moments import Moments


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
