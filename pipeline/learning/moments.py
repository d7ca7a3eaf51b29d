"""Mean and spread of columns, gathered block by block."""

from typing import Final

import torch
from torch import Tensor

ROWS_AT_ONCE: Final = 1024  # 2 MiB of 256 columns in float64: what a processor's cache holds


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
