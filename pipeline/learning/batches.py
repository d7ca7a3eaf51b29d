"""The training batches: which rows each holds depends on nothing but the seed and the step."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import torch
from torch import Tensor

from models.subgoals import Batch
from pipeline.learning.examples import Examples
from pipeline.learning.scratch import Spool, row_blocks
from pipeline.randomness import stream

_STRIDE = 100  # steps between two moments at which Lightning may act: its hooks cost about as much as a step


@dataclass(frozen=True, kw_only=True)
class Batches:
    """What Lightning iterates over: strides of training steps, from the present one to the last.

    A stride ends where one would look at validation, every ``look_every`` steps, and after the last step. ``step`` is
    asked at the start of each iteration, so a resumed training takes up where it stopped. ``scratch``: the folder for
    the order of the rows.
    """

    examples: Examples
    batch_size: int
    seed: int
    steps: int
    look_every: int
    scratch: Path
    step: Callable[[], int]

    def __iter__(self) -> Iterator["Stride"]:
        """Yield the strides; none once ``steps`` are done."""
        passes = Passes(self.examples.count, self.batch_size, self.seed, self.scratch)
        first_seed = int(stream(self.seed, "dropout").integers(2**62))
        first = self.step()
        while first < self.steps:
            look = (first // self.look_every + 1) * self.look_every
            last = min(first + _STRIDE, look, self.steps)
            yield Stride(self.examples, passes, first_seed, range(first, last))
            first = last


@dataclass(frozen=True)
class Stride:
    """Consecutive training steps; each batch is gathered when its turn comes."""

    examples: Examples
    passes: "Passes"
    first_seed: int
    steps: range
    device: torch.device = field(default_factory=lambda: torch.device("cpu"))

    def to(self, device: torch.device) -> Self:
        """Return the same stride with batches on ``device``: how Lightning moves any batch."""
        return replace(self, device=device)

    def __iter__(self) -> Iterator[tuple[int, Batch]]:
        """Yield for each step the seed of its dropout and its batch."""
        for step in self.steps:
            yield self.first_seed + step, self.examples.batch(self.passes.rows(step), self.device)


class Passes:
    """Each pass through N examples is a permutation of its own, kept in a scratch file.

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
