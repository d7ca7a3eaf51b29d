"""Labelled rows to tensors in memory, and batches that depend on nothing but the seed and the step."""

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from models.subgoals import Batch, SubgoalNet
from pipeline.datums.schema import DatumRows
from pipeline.randomness import stream


@dataclass(frozen=True, kw_only=True)
class Examples:
    """N labelled inputs, all in memory; fields as in :class:`models.subgoals.Batch`.

    inputs: [N, I] float32. leads: [N] float32. targets_m: [N, 2] float32, 0 where one does not apply.
    weight: [N] float32, see :func:`weigh`.
    """

    inputs: Tensor
    leads: Tensor
    targets_m: Tensor
    weight: Tensor

    @property
    def count(self) -> int:
        """N."""
        return self.leads.shape[0]

    def batch(self, index: Tensor | slice) -> Batch:
        """Return the rows at ``index``."""
        return Batch(self.inputs[index], self.leads[index], self.targets_m[index], self.weight[index])

    def fingerprint(self) -> str:
        """Return the sha256 of all values."""
        total = hashlib.sha256()
        for part in (self.inputs, self.leads, self.targets_m, self.weight):
            total.update(f"{tuple(part.shape)}".encode())
            total.update(np.ascontiguousarray(part.numpy()).data)
        return total.hexdigest()


def weigh(
    leads: NDArray[np.bool_], cost_m: NDArray[np.float32], *, by_cost: bool, by_class: bool
) -> NDArray[np.float32]:
    """Return the weight [N] of each row in the cross-entropy, 1 on average.

    cost_m: [N] what misclassifying the row costs; counts if ``by_cost``. With ``by_class`` the rows that lead to the
    goal and the others then weigh the same in total (LSP, section 4), unless one class is missing.
    """
    weight = np.maximum(cost_m.astype(np.float64), 0.0) if by_cost else np.ones(len(leads))
    totals = {lead: weight[leads == lead].sum() for lead in (True, False)}
    if by_class and min(totals.values()) > 0.0:
        weight = np.where(leads, weight / totals[True], weight / totals[False])
    mean = weight.mean() if len(weight) else 1.0
    return (weight / mean if mean > 0.0 else np.ones(len(leads))).astype(np.float32)


def label_examples(
    rows: DatumRows, inputs: NDArray[np.float32], *, by_cost: bool = True, by_class: bool = True
) -> Examples:
    """Join ``inputs`` [N, I] with the labels of ``rows``, weighed as :func:`weigh` says."""
    targets = np.stack([rows.delta_success_m, rows.exploration_m], axis=1)
    return Examples(
        inputs=torch.from_numpy(np.ascontiguousarray(inputs)),
        leads=torch.from_numpy(rows.leads_to_goal.astype(np.float32)),
        targets_m=torch.from_numpy(np.nan_to_num(targets, nan=0.0)),
        weight=torch.from_numpy(weigh(rows.leads_to_goal, rows.weight_m, by_cost=by_cost, by_class=by_class)),
    )


def fit_scaling(net: SubgoalNet, examples: Examples) -> None:
    """Set the buffers of ``net`` so that its inputs and targets have mean 0 and spread 1 over ``examples``.

    Targets count only where they apply. What never varies keeps a spread of 1, so that nothing is divided by 0.
    """
    for columns in torch.split(torch.arange(examples.inputs.shape[1]), 32):  # in float64, a few columns at a time
        block = examples.inputs[:, columns].double()
        net.input_mean[columns] = block.mean(dim=0).float()
        net.input_std[columns] = _spread(block.std(dim=0, correction=0)).float()
    net.target_mean.zero_()
    net.target_std.fill_(1.0)
    scaled = net.scale(examples.targets_m).double()
    for index, applies in enumerate((examples.leads > 0.5, examples.leads < 0.5)):
        if applies.any():
            net.target_mean[index] = scaled[applies, index].mean().float()
            net.target_std[index] = _spread(scaled[applies, index].std(correction=0)).float()


def _spread(std: Tensor) -> Tensor:
    return torch.where(std > 1e-2, std, 1.0)


@dataclass(frozen=True, kw_only=True)
class Batches:
    """The training batches from the present step to the last; batch k is a function of (seed, k) alone.

    Each pass through the examples is a permutation of its own; the rows that do not fill a last batch are left out
    of that pass. ``step`` is asked at the start of each iteration, so a resumed training takes up where it stopped.
    """

    examples: Examples
    batch_size: int
    seed: int
    steps: int
    step: Callable[[], int]

    def __iter__(self) -> Iterator[Batch]:
        """Yield the batches; none once ``steps`` are done."""
        size = min(self.batch_size, self.examples.count)
        per_pass = self.examples.count // size
        order, ordered = torch.empty(0, dtype=torch.int64), -1
        for step in range(self.step(), self.steps):
            if step // per_pass != ordered:
                ordered = step // per_pass
                order = torch.from_numpy(stream(self.seed, "batches", ordered).permutation(self.examples.count))
            at = (step % per_pass) * size
            yield self.examples.batch(order[at : at + size])
