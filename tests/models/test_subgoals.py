import pytest
import torch
from torch import nn

from models.subgoals import (
    Batch,
    Dropout,
    LossSums,
    SubgoalNet,
    SubgoalPredictor,
    SubgoalTraining,
    loss_sums,
    mean_losses,
    subgoal_losses,
)


def make_batch(leads: list[float]) -> Batch:
    count = len(leads)
    return Batch(torch.randn(count, 260), torch.tensor(leads), torch.rand(count, 2) * 10, torch.rand(count) + 0.5)


def test_layers_stand_in_the_papers_order() -> None:
    net = SubgoalNet()
    kinds = (nn.Linear, nn.BatchNorm1d, Dropout, nn.Sigmoid)
    assert [layer[0].out_features for layer in net.layers] == [256, 128, 48, 16]
    for layer in net.layers:
        assert [type(part) for part in layer] == list(kinds)
    assert net(torch.randn(5, 260)).shape == (5, 3)


@pytest.mark.parametrize(("leads", "silent"), [([1.0, 1.0, 1.0], 2), ([0.0, 0.0, 0.0], 1)])
def test_a_regression_that_does_not_apply_has_no_gradient(leads: list[float], silent: int) -> None:
    batch = make_batch(leads)
    raw = torch.randn(3, 3, requires_grad=True)
    subgoal_losses(raw, batch.targets_m_BT, batch, success_weight=1.0, exploration_weight=1.0).total.backward()
    assert raw.grad is not None
    assert (raw.grad[:, silent] == 0).all()
    assert (raw.grad[:, 3 - silent] != 0).all()


def test_gradients_are_masked_row_by_row() -> None:
    batch = make_batch([1.0, 0.0, 1.0, 0.0])
    raw = torch.randn(4, 3, requires_grad=True)
    subgoal_losses(raw, batch.targets_m_BT, batch, success_weight=1.0, exploration_weight=1.0).total.backward()
    assert raw.grad is not None
    assert torch.equal(raw.grad[:, 1] != 0, batch.leads_B > 0.5)
    assert torch.equal(raw.grad[:, 2] != 0, batch.leads_B < 0.5)


def test_losses_by_hand() -> None:
    raw = torch.tensor([[0.0, 1.0, 9.0], [0.0, 9.0, 2.0]])
    batch = Batch(torch.empty(2, 0), torch.tensor([1.0, 0.0]), torch.empty(2, 2), torch.tensor([1.5, 0.5]))
    found = subgoal_losses(raw, torch.zeros(2, 2), batch, success_weight=2.0, exploration_weight=3.0)
    assert float(found.success) == pytest.approx(0.6931472)
    assert float(found.delta_success) == 1.0
    assert float(found.exploration) == 4.0
    assert float(found.total) == pytest.approx(0.6931472 + 2.0 + 12.0)


@pytest.mark.parametrize("scaling", ["standardise", "log"])
def test_unscale_undoes_scale(scaling: str) -> None:
    net = SubgoalNet(target_scaling=scaling)  # type: ignore[arg-type]
    net.target_mean.copy_(torch.tensor([1.0, 2.0]))
    net.target_std.copy_(torch.tensor([0.5, 3.0]))
    targets = torch.rand(20, 2) * 30
    torch.testing.assert_close(net.unscale(net.scale(targets)), targets, rtol=1e-4, atol=1e-4)
    assert (net.unscale(torch.full((1, 2), -99.0)) == 0).all()


@pytest.mark.parametrize("rate", [0.0, 0.25, 0.5, 0.9])
def test_dropout_drops_its_share_and_keeps_the_mean(rate: float) -> None:
    torch.manual_seed(0)
    dropout, ones = Dropout(rate), torch.ones(400, 333)
    out = dropout(ones)
    assert float((out == 0).float().mean()) == pytest.approx(rate, abs=0.01)
    assert float(out.mean()) == pytest.approx(1.0, abs=0.03)
    assert not torch.equal(out, dropout(ones)) or rate == 0.0
    assert torch.equal(dropout.eval()(ones), ones)


def test_dropout_keeps_the_bytes_at_or_above_its_threshold() -> None:
    values = torch.randn(64, 40)
    torch.manual_seed(7)
    found = Dropout(0.25)(values)
    torch.manual_seed(7)
    words = torch.empty(64 * 40 // 8, dtype=torch.int64).random_(-(2**63), None)
    kept = words.view(torch.uint8).view(64, 40) >= 64
    assert torch.equal(found, values * (kept.float() * (256 / 192)))


def test_dropout_is_repeatable_and_even_over_columns() -> None:
    dropout = Dropout(0.5)
    torch.manual_seed(3)
    first = dropout(torch.ones(4000, 8))
    torch.manual_seed(3)
    assert torch.equal(first, dropout(torch.ones(4000, 8)))
    assert float(((first == 0).float().mean(dim=0) - 0.5).abs().max()) < 0.04


def rows_of(batch: Batch) -> dict[str, torch.Tensor]:
    return dict(zip(("inputs", "leads", "targets_m", "weight"), batch, strict=True))


def test_the_losses_of_a_batch_have_names_and_the_first_is_minimised() -> None:
    net = SubgoalNet().eval()
    training = SubgoalTraining(net, success_weight=0.5, exploration_weight=2.0)
    batch = make_batch([1.0, 0.0, 1.0])
    found = training.losses(rows_of(batch))
    expected = subgoal_losses(
        net(batch.inputs_BI), net.scale(batch.targets_m_BT), batch, success_weight=0.5, exploration_weight=2.0
    )
    assert list(found) == ["loss", "weighted_cross_entropy", "delta_success_error", "exploration_error"]
    assert list(found.values()) == list(expected)
    torch.testing.assert_close(training.training_step(rows_of(batch), 0), found)


def test_validation_over_blocks_is_that_over_all_rows_whatever_applies_in_each() -> None:
    training = SubgoalTraining(SubgoalNet().eval(), success_weight=0.5, exploration_weight=2.0)
    rows = rows_of(make_batch([1.0, 1.0, 0.0, 0.0, 0.0]))
    blocks = [{name: part[block] for name, part in rows.items()} for block in (slice(0, 2), slice(2, 5))]
    with torch.no_grad():
        found, expected = training.validate(blocks), training.losses(rows)
    assert found == pytest.approx({name: float(value) for name, value in expected.items()}, rel=1e-5)


def test_losses_of_blocks_join_to_those_of_all_rows() -> None:
    batch, raw, scaled = make_batch([1.0, 0.0, 1.0, 0.0, 0.0]), torch.randn(5, 3), torch.randn(5, 2)
    blocks = [slice(0, 2), slice(2, 5)]
    parts = [loss_sums(raw[rows], scaled[rows], Batch(*(part[rows] for part in batch))) for rows in blocks]
    joined = LossSums(*(sum(values) for values in zip(*parts, strict=True)))
    weights = {"success_weight": 0.5, "exploration_weight": 2.0}
    for found, expected in zip(
        mean_losses(joined, 5, **weights), subgoal_losses(raw, scaled, batch, **weights), strict=True
    ):
        torch.testing.assert_close(found, expected)


def test_the_predictor_speaks_in_probabilities_and_metres() -> None:
    net = SubgoalNet().eval()
    inputs = torch.randn(4, 260)
    out = SubgoalPredictor(net, slope=2.0, offset=-1.0)(inputs)
    torch.testing.assert_close(out[:, 0], torch.sigmoid(2.0 * net(inputs)[:, 0] - 1.0))
    assert (out[:, 1:] >= 0).all()
