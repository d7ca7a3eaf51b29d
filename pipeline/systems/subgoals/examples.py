"""Labelled subgoals as the network sees them: rows of inputs, labels and what each counts."""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.datums.schema import DatumRows
from pipeline.learning.rows import Rows, spool_rows
from pipeline.systems.subgoals.weighing import weigh

Float32s = NDArray[np.float32]


def spool_examples(
    blocks: Iterable[tuple[Float32s, DatumRows]], scratch: Path, *, by_cost: bool = True, by_class: bool = True
) -> Rows:
    """Return the examples of ``blocks``, each inputs [n, I] and the rows they were made of, weighed as asked.

    All float32: ``inputs`` [N, I]; ``leads`` [N], 1 where the subgoal leads to the goal, else 0; ``targets_m`` [N, 2],
    delta success and exploration [m], 0 where one does not apply; ``weight`` [N] in the cross-entropy, see
    :func:`weigh`. They lie in scratch files in the folder ``scratch``, which are gone when the examples are.
    """
    rows = spool_rows(_columns(blocks), scratch)
    if rows.count:
        weigh(rows["leads"].numpy(), rows["weight"].numpy(), by_cost=by_cost, by_class=by_class)
    return rows


def leads_of(rows: Rows) -> Float32s:
    """Return [N] 1 where the subgoal leads to the goal, else 0; not a copy."""
    leads: Float32s = rows["leads"].numpy()
    return leads


def _columns(blocks: Iterable[tuple[Float32s, DatumRows]]) -> Iterator[dict[str, NDArray[Any]]]:
    """Yield the rows of each block, with a row's cost in place of its weight."""
    for inputs, rows in blocks:
        targets = [np.nan_to_num(values, nan=0.0) for values in (rows.delta_success_m, rows.exploration_m)]
        yield {
            "inputs": inputs,
            "leads": rows.leads_to_goal.astype(np.float32),
            "targets_m": np.stack(targets, axis=1).astype(np.float32),
            "weight": rows.weight_m.astype(np.float32),
        }
