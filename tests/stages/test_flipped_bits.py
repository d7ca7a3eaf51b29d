"""One flipped bit in what stages hand to each other is found and named, and a resumed stage makes the unit again."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np
import pytest

from models.subgoals import SubgoalNet
from pipeline.datums import read_datums, shard_path, stack, write_shard
from pipeline.errors import TableError
from pipeline.evaluation.trials import read_trials, write_trials
from pipeline.files import damage, write_json
from pipeline.learning.weights import load_weights, save_weights
from pipeline.stages.units import run_units
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK, NetworkHeader
from tests.datums.rows import make_datums
from tests.evaluation.rows import trial

ROWS = [trial(f"plan{index}/0", name, 10.0 + index) for name in ("optimistic", "learned") for index in range(4)]


def make_shard(scratch: Path, number: int) -> None:
    write_shard(scratch, stack(make_datums(3 + number)))


def make_part(scratch: Path, number: int) -> None:
    write_trials(scratch / "trials.parquet", ROWS)
    write_json(scratch / "numbers.json", [number])


def harvested(folder: Path) -> int:
    units = [(shard_path(folder, number), number) for number in range(2)]
    return run_units(units, make_shard, folder, {"seed": 3}, workers=1, label="harvest", progress=False)


def evaluated(folder: Path) -> int:
    units = [(folder / f"part-{number:06d}", number) for number in range(2)]
    return run_units(units, make_part, folder, {"seed": 4}, workers=1, label="evaluate", progress=False)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("whole")
    harvested(root / "datums")
    evaluated(root / "parts")
    net = SubgoalNet(inputs=6, hidden=(4, 3))
    header = NetworkHeader(inputs=6, hidden=(4, 3), dropout=0.5, input_frame="subgoal", target_scaling="standardise")
    arrays = {name: value.numpy() for name, value in net.state_dict().items() if "num_batches" not in name}
    save_weights(root / "network.safetensors", SUBGOAL_NETWORK, header, arrays)
    write_trials(root / "trials.parquet", ROWS)
    return root


READ: dict[str, Callable[[Path], object]] = {
    "network.safetensors": lambda path: load_weights(path, SUBGOAL_NETWORK),
    "trials.parquet": read_trials,
    "datums": read_datums,
}


def flip(path: Path, bit: int) -> None:
    content = np.fromfile(path, np.uint8)
    content[bit // 8] ^= np.uint8(1 << bit % 8)
    content.tofile(path)


def assert_found(root: Path, file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Assert that reading names ``file``, and that the stage that resumes over it makes it whole."""
    name = file.name.removesuffix(".sha256")
    kind = file.relative_to(root).parts[0].removesuffix(".sha256")
    if kind in READ and name != "fingerprint.json":
        with pytest.raises(TableError, match=name):
            READ[kind](root / kind)
    if kind in ("datums", "parts"):
        capsys.readouterr()
        there = harvested(root / kind) if kind == "datums" else evaluated(root / kind)
        told = capsys.readouterr().err
        assert name in told
        assert there == (0 if name == "fingerprint.json" else 1), told
        assert damage(root / kind) is None


def flip_and_look(whole: Path, folder: Path, times: int, capsys: pytest.CaptureFixture[str], *, seed: int) -> None:
    root, random = folder / "copy", Random(seed)
    shutil.copytree(whole, root)
    files = sorted(path for path in root.rglob("*") if path.is_file())
    before = {path: path.read_bytes() for path in files}
    sizes = [len(before[path]) for path in files]
    for _ in range(times):
        (file,) = random.choices(files, sizes)
        flip(file, random.randrange(8 * len(before[file])))
        assert_found(root, file, capsys)
        for path, content in before.items():
            path.write_bytes(content)


def test_flipped_bits_are_found_and_made_good(whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flip_and_look(whole, tmp_path, 60, capsys, seed=1)


@pytest.mark.slow
def test_a_thousand_flipped_bits_are_found(whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flip_and_look(whole, tmp_path, 1000, capsys, seed=2)


@pytest.mark.parametrize("name", ["fingerprint.json", "fingerprint.json.sha256", "part-000001.parquet.sha256"])
def test_every_bit_of_what_vouches_is_found(
    whole: Path, tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    root = tmp_path / "copy"
    shutil.copytree(whole, root)
    file = root / "datums" / name
    content = file.read_bytes()
    for bit in range(8 * len(content)):
        flip(file, bit)
        assert damage(root / "datums") is not None
        file.write_bytes(content)


def test_a_missing_file_of_a_part_makes_the_part_again(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = tmp_path / "copy"
    shutil.copytree(whole, root)
    (root / "parts" / "part-000001" / "numbers.json").unlink()
    assert evaluated(root / "parts") == 1
    assert "numbers.json is missing; this unit is made again" in capsys.readouterr().err
    assert json.loads((root / "parts" / "part-000001" / "numbers.json").read_text()) == [1]


def test_other_settings_discard_the_units_with_a_word(
    whole: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = tmp_path / "copy"
    shutil.copytree(whole, root)
    units = [(shard_path(root / "datums", 0), 0)]
    there = run_units(units, make_shard, root / "datums", {"seed": 5}, workers=1, label="harvest", progress=False)
    assert there == 0
    assert "holds work of other settings, inputs or code (seed); all units are made anew" in capsys.readouterr().err
