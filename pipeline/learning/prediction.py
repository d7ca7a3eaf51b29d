"""What a network says about many examples at once, in evaluation mode."""

import numpy as np
import torch
from torch import Tensor

from models.subgoals import Losses, SubgoalNet, SubgoalTraining, subgoal_losses
from pipeline.learning.calibration import Calibration, sigmoid
from pipeline.learning.examples import Examples
from pipeline.learning.metrics import Values, score

_ROWS_AT_ONCE = 8192


def predict(net: SubgoalNet, examples: Examples) -> Tensor:
    """Return the raw outputs [N, 3] for all examples, on the CPU; the mode of ``net`` is left as it was."""
    was_training = net.training
    net.eval()
    device = net.input_mean.device
    with torch.no_grad():
        raw = [net(inputs.to(device)).cpu() for inputs in torch.split(examples.inputs, _ROWS_AT_ONCE)]
    net.train(was_training)
    return torch.cat(raw) if raw else torch.empty(0, 3)


def validate(training: SubgoalTraining, examples: Examples) -> Losses:
    """Return the losses over all examples, as one batch would have them, without dropout."""
    raw = predict(training.net, examples).to(training.net.input_mean.device)
    batch = examples.batch(slice(None))
    with torch.no_grad():
        moved = batch._replace(
            leads_B=batch.leads_B.to(raw.device),
            targets_m_BT=batch.targets_m_BT.to(raw.device),
            weight_B=batch.weight_B.to(raw.device),
        )
        return subgoal_losses(
            raw,
            training.net.scale(moved.targets_m_BT),
            moved,
            success_weight=training.success_weight,
            exploration_weight=training.exploration_weight,
        )


def logits_of(net: SubgoalNet, examples: Examples) -> Values:
    """Return the uncalibrated logit of P_S [N]."""
    return np.asarray(predict(net, examples)[:, 0].numpy(), dtype=np.float64)


def score_network(net: SubgoalNet, examples: Examples, calibration: Calibration, means_m: Values) -> dict[str, float]:
    """Return the scores of a calibrated network on ``examples``; see :func:`pipeline.learning.metrics.score`."""
    raw = predict(net, examples)
    with torch.no_grad():
        costs_m = net.unscale(raw[:, 1:]).numpy().astype(np.float64)
    logit = raw[:, 0].numpy().astype(np.float64)
    return score(
        sigmoid(calibration.slope * logit + calibration.offset),
        costs_m,
        examples.leads.numpy() > 0.5,
        examples.targets_m.numpy().astype(np.float64),
        means_m,
    )


def mean_costs(examples: Examples) -> Values:
    """Return the mean delta success and the mean exploration cost [m] over the rows to which each applies."""
    leads = examples.leads.numpy() > 0.5
    targets = examples.targets_m.numpy().astype(np.float64)
    return np.array(
        [targets[applies, index].mean() if applies.any() else 0.0 for index, applies in enumerate((leads, ~leads))]
    )
