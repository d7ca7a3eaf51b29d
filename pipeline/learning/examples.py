"""Labelled rows as the network sees them: inputs and labels, in memory or in mapped scratch files."""

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from models.subgoals import Batch
from pipeline.datums.schema import DatumRows
from pipeline.learning.scratch import Spool, row_blocks
from pipeline.learning.weighing import weigh


@dataclass(frozen=True, kw_only=True)
class Examples:
    """N labelled inputs.

    inputs: [N, I] float32. labels: [N, 4] float32: 1 where the subgoal leads to the goal, else 0; delta success and
    exploration [m], 0 where one does not apply; the weight in the cross-entropy, see :func:`weigh`.
    """

    inputs: Tensor
    labels: Tensor

    @property
    def count(self) -> int:
        """N."""
        return self.labels.shape[0]

    @property
    def leads(self) -> NDArray[np.float32]:
        """[N] 1 where the subgoal leads to the goal, else 0; not a copy."""
        leads: NDArray[np.float32] = self.labels.numpy()[:, 0]
        return leads

    def batch(self, index: Tensor, device: torch.device) -> Batch:
        """Return a copy of the rows at ``index`` [B], on ``device``."""
        # index_select copies row by row; plain indexing looks up each number on its own, in three times the time.
        return _batch(self.inputs.index_select(0, index).to(device), self.labels.index_select(0, index).to(device))

    def blocks(self, size: int) -> Iterator[Batch]:
        """Yield all rows in order, ``size`` at a time; where they are mapped, nothing is copied."""
        for block in row_blocks(self.count, size):
            yield _batch(self.inputs[block], self.labels[block])

    def fingerprint(self) -> str:
        """Return the sha256 of all values."""
        total = hashlib.sha256()
        for part in (self.inputs, self.labels):
            total.update(f"{tuple(part.shape)}".encode())
            total.update(np.ascontiguousarray(part.numpy()).data)
        return total.hexdigest()


def _batch(inputs: Tensor, labels: Tensor) -> Batch:
    return Batch(inputs, labels[:, 0], labels[:, 1:3], labels[:, 3])


def label_columns(rows: DatumRows) -> NDArray[np.float32]:
    """Return the labels [n, 4] of :class:`Examples` for ``rows``, with a row's cost in place of its weight."""
    targets = (np.nan_to_num(values, nan=0.0) for values in (rows.delta_success_m, rows.exploration_m))
    return np.stack([rows.leads_to_goal.astype(np.float32), *targets, rows.weight_m], axis=1)


def spool_examples(
    blocks: Iterable[tuple[NDArray[np.float32], DatumRows]],
    scratch: Path,
    *,
    by_cost: bool = True,
    by_class: bool = True,
) -> Examples:
    """Return the examples of ``blocks``, each inputs [n, I] and the rows they were made of, weighed as asked.

    They lie in scratch files in the folder ``scratch``, which are gone when the examples are: see :class:`Spool`.
    """
    inputs, labels = Spool(scratch), Spool(scratch)
    for values, rows in blocks:
        inputs.append(values)
        labels.append(label_columns(rows))
    columns = labels.mapped()
    if labels.count:
        weigh(columns[:, 0], columns[:, 3], by_cost=by_cost, by_class=by_class)
    return Examples(inputs=torch.from_numpy(inputs.mapped()), labels=torch.from_numpy(columns))
