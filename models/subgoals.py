"""The network of learned subgoal planning (Stein et al. 2018, section 4) and how it is trained."""

# Shapes: B batch, I inputs (260 for scans of 256 ranges), H hidden width of one layer, O raw outputs (3: logit of P_S,
#         delta success, exploration), T regression targets (2: delta success, exploration). A trailing digit is that
#         many values. "scaled" is in units of the targets' own spread, "_m" in metres.

# ruff: noqa: N803, N806, N815 - the capitals at the end of a name are its shape

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import torch
from lightning.pytorch import LightningModule
from torch import Tensor, nn
from torch.nn import functional

TargetScaling = Literal["standardise", "log"]

_INPUTS_AT_ONCE = 8192  # rows whose hidden layers are in memory while validating, 8 MiB each


class Batch(NamedTuple):
    """B labelled subgoals; a target that does not apply holds any finite number and is masked by ``leads_B``."""

    inputs_BI: Tensor  # float32 [m]
    leads_B: Tensor  # float32: 1 where the subgoal leads to the goal, else 0
    targets_m_BT: Tensor  # float32 [m]
    weight_B: Tensor  # float32: what this datum counts in the cross-entropy, 1 on average

    @classmethod
    def of(cls, rows: Mapping[str, Tensor]) -> "Batch":
        """Return the batch of ``rows``: inputs, leads, targets_m and weight by name."""
        return cls(rows["inputs"], rows["leads"], rows["targets_m"], rows["weight"])


class Losses(NamedTuple):
    """Scalars: ``total`` is what is minimised, the others its parts before their weights."""

    total: Tensor
    success: Tensor
    delta_success: Tensor
    exploration: Tensor


class LossSums(NamedTuple):
    """What losses are made of; those of several batches may be added up."""

    entropy: Tensor  # scalar: cross-entropy times weight, over all rows
    squared_T: Tensor  # squared errors over the rows to which each target applies
    applies_T: Tensor  # how many those are


