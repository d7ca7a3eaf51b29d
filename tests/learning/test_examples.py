from pathlib import Path

import numpy as np
import torch

from pipeline.datums import DatumRows, stack
from pipeline.learning.examples import Examples, label_columns, spool_examples
from pipeline.learning.weighing import weigh
from tests.datums.rows import make_datums
from tests.learning.synthetic import make_examples

CPU = torch.device("cpu")


def in_blocks(rows: DatumRows, size: int) -> list[tuple[np.ndarray, DatumRows]]:
    """Rows in blocks, each with its ranges as inputs."""
    firsts = range(0, len(rows.pair_id), size)
    blocks = [DatumRows(*(column[first : first + size] for column in rows)) for first in firsts]
    return [(block.ranges, block) for block in blocks]


def test_labels_that_do_not_apply_become_numbers() -> None:
    labels = label_columns(stack(make_datums(9)))
    assert np.isfinite(labels).all()
    assert (labels[labels[:, 0] > 0.5, 2] == 0).all()
    assert (labels[labels[:, 0] < 0.5, 1] == 0).all()


def test_spooled_examples_hold_what_the_rows_say(tmp_path: Path) -> None:
    rows = stack(make_datums(50))
    examples = spool_examples(in_blocks(rows, 7), tmp_path)
    assert np.array_equal(examples.inputs.numpy(), rows.ranges)
    assert np.array_equal(examples.leads > 0.5, rows.leads_to_goal)
    batch = next(examples.blocks(50))
    assert np.array_equal(batch.targets_m_BT[:, 0], np.nan_to_num(rows.delta_success_m))
    assert np.array_equal(batch.targets_m_BT[:, 1], np.nan_to_num(rows.exploration_m))
    weight = rows.weight_m.copy()
    weigh(examples.leads, weight, by_cost=True, by_class=True)
    assert np.array_equal(batch.weight_B, weight)


def test_how_the_rows_come_in_blocks_does_not_matter(tmp_path: Path) -> None:
    rows = stack(make_datums(50))
    prints = {spool_examples(in_blocks(rows, size), tmp_path).fingerprint() for size in (1, 7, 50)}
    assert len(prints) == 1


def test_mapped_and_in_memory_give_equal_batches(tmp_path: Path) -> None:
    mapped = spool_examples(in_blocks(stack(make_datums(90)), 30), tmp_path)
    loaded = Examples(inputs=mapped.inputs.clone(), labels=mapped.labels.clone())
    index = torch.randperm(90)[:40]
    for ours, theirs in zip(mapped.batch(index, CPU), loaded.batch(index, CPU), strict=True):
        assert torch.equal(ours, theirs)
    assert torch.equal(mapped.batch(index, CPU).inputs_BI, mapped.inputs[index])


def test_the_scratch_files_have_no_names(tmp_path: Path) -> None:
    examples = spool_examples(in_blocks(stack(make_datums(20)), 10), tmp_path)
    assert examples.count == 20
    assert list(tmp_path.iterdir()) == []


def test_no_rows_make_no_examples(tmp_path: Path) -> None:
    assert spool_examples([], tmp_path / "never").count == 0
    assert not (tmp_path / "never").exists()


def test_the_fingerprint_sees_every_value() -> None:
    before, after = make_examples(5, seed=0), make_examples(5, seed=0)
    assert before.fingerprint() == after.fingerprint()
    after.labels[3, 3] += 1e-3
    assert before.fingerprint() != after.fingerprint()
    other = make_examples(5, seed=0)
    other.inputs[4, 11] += 1e-3
    assert before.fingerprint() != other.fingerprint()
