import json
import pickle
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import save_file

from pipeline.errors import TableError
from pipeline.files import write_sum
from pipeline.learning.weights import WeightsHeader, WeightsKind, load_weights, save_weights


@dataclass(frozen=True, kw_only=True)
class Header(WeightsHeader):
    channels: int
    window: tuple[int, int]


KIND = WeightsKind(
    name="pictures",
    version=2,
    header=Header,
    shapes=lambda header: {"stem": (header.channels, *header.window), "seen": (), "mask": (3,)},
)
HEADER = Header(channels=2, window=(3, 5), steps=70, fingerprint="abc", made_with={"harvest.max_steps": None})
ARRAYS = {
    "stem": np.random.default_rng(0).random((2, 3, 5)).astype(np.float32),
    "seen": np.array(12, dtype=np.int64),
    "mask": np.array([1, 0, 255], dtype=np.uint8),
}


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    path = tmp_path / "network.safetensors"
    save_weights(path, KIND, HEADER, ARRAYS)
    return path


def test_what_is_saved_is_loaded(weights: Path) -> None:
    header, found = load_weights(weights, KIND)
    assert header == HEADER
    assert found.keys() == ARRAYS.keys()
    assert all(np.array_equal(found[name], ARRAYS[name]) for name in ARRAYS)
    assert all(found[name].dtype == ARRAYS[name].dtype for name in ARRAYS)
    first = weights.read_bytes()
    save_weights(weights, KIND, HEADER, dict(reversed(ARRAYS.items())))
    assert weights.read_bytes() == first


def _rewrite(path: Path, **changes: object) -> None:
    with safe_open(path, framework="numpy") as file:
        content = json.loads(file.metadata()["hinterland"])
    save_file(ARRAYS, path, metadata={"hinterland": json.dumps(content | changes)})


def _pickle(path: Path) -> None:
    path.write_bytes(pickle.dumps(ARRAYS))


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-20])


def _cut_header(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:5])


def _foreign(path: Path) -> None:
    save_file({"x": np.zeros(3, np.float32)}, path)


def _nan(path: Path) -> None:
    with safe_open(path, framework="numpy") as file:
        metadata = file.metadata()
    save_file(ARRAYS | {"stem": np.full((2, 3, 5), np.nan, np.float32)}, path, metadata=metadata)


def _missing(path: Path) -> None:
    path.unlink()


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (_missing, "does not exist: run the train stage"),
        (_pickle, "not a complete safetensors file .* run the train stage again"),
        (_cut, "not a complete safetensors file"),
        (_cut_header, "not a complete safetensors file"),
        (_foreign, "holds no hinterland network"),
        (lambda path: _rewrite(path, version=1), r"holds a pictures v1, this code reads a pictures v2"),
        (lambda path: _rewrite(path, kind="words"), r"holds a words v2, this code reads a pictures v2"),
        (lambda path: _rewrite(path, window=[4, 5]), r"array stem has shape \(2, 3, 5\), expected \(2, 4, 5\)"),
        (lambda path: _rewrite(path, window=[4]), "header does not describe a network .*window"),
        (lambda path: _rewrite(path, surprise=1), "header does not describe a network .*surprise"),
        (lambda path: _rewrite(path, made_with=3), "made_with is no table of settings"),
        (_nan, "array stem holds values that are not finite"),
    ],
)
def test_a_bad_weights_file_is_named(weights: Path, damage: object, message: str) -> None:
    damage(weights)  # type: ignore[operator]
    if weights.exists():
        write_sum(weights)
    with pytest.raises(TableError, match=message) as caught:
        load_weights(weights, KIND)
    assert str(weights) in str(caught.value)


def test_a_flipped_bit_is_seen(weights: Path) -> None:
    content = bytearray(weights.read_bytes())
    content[-3] ^= 1
    weights.write_bytes(content)
    with pytest.raises(TableError, match=r"network.safetensors is damaged"):
        load_weights(weights, KIND)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"stem": ARRAYS["stem"]}, "array mask has shape none, expected"),
        (ARRAYS | {"stem": np.full((2, 3, 5), np.inf)}, "array stem holds values that are not finite"),
    ],
)
def test_what_could_not_be_loaded_is_not_written(tmp_path: Path, arrays: dict[str, np.ndarray], message: str) -> None:
    with pytest.raises(TableError, match=message):
        save_weights(tmp_path / "network.safetensors", KIND, HEADER, arrays)
    assert list(tmp_path.iterdir()) == []
