"""What a network says about many examples, in evaluation mode, block by block."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from models.subgoals import Batch, Losses, LossSums, SubgoalNet, SubgoalTraining, loss_sums, mean_losses
from pipeline.learning.calibration import Calibration, sigmoid
from pipeline.learning.examples import Examples
from pipeline.learning.metrics import Predicted, Values, score
from pipeline.learning.scratch import Spool

_ROWS_AT_ONCE: Final = 65536  # of outputs and labels
_INPUTS_AT_ONCE: Final = 8192  # rows whose hidden layers are in memory, 8 MiB each


def predictions(net: SubgoalNet, examples: Examples) -> Iterator[tuple[Batch, Tensor]]:
    """Yield the examples in order, labels and raw outputs [n, 3] where ``net`` is; it ends in the mode it was in."""
    was_training, device = net.training, net.input_mean.device
    net.eval()
    try:
        for block in examples.blocks(_ROWS_AT_ONCE):
            with torch.no_grad():
                parts = [net(inputs.to(device)) for inputs in torch.split(block.inputs_BI, _INPUTS_AT_ONCE)]
            yield Batch(block.inputs_BI, *(labels.to(device) for labels in block[1:])), torch.cat(parts)
    finally:
        net.train(was_training)


def validate(training: SubgoalTraining, examples: Examples) -> Losses:
    """Return the losses over all examples, as one batch would have them, without dropout."""
    net = training.net
    with torch.no_grad():
        blocks = [loss_sums(raw, net.scale(batch.targets_m_BT), batch) for batch, raw in predictions(net, examples)]
        # Within a block in float32, as in a training batch; from block to block in float64.
        joined = (torch.stack(parts).cpu().double().sum(dim=0).float() for parts in zip(*blocks, strict=True))
        return mean_losses(
            LossSums(*joined),
            examples.count,
            success_weight=training.success_weight,
            exploration_weight=training.exploration_weight,
        )


def logits_of(net: SubgoalNet, examples: Examples, scratch: Path) -> NDArray[np.float32]:
    """Return the uncalibrated logit of P_S [N], in a scratch file in the folder ``scratch``."""
    spool = Spool(scratch)
    for _, raw in predictions(net, examples):
        spool.append(raw[:, 0].cpu().numpy())
    return spool.mapped()


def score_network(
    net: SubgoalNet, examples: Examples, calibration: Calibration, means_m: Values, scratch: Path
) -> dict[str, float]:
    """Return the scores of a calibrated network on ``examples``; see :func:`pipeline.learning.metrics.score`."""

    def blocks() -> Iterator[Predicted]:
        for batch, raw in predictions(net, examples):
            logit = raw[:, 0].cpu().numpy().astype(np.float64)
            yield Predicted(
                p=sigmoid(calibration.slope * logit + calibration.offset),
                costs_m=net.unscale(raw[:, 1:]).cpu().numpy().astype(np.float64),
                leads=batch.leads_B.cpu().numpy() > 0.5,
                targets_m=batch.targets_m_BT.cpu().numpy().astype(np.float64),
            )

    return score(blocks(), means_m, scratch)
