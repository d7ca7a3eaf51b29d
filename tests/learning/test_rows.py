from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch

from pipeline.errors import TableError
from pipeline.learning.rows import Rows, spool_rows
from tests.learning.synthetic import make_examples, make_pictures

CPU = torch.device("cpu")


def in_blocks(rows: Rows, size: int) -> Iterator[dict[str, np.ndarray]]:
    for block in rows.blocks(size):
        yield {name: tensor.numpy() for name, tensor in block.items()}


@pytest.mark.parametrize("size", [1, 7, 50])
def test_spooled_rows_are_the_blocks_of_any_shape_and_type(tmp_path: Path, size: int) -> None:
    given = make_pictures(50, 3)
    rows = spool_rows(in_blocks(given, size), tmp_path)
    assert rows.count == 50
    assert {name: tensor.dtype for name, tensor in rows.tensors.items()} == {
        "picture": torch.uint8,
        "plan": torch.uint8,
        "side": torch.int64,
    }
    assert rows["plan"].shape == (50, 32, 4)  # bits stay packed
    assert all(torch.equal(rows[name], given[name]) for name in given.tensors)
    assert rows.fingerprint() == given.fingerprint()
    assert list(tmp_path.iterdir()) == []


def test_mapped_and_in_memory_give_equal_batches_that_are_copies(tmp_path: Path) -> None:
    mapped = spool_rows(in_blocks(make_pictures(90, 0), 30), tmp_path)
    index = torch.randperm(90)[:40]
    batch = mapped.batch(index, CPU)
    assert all(torch.equal(batch[name], mapped[name][index]) for name in mapped.tensors)
    batch["picture"].zero_()
    assert mapped["picture"].any()


def test_blocks_are_all_rows_in_order_and_no_copies() -> None:
    rows = make_examples(17, 0)
    blocks = list(rows.blocks(8))
    assert [len(block["leads"]) for block in blocks] == [8, 8, 1]
    assert torch.equal(torch.cat([block["inputs"] for block in blocks]), rows["inputs"])
    assert blocks[1]["inputs"].data_ptr() == rows["inputs"][8:].data_ptr()


def test_the_fingerprint_sees_every_value_name_type_and_shape() -> None:
    plain = Rows({"a": torch.zeros(4, 6), "b": torch.arange(4)})
    others = [
        Rows({"a": torch.zeros(4, 6), "c": torch.arange(4)}),
        Rows({"a": torch.zeros(4, 3, 2), "b": torch.arange(4)}),
        Rows({"a": torch.zeros(4, 6, dtype=torch.int32), "b": torch.arange(4)}),
        Rows({"a": torch.zeros(4, 6), "b": torch.tensor([0, 1, 2, 4])}),
        Rows({"b": torch.zeros(4, 6), "a": torch.arange(4)}),
    ]
    assert Rows({"b": torch.arange(4), "a": torch.zeros(4, 6)}).fingerprint() == plain.fingerprint()
    assert len({rows.fingerprint() for rows in [plain, *others]}) == 6
    changed = make_examples(70_000, seed=0)
    before = changed.fingerprint()
    changed["inputs"][69_999, 11] += 1e-3  # beyond the first block
    assert changed.fingerprint() != before


def test_no_rows_make_no_files(tmp_path: Path) -> None:
    assert spool_rows([], tmp_path / "never").count == 0
    assert not (tmp_path / "never").exists()


def test_tensors_of_different_length_and_blocks_of_other_names_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"different number: \{'a': 3, 'b': 4\}"):
        Rows({"a": torch.zeros(3), "b": torch.zeros(4)})
    with pytest.raises(TableError, match="A block of rows holds b, the first one a"):
        spool_rows([{"a": np.zeros(2)}, {"b": np.zeros(2)}], tmp_path)
