"""Rows as a network sees them: tensors by name, in memory or in mapped scratch files."""

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from pipeline.errors import TableError
from pipeline.learning.scratch import Spool, row_blocks

Block = Mapping[str, Tensor]
"""n rows: by name, tensors [n, ...]."""


@dataclass(frozen=True)
class Rows:
    """N rows: by name, tensors [N, ...] of any shape and type.

    What is stored packed, such as bits or bytes, stays so until the network unpacks a batch of it.
    """

    tensors: Mapping[str, Tensor]

    def __post_init__(self) -> None:
        """Refuse tensors of different numbers of rows."""
        counts = {name: len(tensor) for name, tensor in self.tensors.items()}
        if len(set(counts.values())) > 1:
            raise TableError(f"Rows of different number: {counts}; expected as many of each.")

    def __getitem__(self, name: str) -> Tensor:
        """Return the tensor ``name`` [N, ...], not a copy."""
        return self.tensors[name]

    @property
    def count(self) -> int:
        """N."""
        return len(next(iter(self.tensors.values()), ()))

    def batch(self, index: Tensor, device: torch.device) -> dict[str, Tensor]:
        """Return a copy of the rows at ``index`` [B], on ``device``."""
        # index_select copies row by row; plain indexing looks up each number on its own, in three times the time.
        return {name: tensor.index_select(0, index).to(device) for name, tensor in self.tensors.items()}

    def blocks(self, size: int) -> Iterator[dict[str, Tensor]]:
        """Yield all rows in order, ``size`` at a time; where they are mapped, nothing is copied."""
        for block in row_blocks(self.count, size):
            yield {name: tensor[block] for name, tensor in self.tensors.items()}

    def fingerprint(self) -> str:
        """Return the sha256 of all names, types, shapes and values."""
        total = hashlib.sha256()
        for name in sorted(self.tensors):
            tensor = self.tensors[name]
            total.update(f"{name} {tensor.dtype} {tuple(tensor.shape)}".encode())
            for block in row_blocks(len(tensor)):
                total.update(tensor[block].contiguous().flatten().view(torch.uint8).numpy().data)
        return total.hexdigest()


def spool_rows(blocks: Iterable[Mapping[str, NDArray[Any]]], scratch: Path) -> Rows:
    """Return the rows of ``blocks``, each by name arrays [n, ...], in scratch files in the folder ``scratch``.

    At no time more than one block is in memory; the files are gone when the rows are: see :class:`Spool`. Without a
    block there are no rows and no names.

    Raises:
        TableError: a block has other names than the first, or there is no room to write.
    """
    spools: dict[str, Spool] = {}
    for number, block in enumerate(blocks):
        if number == 0:
            spools = {name: Spool(scratch) for name in block}
        if block.keys() != spools.keys():
            raise TableError(f"A block of rows holds {', '.join(block)}, the first one {', '.join(spools)}.")
        for name, values in block.items():
            spools[name].append(values)
    return Rows({name: torch.from_numpy(np.atleast_1d(spool.mapped())) for name, spool in spools.items()})
