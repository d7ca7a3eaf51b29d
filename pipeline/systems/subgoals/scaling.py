"""Mean and spread of the network's inputs and of its two targets, each where it applies."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipeline.learning.moments import ROWS_AT_ONCE, Moments
from pipeline.learning.rows import Block, Rows


def input_moments(rows: Rows) -> Moments:
    """Return the moments of the inputs [I]."""
    moments = Moments(rows["inputs"].shape[1])
    for block in rows.blocks(ROWS_AT_ONCE):
        moments.add(block["inputs"])
    return moments


def target_moments(rows: Rows, scale: Callable[[Block], Block] = lambda block: block) -> tuple[Moments, Moments]:
    """Return the moments of delta success over the rows that lead, and of exploration over the others.

    scale: what the regressions see of a block in place of its ``targets_m``; by default metres.
    """
    moments = Moments(1), Moments(1)
    for block in rows.blocks(ROWS_AT_ONCE):
        targets, leads = scale(block)["targets_m"], block["leads"]
        for column, applies in enumerate((leads > 0.5, leads < 0.5)):
            moments[column].add(targets[applies, column, None])
    return moments


def mean_costs(rows: Rows) -> NDArray[np.float64]:
    """Return the mean delta success and the mean exploration cost [m] over the rows to which each applies, or 0."""
    return np.array([float(moments.mean) for moments in target_moments(rows)])