class Dropout(nn.Module):
    """Dropout as torch's own, at a tenth of its cost on a CPU: eight decisions from each random word.

    The rate is rounded to a multiple of 1/256; what is kept is scaled up by the rounded rate.
    """

    def __init__(self, rate: float) -> None:
        """Drop each value with chance ``rate`` in [0, 1) while training."""
        super().__init__()
        self.threshold = min(round(256 * rate), 255)

    def forward(self, values_BH: Tensor) -> Tensor:
        """Return the values, some of them 0 while training."""
        if not self.training or self.threshold == 0:
            return values_BH
        words = torch.empty((values_BH.numel() + 7) // 8, dtype=torch.int64, device=values_BH.device)
        words.random_(-(2**63), None)  # all 64 bits
        bytes_BH = words.view(torch.uint8)[: values_BH.numel()].view(values_BH.shape)
        # Compared into numbers at once: booleans turned into numbers later cost six times as much.
        kept_BH = torch.ge(bytes_BH, self.threshold, out=torch.empty_like(values_BH))
        return values_BH * kept_BH.mul_(256 / (256 - self.threshold))


class SubgoalNet(nn.Module):
    """Inputs -> P_S (as logit), delta success cost and exploration cost (scaled).

    Each hidden layer is Linear, BatchNorm, Dropout, Sigmoid, in the order of the paper. The scaling of inputs and
    targets lives in buffers, so that weights and scaling cannot be told apart by accident.
    """

    input_mean: Tensor
    input_std: Tensor
    target_mean: Tensor
    target_std: Tensor

    def __init__(
        self,
        *,
        inputs: int = 260,
        hidden: Sequence[int] = (256, 128, 48, 16),
        dropout: float = 0.5,
        target_scaling: TargetScaling = "standardise",
    ) -> None:
        """Make a network with random weights and scalings that change nothing."""
        super().__init__()
        self.target_scaling = target_scaling
        widths = [inputs, *hidden]
        self.layers = nn.ModuleList(
            nn.Sequential(nn.Linear(fan_in, fan_out), nn.BatchNorm1d(fan_out), Dropout(dropout), nn.Sigmoid())
            for fan_in, fan_out in pairwise(widths)
        )
        self.head = nn.Linear(widths[-1], 3)
        self.register_buffer("input_mean", torch.zeros(inputs))
        self.register_buffer("input_std", torch.ones(inputs))
        self.register_buffer("target_mean", torch.zeros(2))
        self.register_buffer("target_std", torch.ones(2))

    def forward(self, inputs_BI: Tensor) -> Tensor:
        """Return raw_BO for inputs in metres."""
        hidden_BH = (inputs_BI - self.input_mean) / self.input_std
        for layer in self.layers:
            hidden_BH = layer(hidden_BH)
        raw_BO: Tensor = self.head(hidden_BH)
        return raw_BO

    def scale(self, targets_m_BT: Tensor) -> Tensor:
        """Return targets as the regressions see them; "log" takes log(1 + metres) before standardising."""
        values_BT = targets_m_BT.clamp(min=0.0).log1p() if self.target_scaling == "log" else targets_m_BT
        return (values_BT - self.target_mean) / self.target_std

    def unscale(self, scaled_BT: Tensor) -> Tensor:
        """Return costs in metres: the inverse of :meth:`scale`, cut off at 0, below which no cost can be."""
        values_BT = scaled_BT * self.target_std + self.target_mean
        return (values_BT.expm1() if self.target_scaling == "log" else values_BT).clamp(min=0.0)


class SubgoalPredictor(nn.Module):
    """A trained network with its calibration: what a planner reads, P_S and two costs in metres."""

    def __init__(self, net: SubgoalNet, *, slope: float, offset: float) -> None:
        """Predict with ``net``; P_S = sigmoid(slope * logit + offset)."""
        super().__init__()
        self.net, self.slope, self.offset = net, slope, offset

    def forward(self, inputs_BI: Tensor) -> Tensor:
        """Return [B, 3]: P_S, delta success cost [m], exploration cost [m]."""
        raw_BO = self.net(inputs_BI)
        p_B1 = torch.sigmoid(self.slope * raw_BO[:, :1] + self.offset)
        return torch.cat([p_B1, self.net.unscale(raw_BO[:, 1:])], dim=1)


def subgoal_losses(
    raw_BO: Tensor, scaled_BT: Tensor, batch: Batch, *, success_weight: float, exploration_weight: float
) -> Losses:
    """Return weighted cross-entropy of P_S and the squared errors of each cost where it applies.

    scaled_BT: the batch's targets, scaled. success_weight, exploration_weight: what the regressions of delta success
    and of exploration count beside the cross-entropy. A batch in which one never applies adds 0 for it.
    """
    sums = loss_sums(raw_BO, scaled_BT, batch)
    return mean_losses(sums, len(raw_BO), success_weight=success_weight, exploration_weight=exploration_weight)


def loss_sums(raw_BO: Tensor, scaled_BT: Tensor, batch: Batch) -> LossSums:
    """Return what the losses of ``batch`` are made of; arguments as in :func:`subgoal_losses`."""
    entropy_B = functional.binary_cross_entropy_with_logits(raw_BO[:, 0], batch.leads_B, reduction="none")
    applies_BT = torch.stack([batch.leads_B, 1.0 - batch.leads_B], dim=1)
    squared_BT = (raw_BO[:, 1:] - scaled_BT).square() * applies_BT
    return LossSums((entropy_B * batch.weight_B).sum(), squared_BT.sum(dim=0), applies_BT.sum(dim=0))


def mean_losses(sums: LossSums, rows: int, *, success_weight: float, exploration_weight: float) -> Losses:
    """Return the losses over the ``rows`` that ``sums`` add up; arguments as in :func:`subgoal_losses`."""
    success = sums.entropy / rows
    delta, exploration = sums.squared_T / sums.applies_T.clamp(min=1.0)
    total = success + success_weight * delta + exploration_weight * exploration
    return Losses(total, success, delta, exploration)


class SubgoalTraining(LightningModule):
    """Adam with a stepped decay on :func:`subgoal_losses`. Rows of a batch: see :meth:`Batch.of`."""

    def __init__(
        self,
        net: SubgoalNet,
        *,
        learning_rate: float = 0.004,
        decay: float = 0.9,
        decay_every: int = 5000,
        success_weight: float = 1.0,
        exploration_weight: float = 1.0,
    ) -> None:
        """Train ``net``; the learning rate is multiplied by ``decay`` every ``decay_every`` steps."""
        super().__init__()
        self.net = net
        self.learning_rate, self.decay, self.decay_every = learning_rate, decay, decay_every
        self.success_weight, self.exploration_weight = success_weight, exploration_weight

    def losses(self, rows: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """Return the losses of the network, in its present mode, on ``rows``."""
        batch = Batch.of(rows)
        return _named(
            subgoal_losses(
                self.net(batch.inputs_BI),
                self.net.scale(batch.targets_m_BT),
                batch,
                success_weight=self.success_weight,
                exploration_weight=self.exploration_weight,
            )
        )

    def training_step(self, rows: Mapping[str, Tensor], _: int) -> dict[str, Tensor]:
        """Return the losses of a batch."""
        return self.losses(rows)

    def validate(self, blocks: Iterable[Mapping[str, Tensor]]) -> dict[str, float]:
        """Return the losses over all rows of ``blocks``, as one batch would have them: a target counts its own rows."""
        count, sums = 0, []
        for block in blocks:
            batch = Batch.of(block)
            raw_BO = torch.cat([self.net(inputs) for inputs in torch.split(batch.inputs_BI, _INPUTS_AT_ONCE)])
            sums.append(loss_sums(raw_BO, self.net.scale(batch.targets_m_BT), batch))
            count += len(raw_BO)
        # Within a block in float32, as in a training batch; from block to block in float64.
        joined = (torch.stack(parts).cpu().double().sum(dim=0).float() for parts in zip(*sums, strict=True))
        losses = mean_losses(
            LossSums(*joined), count, success_weight=self.success_weight, exploration_weight=self.exploration_weight
        )
        return {name: float(value) for name, value in _named(losses).items()}

    def configure_optimizers(self) -> dict[str, object]:  # type: ignore[override]  # Lightning's own union of dicts
        """Return Adam with default betas and its stepped decay."""
        optimizer = torch.optim.Adam(self.net.parameters(), lr=self.learning_rate, fused=True)
        schedule = torch.optim.lr_scheduler.StepLR(optimizer, step_size=self.decay_every, gamma=self.decay)
        return {"optimizer": optimizer, "lr_scheduler": {"scheduler": schedule, "interval": "step"}}


def _named(losses: Losses) -> dict[str, Tensor]:
    """Return the losses by the names that the curves show; "loss" is what is minimised."""
    return {
        "loss": losses.total,
        "weighted_cross_entropy": losses.success,
        "delta_success_error": losses.delta_success,
        "exploration_error": losses.exploration,
    }
