"""Mean and spread of inputs and targets, gathered block by block."""

from typing import Final

import numpy as np
import torch
from torch import Tensor

from models.subgoals import Batch, SubgoalNet
from pipeline.learning.examples import Examples
from pipeline.learning.metrics import Values

_ROWS_AT_ONCE: Final = 1024  # 2 MiB in float64: what a processor's cache holds


class Moments:
    """Count, mean and squared deviations of C columns; blocks are joined as Chan, Golub and LeVeque (1983) do."""

    def __init__(self, columns: int) -> None:
        """Have seen no rows yet."""
        self.count = 0
        self.mean = torch.zeros(columns, dtype=torch.float64)
        self._squares = torch.zeros(columns, dtype=torch.float64)

    def add(self, values: Tensor) -> None:
        """Take in the rows of ``values`` [n, C]."""
        if not len(values):
            return
        wide = values.double()
        mean, before = wide.mean(dim=0), self.count
        self.count += len(values)
        share, gap = len(values) / self.count, mean - self.mean
        self._squares += (wide - mean).square().sum(dim=0) + gap.square() * (before * share)
        self.mean += gap * share

    @property
    def spread(self) -> Tensor:
        """Standard deviation [C]; 1 for what hardly ever varies, so that nothing is divided by 0."""
        std = (self._squares / max(self.count, 1)).sqrt()
        return torch.where(std > 1e-2, std, 1.0)


def fit_scaling(net: SubgoalNet, examples: Examples) -> None:
    """Set the buffers of ``net`` so that its inputs and targets have mean 0 and spread 1 over ``examples``.

    Targets count only where they apply.
    """
    net.target_mean.zero_()
    net.target_std.fill_(1.0)
    inputs, targets = Moments(examples.inputs.shape[1]), (Moments(1), Moments(1))
    for batch in examples.blocks(_ROWS_AT_ONCE):
        inputs.add(batch.inputs_BI)
        _add_where_applying(targets, net.scale(batch.targets_m_BT), batch)
    net.input_mean.copy_(inputs.mean)
    net.input_std.copy_(inputs.spread)
    net.target_mean.copy_(torch.cat([moments.mean for moments in targets]))
    net.target_std.copy_(torch.cat([moments.spread for moments in targets]))


def mean_costs(examples: Examples) -> Values:
    """Return the mean delta success and the mean exploration cost [m] over the rows to which each applies, or 0."""
    targets = Moments(1), Moments(1)
    for batch in examples.blocks(_ROWS_AT_ONCE):
        _add_where_applying(targets, batch.targets_m_BT, batch)
    return np.array([float(moments.mean) for moments in targets])


def _add_where_applying(moments: tuple[Moments, Moments], targets: Tensor, batch: Batch) -> None:
    """Add the columns of ``targets`` [n, 2] to their moments: delta success where a row leads, else exploration."""
    for column, applies in enumerate((batch.leads_B > 0.5, batch.leads_B < 0.5)):
        moments[column].add(targets[applies, column, None])
