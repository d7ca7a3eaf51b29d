"""The recipe, fed with subgoals: what is learned, what validation says, what the scores are."""

from pathlib import Path

import numpy as np
import pytest
import torch

from models.subgoals import Batch, SubgoalNet, SubgoalTraining, subgoal_losses
from pipeline.evaluation.calibration import calibrate
from pipeline.learning.fit import fit
from pipeline.learning.platt import PlattScaling, fit_platt, sigmoid
from pipeline.learning.rows import Rows
from pipeline.learning.seeding import first_step_seed
from pipeline.learning.trainable import validate
from pipeline.randomness import stream
from pipeline.systems.subgoals.examples import leads_of
from pipeline.systems.subgoals.scaling import mean_costs
from pipeline.systems.subgoals.scores import Predicted, score
from pipeline.systems.subgoals.settings import TrainConfig
from pipeline.systems.subgoals.training import fit_settings, logits_of, make_training, score_network
from tests.learning.synthetic import make_examples

CONFIG = TrainConfig(
    steps=130, batch_size=32, validate_every=70, learning_rate=0.01, decay_every=25, hidden=[16, 8], dropout=0.25
)


def at_once(net: SubgoalNet, rows: Rows) -> torch.Tensor:
    with torch.no_grad():
        return net.eval()(rows["inputs"])  # type: ignore[no-any-return]


@pytest.fixture
def net() -> SubgoalNet:
    torch.manual_seed(0)
    return SubgoalNet(inputs=12, hidden=(8,))


def test_a_simple_rule_is_learned(tmp_path: Path) -> None:
    train, fresh = make_examples(3000, 0), make_examples(1000, 2)
    config = TrainConfig(
        steps=900, batch_size=128, hidden=[48, 24], dropout=0.0, validate_every=300, learning_rate=0.02
    )
    training = make_training(train, config, 5)
    fitted = fit(training, train, make_examples(500, 1), fit_settings(config, 5), tmp_path, progress=False)
    net = fitted.training.net
    found = score_network(net, fresh, PlattScaling(), mean_costs(train))
    assert found["accuracy"] > 0.93 > found["accuracy_base"] + 0.35
    assert found["auc"] > 0.98
    assert found["delta_success_mae_m"] < 0.5 * found["delta_success_mae_base_m"]
    assert found["exploration_mae_m"] < 0.5 * found["exploration_mae_base_m"]
    logit, leads = logits_of(net, fresh).astype(np.float64), leads_of(fresh)
    scaling = fit_platt(logit, leads)
    assert calibrate(sigmoid(scaling.slope * logit + scaling.offset), leads > 0.5).ece < 0.05


def test_the_weights_are_those_of_a_plain_loop_with_the_papers_adam(tmp_path: Path) -> None:
    train, settings = make_examples(300, 0), fit_settings(CONFIG, 5)
    fit(make_training(train, CONFIG, 5), train, make_examples(80, 1), settings, tmp_path, progress=False)
    net = make_training(train, CONFIG, 5).net.train()
    optimizer = torch.optim.Adam(net.parameters(), lr=0.01, fused=True)
    schedule = torch.optim.lr_scheduler.StepLR(optimizer, 25, 0.9)
    for step in range(130):
        number, place = divmod(step, 300 // 32)
        order = torch.from_numpy(stream(5, "batches", number).permutation(300))
        batch = Batch.of(train.batch(order[32 * place : 32 * (place + 1)], torch.device("cpu")))
        torch.manual_seed(first_step_seed(5) + step)
        optimizer.zero_grad()
        losses = subgoal_losses(
            net(batch.inputs_BI), net.scale(batch.targets_m_BT), batch, success_weight=1.0, exploration_weight=1.0
        )
        losses.total.backward()
        optimizer.step()
        schedule.step()
    found = torch.load(tmp_path / "last.ckpt", weights_only=True)
    for name, value in net.state_dict().items():
        assert torch.equal(found["state_dict"][f"net.{name}"], value), name
    assert found["lr_schedulers"][0]["_last_lr"] == [pytest.approx(0.01 * 0.9**5)]


def test_first_weights_depend_on_the_seed_alone() -> None:
    rows = make_examples(50, 0)
    torch.manual_seed(1)
    one = make_training(rows, CONFIG, 7).state_dict()
    torch.manual_seed(2)
    drawn = torch.get_rng_state()
    two, other = make_training(rows, CONFIG, 7).state_dict(), make_training(rows, CONFIG, 8).state_dict()
    assert torch.equal(torch.get_rng_state(), drawn)
    assert all(torch.equal(one[name], two[name]) for name in one)
    assert not torch.equal(one["net.head.weight"], other["net.head.weight"])


def test_what_shapes_the_network_or_its_optimizer_is_in_the_settings() -> None:
    changes = (
        {"dropout": 0.1},
        {"decay": 0.8},
        {"success_loss_weight": 2.0},
        {"hidden": [16]},
        {"target_scaling": "log"},
    )
    settings = [fit_settings(CONFIG, 0).network]
    settings += [fit_settings(TrainConfig(**vars(CONFIG) | change), 0).network for change in changes]
    assert len({str(each) for each in settings}) == len(settings)


@pytest.mark.parametrize(("count", "tolerance"), [(20_000, 0.0), (70_000, 1e-6)])
def test_validation_losses_are_those_of_one_batch_of_all(net: SubgoalNet, count: int, tolerance: float) -> None:
    rows = make_examples(count, 0)
    training = SubgoalTraining(net, success_weight=0.5, exploration_weight=2.0)
    found = validate(training, rows, 65536)
    whole = Batch.of(rows.tensors)
    expected = subgoal_losses(
        at_once(net, rows), net.scale(whole.targets_m_BT), whole, success_weight=0.5, exploration_weight=2.0
    )
    assert list(found) == ["loss", "weighted_cross_entropy", "delta_success_error", "exploration_error"]
    assert list(found.values()) == pytest.approx([float(part) for part in expected], rel=tolerance, abs=0)


def test_logits_and_scores_are_those_of_all_rows_at_once(net: SubgoalNet) -> None:
    rows, means_m = make_examples(70_000, 1), np.array([3.0, 4.0])
    raw = at_once(net, rows)
    assert logits_of(net, rows) == pytest.approx(raw[:, 0].numpy(), rel=1e-5, abs=1e-6)
    whole = Predicted(
        p=sigmoid(1.5 * raw[:, 0].numpy().astype(np.float64) - 0.2),
        costs_m=net.unscale(raw[:, 1:]).numpy().astype(np.float64),
        leads=rows["leads"].numpy() > 0.5,
        targets_m=rows["targets_m"].numpy().astype(np.float64),
    )
    found = score_network(net, rows, PlattScaling(1.5, -0.2), means_m)
    assert found == pytest.approx(score([whole], means_m), rel=1e-5)
