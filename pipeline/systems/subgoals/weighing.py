"""What each example counts in the cross-entropy."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipeline.learning.scratch import row_blocks

Float32s = NDArray[np.float32]
Values = NDArray[np.float64]

_ADDED_AT_ONCE = 8192


def weigh(leads: Float32s, cost_m: Float32s, *, by_cost: bool, by_class: bool) -> None:
    """Replace each row's cost by its weight in the cross-entropy, 1 on average; mapped arrays are read in blocks.

    leads: [N] 1 where the row leads to the goal, else 0. cost_m: [N] what misclassifying the row costs; counts if
    ``by_cost``. With ``by_class`` the rows that lead to the goal and the others then weigh the same in total (LSP,
    section 4), unless one class is missing.
    """

    def costs(block: slice) -> Values:
        return np.maximum(cost_m[block].astype(np.float64), 0.0) if by_cost else np.ones(len(leads[block]))

    totals = np.zeros(2)  # of the rows that do not lead, and of those that do
    for block in row_blocks(len(leads)):
        totals += np.bincount((leads[block] > 0.5).astype(np.intp), weights=costs(block), minlength=2)
    divisors = totals if by_class and totals.min() > 0.0 else np.ones(2)

    def shares(block: slice) -> Values:
        return costs(block) / divisors[(leads[block] > 0.5).astype(np.intp)]

    mean = pairwise_sum(shares, 0, len(leads)) / max(len(leads), 1)
    for block in row_blocks(len(leads)):
        cost_m[block] = shares(block) / mean if mean > 0.0 else 1.0


def pairwise_sum(values: Callable[[slice], Values], first: int, count: int) -> float:
    """Return the sum of ``count`` values from ``first`` on, to the bit that of numpy over one array of them.

    values: gives those of a slice. Halves are added to halves, so that errors grow with the logarithm of ``count``.
    """
    if count <= _ADDED_AT_ONCE:
        return float(values(slice(first, first + count)).sum())
    half = count // 2 - (count // 2) % 8
    return pairwise_sum(values, first, half) + pairwise_sum(values, first + half, count - half)
