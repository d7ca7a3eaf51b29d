import json
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save_file

from models.subgoals import SubgoalNet
from pipeline.errors import TableError
from pipeline.files import write_sum
from pipeline.learning.platt import PlattScaling
from pipeline.learning.weights import load_weights, save_weights
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK, NetworkHeader, shapes_of
from pipeline.systems.subgoals.training import arrays_of

HEADER = NetworkHeader(
    inputs=6,
    hidden=(4, 3),
    dropout=0.5,
    input_frame="subgoal",
    target_scaling="standardise",
    calibration=PlattScaling(1.5, -0.25),
    steps=70,
    fingerprint="abc",
    made_with={"sensor.max_range_m": 6.5, "robot.step_m": 0.3, "harvest.splits": ["train"], "harvest.max_steps": None},
)


@pytest.mark.parametrize("hidden", [(4, 3), (7,), (256, 128, 48, 16)])
def test_the_header_promises_the_arrays_of_the_network(hidden: tuple[int, ...]) -> None:
    arrays = arrays_of(SubgoalNet(inputs=9, hidden=hidden))
    header = NetworkHeader(inputs=9, hidden=hidden, dropout=0.5, input_frame="subgoal", target_scaling="log")
    assert shapes_of(header) == {name: array.shape for name, array in arrays.items()}


def test_what_is_saved_is_loaded(tmp_path: Path) -> None:
    path, arrays = tmp_path / "network.safetensors", arrays_of(SubgoalNet(inputs=6, hidden=(4, 3)))
    save_weights(path, SUBGOAL_NETWORK, HEADER, arrays)
    header, found = load_weights(path, SUBGOAL_NETWORK)
    assert header == HEADER
    assert all(np.array_equal(found[name], arrays[name]) for name in arrays)


def test_files_of_version_1_stay_readable(tmp_path: Path) -> None:
    """As the first weights files were written, word by word."""
    path, arrays = tmp_path / "network.safetensors", arrays_of(SubgoalNet(inputs=6, hidden=(4, 3)))
    marks = (
        '{"calibration": {"offset": -0.25, "slope": 1.5}, "dropout": 0.5, "fingerprint": "abc", "hidden": [4, 3], '
        '"input_frame": "subgoal", "inputs": 6, "kind": "subgoal_network", "made_with": {"harvest.max_steps": null, '
        '"harvest.splits": ["train"], "robot.step_m": 0.3, "sensor.max_range_m": 6.5}, "steps": 70, '
        '"target_scaling": "standardise", "version": 1}'
    )
    save_file(arrays, path, metadata={"hinterland": marks})
    write_sum(path)
    header, _ = load_weights(path, SUBGOAL_NETWORK)
    assert header == HEADER
    content = path.read_bytes()
    save_weights(path, SUBGOAL_NETWORK, HEADER, arrays)
    assert path.read_bytes() == content
    old = {name: value for name, value in json.loads(marks).items() if name != "made_with"}
    save_file(arrays, path, metadata={"hinterland": json.dumps(old)})
    write_sum(path)
    assert load_weights(path, SUBGOAL_NETWORK)[0].made_with == {}


def test_other_widths_are_named(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"array .* has shape .* expected"):
        save_weights(
            tmp_path / "network.safetensors", SUBGOAL_NETWORK, HEADER, arrays_of(SubgoalNet(inputs=6, hidden=(4, 5)))
        )
