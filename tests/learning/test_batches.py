import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import torch
from lightning.pytorch.utilities import move_data_to_device
from torch import Tensor

from pipeline.learning.batches import Batches, Stride
from pipeline.randomness import stream
from tests.learning.synthetic import make_examples


@pytest.fixture(autouse=True)
def scratch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def _batches(
    first: int, steps: int = 40, seed: int = 1, count: int = 50, look_every: int = 10, stride: int = 100
) -> Batches:
    return Batches(
        rows=make_examples(count, seed=0),
        batch_size=16,
        seed=seed,
        first=first,
        steps=steps,
        look_every=look_every,
        stride=stride,
        scratch=Path(),
    )


def _strides(batches: Batches) -> list[Stride]:
    """The strides up to the last step."""
    strides: Iterator[Any] = iter(batches)
    return list(itertools.takewhile(lambda stride: stride.steps.start < batches.steps, strides))


def _unrolled(batches: Batches) -> list[tuple[int, dict[str, Tensor]]]:
    return list(itertools.chain.from_iterable(_strides(batches)))


def test_a_batch_and_its_seed_depend_on_their_step_alone() -> None:
    whole = _unrolled(_batches(0))
    assert len(whole) == 40
    for first in (1, 2, 3, 17, 39):
        for (seed, ours), (theirs_seed, theirs) in zip(_unrolled(_batches(first)), whole[first:], strict=True):
            assert seed == theirs_seed
            assert all(torch.equal(ours[name], theirs[name]) for name in theirs)


def test_a_pass_is_numpys_permutation() -> None:
    examples, second = make_examples(70_000, seed=0), _batches(4375, steps=8750, count=70_000)
    found = torch.cat([batch["inputs"] for _, batch in _unrolled(second)])
    order = torch.from_numpy(stream(1, "batches", 1).permutation(70_000))
    assert torch.equal(found, examples["inputs"][order])


def test_no_row_comes_twice_in_one_pass() -> None:
    one_pass = torch.cat([batch["inputs"] for _, batch in _unrolled(_batches(0))[:3]])
    assert len(torch.unique(one_pass, dim=0)) == 48


def test_passes_and_seeds_differ() -> None:
    whole, other = _unrolled(_batches(0)), _unrolled(_batches(0, seed=2))
    assert not torch.equal(whole[0][1]["inputs"], whole[3][1]["inputs"])
    assert not torch.equal(whole[0][1]["inputs"], other[0][1]["inputs"])
    assert whole[0][0] != whole[1][0] != other[1][0]


def test_fewer_rows_than_a_batch_make_one_batch_of_all() -> None:
    assert [len(batch["leads"]) for _, batch in _unrolled(_batches(0, steps=2, count=5))] == [5, 5]


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
    assert [stride.steps.stop for stride in _strides(_batches(first, steps=steps, look_every=look_every))] == ends


def test_without_strides_the_batches_are_those_of_the_strides_and_go_on_beyond_the_last() -> None:
    whole = _unrolled(_batches(0))
    batches: list[Any] = list(itertools.islice(_batches(7, stride=1), 40))
    for ours, (_, theirs) in zip(batches, whole[7:], strict=False):
        assert all(torch.equal(ours[name], theirs[name]) for name in theirs)


def test_lightning_moves_a_stride_as_it_moves_a_batch() -> None:
    (stride,) = _strides(_batches(0, steps=5))
    moved = move_data_to_device(stride, torch.device("meta"))
    assert moved.steps == stride.steps
    assert all(part.device.type == "meta" for _, batch in moved for part in batch.values())
    assert all(part.device.type == "cpu" for _, batch in stride for part in batch.values())
