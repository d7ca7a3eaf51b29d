"""The training batches: which rows each holds depends on nothing but the seed and the step."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import torch
from torch import Tensor

from pipeline.learning.rows import Rows
from pipeline.learning.scratch import Spool, row_blocks
from pipeline.learning.seeding import first_step_seed
from pipeline.randomness import stream


@dataclass(frozen=True, kw_only=True)
class Batches:
    """What Lightning iterates over, from step ``first`` on: one batch, or where ``stride`` > 1 many steps at once.

    A stride ends where one would look at validation, every ``look_every`` steps, and after the last of ``steps``.
    Batches go on beyond that: to end is for the one who counts the steps, and an end here would be Lightning's end of
    an epoch. scratch: the folder for the order of the rows.
    """

    rows: Rows
    batch_size: int
    seed: int
    first: int
    steps: int
    look_every: int
    stride: int
    scratch: Path

    def __iter__(self) -> Iterator["dict[str, Tensor] | Stride"]:
        """Yield batches, or strides of them, without end."""
        passes = Passes(self.rows.count, self.batch_size, self.seed, self.scratch)
        seed, first = first_step_seed(self.seed), self.first
        while self.stride == 1:
            yield self.rows.batch(passes.rows(first), torch.device("cpu"))
            first += 1
        while True:
            look = (first // self.look_every + 1) * self.look_every
            last = min(first + self.stride, look, self.steps if first < self.steps else look)
            yield Stride(self.rows, passes, seed, range(first, last))
            first = last


@dataclass(frozen=True)
class Stride:
    """Consecutive training steps; each batch is gathered when its turn comes."""

    rows: Rows
    passes: "Passes"
    first_seed: int
    steps: range
    device: torch.device = field(default_factory=lambda: torch.device("cpu"))

    def to(self, device: torch.device) -> Self:
        """Return the same stride with batches on ``device``: how Lightning moves any batch."""
        return replace(self, device=device)

    def __iter__(self) -> Iterator[tuple[int, dict[str, Tensor]]]:
        """Yield for each step the seed of what it draws and its batch."""
        for step in self.steps:
            yield self.first_seed + step, self.rows.batch(self.passes.rows(step), self.device)


class Passes:
    """Each pass through N rows is a permutation of its own, kept in a scratch file.

    The rows that do not fill a last batch are left out of that pass.
    """

    def __init__(self, count: int, batch_size: int, seed: int, scratch: Path) -> None:
        """Cut permutations of ``count`` rows into batches; the file goes to the folder ``scratch``."""
        self.count, self.size, self.seed = count, min(batch_size, count), seed
        spool = Spool(scratch)
        for block in row_blocks(count):
            spool.append(torch.arange(block.start, block.stop).numpy())
        self._order = spool.mapped()
        self._number = -1

    def rows(self, step: int) -> Tensor:
        """Return the rows in the batch of ``step``, [batch_size] or all there are; the next call may overwrite them."""
        number, place = divmod(step, self.count // self.size)
        if number != self._number:
            for block in row_blocks(self.count):
                self._order[block] = torch.arange(block.start, block.stop).numpy()
            stream(self.seed, "batches", number).shuffle(self._order)  # what permutation() does, in place
            self._number = number
        return torch.from_numpy(self._order[place * self.size : (place + 1) * self.size])
