from pathlib import Path

import numpy as np

from pipeline.datums import DatumRows, stack
from pipeline.systems.subgoals.examples import leads_of, spool_examples
from pipeline.systems.subgoals.weighing import weigh
from tests.datums.rows import make_datums


def in_blocks(rows: DatumRows, size: int) -> list[tuple[np.ndarray, DatumRows]]:
    """Rows in blocks, each with its ranges as inputs."""
    firsts = range(0, len(rows.pair_id), size)
    blocks = [DatumRows(*(column[first : first + size] for column in rows)) for first in firsts]
    return [(block.ranges, block) for block in blocks]


def test_labels_that_do_not_apply_become_numbers(tmp_path: Path) -> None:
    rows = spool_examples(in_blocks(stack(make_datums(9)), 4), tmp_path)
    targets, leads = rows["targets_m"].numpy(), leads_of(rows) > 0.5
    assert np.isfinite(targets).all()
    assert (targets[leads, 1] == 0).all()
    assert (targets[~leads, 0] == 0).all()


def test_spooled_examples_hold_what_the_rows_say(tmp_path: Path) -> None:
    rows = stack(make_datums(50))
    examples = spool_examples(in_blocks(rows, 7), tmp_path)
    assert np.array_equal(examples["inputs"], rows.ranges)
    assert np.array_equal(leads_of(examples) > 0.5, rows.leads_to_goal)
    assert np.array_equal(examples["targets_m"][:, 0], np.nan_to_num(rows.delta_success_m))
    assert np.array_equal(examples["targets_m"][:, 1], np.nan_to_num(rows.exploration_m))
    weight = rows.weight_m.copy()
    weigh(leads_of(examples), weight, by_cost=True, by_class=True)
    assert np.array_equal(examples["weight"], weight)
    assert {tensor.dtype.itemsize for tensor in examples.tensors.values()} == {4}


def test_how_the_rows_come_in_blocks_does_not_matter(tmp_path: Path) -> None:
    rows = stack(make_datums(50))
    prints = {spool_examples(in_blocks(rows, size), tmp_path).fingerprint() for size in (1, 7, 50)}
    assert len(prints) == 1


def test_the_scratch_files_have_no_names(tmp_path: Path) -> None:
    examples = spool_examples(in_blocks(stack(make_datums(20)), 10), tmp_path)
    assert examples.count == 20
    assert list(tmp_path.iterdir()) == []


def test_no_rows_make_no_examples(tmp_path: Path) -> None:
    assert spool_examples([], tmp_path / "never").count == 0
    assert not (tmp_path / "never").exists()
