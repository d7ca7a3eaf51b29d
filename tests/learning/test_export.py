"""What is exported says, without torch, what the network in torch says."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from models.subgoals import SubgoalNet, SubgoalPredictor
from pipeline.errors import TableError
from pipeline.files import write_sum
from pipeline.learning.export import export_onnx
from pipeline.learning.onnx_session import OnnxSession
from tests.learning.synthetic import PictureNet, make_pictures

pytest.importorskip("onnxruntime")
ROOT = Path(__file__).parents[2]


def outputs_of(module: nn.Module, inputs: Tensor) -> np.ndarray:
    with torch.no_grad():
        found: np.ndarray = module.eval()(inputs).numpy()
    return found


def as_if_trained(net: nn.Module) -> nn.Module:
    """Take norms and buffers far from their defaults."""
    torch.manual_seed(3)
    for name, buffer in net.named_buffers():
        if "num_batches" not in name:
            buffer.copy_(torch.rand(buffer.shape) * 3 + 0.5)
    for parameter in net.parameters():
        parameter.data += 0.2 * torch.randn(parameter.shape)
    return net


@pytest.mark.parametrize("scaling", ["standardise", "log"])
def test_the_subgoal_network_equals_torch(tmp_path: Path, scaling: str) -> None:
    net = as_if_trained(SubgoalNet(inputs=24, hidden=(16, 8), target_scaling=scaling))  # type: ignore[arg-type]
    predictor = SubgoalPredictor(net, slope=1.7, offset=-0.4)  # type: ignore[arg-type]
    inputs = torch.rand(1500, 24) * 10
    export_onnx(predictor, inputs[:3], tmp_path / "network.onnx")
    found = OnnxSession(tmp_path / "network.onnx").run(inputs.numpy())
    np.testing.assert_allclose(found, outputs_of(predictor, inputs), rtol=1e-5, atol=1e-5)


def test_a_convolutional_network_over_bytes_equals_torch_for_any_number_of_rows(tmp_path: Path) -> None:
    net, pictures = as_if_trained(PictureNet()), make_pictures(1200, 4)["picture"]
    net.train()
    export_onnx(net, pictures[:1], tmp_path / "network.onnx")
    assert net.training
    session = OnnxSession(tmp_path / "network.onnx")
    assert (session.input_shape, session.input_type) == ((None, 3, 16, 16), np.dtype(np.uint8))
    for count in (1, 2, 7, 1190):
        found = session.run(pictures[-count:].numpy())
        assert found.shape == (count, 2) and found.dtype == np.float32
        np.testing.assert_allclose(found, outputs_of(net, pictures[-count:]), rtol=1e-5, atol=1e-5)
    assert {path.name for path in tmp_path.iterdir()} == {"network.onnx", "network.onnx.sha256"}  # weights inside


def test_equal_networks_give_equal_bytes(tmp_path: Path) -> None:
    net, example = as_if_trained(PictureNet()), make_pictures(2, 4)["picture"]
    for name in ("one", "two"):
        export_onnx(net, example, tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()


def test_inputs_of_another_shape_are_refused(tmp_path: Path) -> None:
    export_onnx(PictureNet(), make_pictures(2, 4)["picture"], tmp_path / "network.onnx")
    with pytest.raises(TableError, match=r"takes inputs of shape \[n, 3, 16, 16\], got \(2, 3, 16, 17\)"):
        OnnxSession(tmp_path / "network.onnx").run(np.zeros((2, 3, 16, 17), np.uint8))


def test_a_file_that_is_no_network_is_named(tmp_path: Path) -> None:
    path = tmp_path / "network.onnx"
    with pytest.raises(TableError, match=r"network.onnx does not exist: run the train stage"):
        OnnxSession(path)
    export_onnx(PictureNet(), make_pictures(2, 4)["picture"], path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 4
    path.write_bytes(content)
    with pytest.raises(TableError, match=r"network.onnx is damaged"):
        OnnxSession(path)
    path.write_bytes(b"words")
    write_sum(path)
    with pytest.raises(TableError, match=r"network.onnx is no network that onnxruntime runs"):
        OnnxSession(path)


class Untold(nn.Module):
    def forward(self, inputs: Tensor) -> Tensor:
        return inputs if inputs.sum() > 0 else -inputs  # a way that depends on the values


def test_what_onnx_has_no_words_for_is_one_error_and_no_file(tmp_path: Path) -> None:
    with pytest.raises(TableError, match="Untold cannot be written as ONNX"):
        export_onnx(Untold(), torch.ones(2, 3), tmp_path / "network.onnx")
    assert list(tmp_path.iterdir()) == []


RUN = """
import sys
from pathlib import Path
import numpy as np
import onnxruntime
from pipeline.learning.onnx_session import OnnxSession

threads = lambda: len(list(Path("/proc/self/task").iterdir()))
before = threads()
OnnxSession(Path(sys.argv[1])).run(np.zeros((1, 3, 16, 16), np.uint8))
print({"torch", "lightning"} & set(sys.modules), threads() - before)
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are counted as Linux tells them")
def test_a_session_needs_no_torch_and_starts_no_threads(tmp_path: Path) -> None:
    export_onnx(PictureNet(), make_pictures(2, 4)["picture"], tmp_path / "network.onnx")
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", RUN, str(tmp_path / "network.onnx")]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set() 0"
