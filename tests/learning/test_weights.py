import json
import pickle
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file

from models.subgoals import SubgoalNet
from pipeline.errors import TableError
from pipeline.files import write_sum
from pipeline.learning.calibration import Calibration
from pipeline.learning.weights import Arrays, NetworkHeader, load_weights, save_weights

HEADER = NetworkHeader(
    inputs=6,
    hidden=(4, 3),
    dropout=0.5,
    input_frame="subgoal",
    target_scaling="standardise",
    calibration=Calibration(1.5, -0.25),
    steps=70,
    fingerprint="abc",
    made_with={"sensor.max_range_m": 6.5, "robot.step_m": 0.3, "harvest.splits": ["train"], "harvest.max_steps": None},
)


def arrays_of(net: SubgoalNet) -> Arrays:
    return {name: value.numpy() for name, value in net.state_dict().items() if "num_batches" not in name}


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    path = tmp_path / "network.safetensors"
    save_weights(path, HEADER, arrays_of(SubgoalNet(inputs=6, hidden=(4, 3))))
    return path


def test_what_is_saved_is_loaded(tmp_path: Path) -> None:
    path, arrays = tmp_path / "network.safetensors", arrays_of(SubgoalNet(inputs=6, hidden=(4, 3)))
    save_weights(path, HEADER, arrays)
    header, found = load_weights(path)
    assert header == HEADER
    assert found.keys() == arrays.keys()
    assert all(np.array_equal(found[name], arrays[name]) for name in arrays)
    first = path.read_bytes()
    save_weights(path, HEADER, arrays)
    assert path.read_bytes() == first


def _rewrite(path: Path, **changes: object) -> None:
    from safetensors import safe_open

    header, arrays = load_weights(path)
    with safe_open(path, framework="numpy") as file:
        content = json.loads(file.metadata()["hinterland"])
    del header
    save_file(arrays, path, metadata={"hinterland": json.dumps(content | changes)})


def _pickle(path: Path) -> None:
    path.write_bytes(pickle.dumps({"head.weight": np.zeros(3)}))


def _cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-20])


def _cut_header(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:5])


def _foreign(path: Path) -> None:
    save_file({"x": np.zeros(3, np.float32)}, path)


def _nan(path: Path) -> None:
    header, arrays = load_weights(path)
    save_weights(path, header, arrays | {"head.bias": np.full(3, np.nan, np.float32)})


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
        (lambda path: _rewrite(path, version=0), r"holds a subgoal_network v0, this code reads a subgoal_network v1"),
        (lambda path: _rewrite(path, hidden=[4, 5]), "array .* has shape .* expected"),
        (lambda path: _rewrite(path, surprise=1), "header does not describe a network"),
        (lambda path: _rewrite(path, made_with=3), "made_with is no table of settings"),
        (_nan, "array head.bias holds values that are not finite"),
    ],
)
def test_a_bad_weights_file_is_named(weights: Path, damage: object, message: str) -> None:
    damage(weights)  # type: ignore[operator]
    if weights.exists():
        write_sum(weights)
    with pytest.raises(TableError, match=message) as caught:
        load_weights(weights)
    assert str(weights) in str(caught.value)
