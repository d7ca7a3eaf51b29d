import itertools
from pathlib import Path

import pytest
import torch
from lightning.pytorch.utilities import move_data_to_device

from models.subgoals import Batch
from pipeline.learning.batches import Batches
from pipeline.randomness import stream
from tests.learning.synthetic import make_examples


@pytest.fixture(autouse=True)
def scratch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def _batches(first: int, steps: int = 40, seed: int = 1, count: int = 50, look_every: int = 10) -> Batches:
    return Batches(
        examples=make_examples(count, seed=0),
        batch_size=16,
        seed=seed,
        steps=steps,
        look_every=look_every,
        scratch=Path(),
        step=lambda: first,
    )


def _unrolled(batches: Batches) -> list[tuple[int, Batch]]:
    return list(itertools.chain.from_iterable(batches))


def test_a_batch_and_its_seed_depend_on_their_step_alone() -> None:
    whole = _unrolled(_batches(0))
    assert len(whole) == 40
    for first in (1, 2, 3, 17, 39):
        for (seed, ours), (theirs_seed, theirs) in zip(_unrolled(_batches(first)), whole[first:], strict=True):
            assert seed == theirs_seed
            assert all(map(torch.equal, ours, theirs))


def test_a_pass_is_numpys_permutation() -> None:
    examples, second = make_examples(70_000, seed=0), _batches(4375, steps=8750, count=70_000)
    found = torch.cat([batch.inputs_BI for _, batch in _unrolled(second)])
    order = torch.from_numpy(stream(1, "batches", 1).permutation(70_000))
    assert torch.equal(found, examples.inputs[order])


def test_no_row_comes_twice_in_one_pass() -> None:
    one_pass = torch.cat([batch.inputs_BI for _, batch in _unrolled(_batches(0))[:3]])
    assert len(torch.unique(one_pass, dim=0)) == 48


def test_passes_and_seeds_differ() -> None:
    whole, other = _unrolled(_batches(0)), _unrolled(_batches(0, seed=2))
    assert not torch.equal(whole[0][1].inputs_BI, whole[3][1].inputs_BI)
    assert not torch.equal(whole[0][1].inputs_BI, other[0][1].inputs_BI)
    assert whole[0][0] != whole[1][0] != other[1][0]


def test_fewer_rows_than_a_batch_make_one_batch_of_all() -> None:
    assert [len(batch.leads_B) for _, batch in _unrolled(_batches(0, steps=2, count=5))] == [5, 5]


@pytest.mark.parametrize(
    ("first", "steps", "look_every", "ends"),
    [
        (0, 350, 1000, [100, 200, 300, 350]),
        (0, 300, 150, [100, 150, 250, 300]),
        (30, 47, 10, [40, 47]),
        (47, 47, 10, []),
    ],
)
def test_strides_end_at_looks_and_at_the_end(first: int, steps: int, look_every: int, ends: list[int]) -> None:
    assert [stride.steps.stop for stride in _batches(first, steps=steps, look_every=look_every)] == ends


def test_lightning_moves_a_stride_as_it_moves_a_batch() -> None:
    stride = next(iter(_batches(0)))
    moved = move_data_to_device(stride, torch.device("meta"))
    assert moved.steps == stride.steps
    assert all(part.device.type == "meta" for _, batch in moved for part in batch)
    assert all(part.device.type == "cpu" for _, batch in stride for part in batch)
