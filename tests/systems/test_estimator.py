"""The estimator without torch says what the torch network says."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from models.subgoals import SubgoalNet, SubgoalPredictor
from pipeline.errors import TableError
from pipeline.learning.platt import PlattScaling
from pipeline.learning.weights import save_weights
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.inputs import subgoal_inputs
from pipeline.systems.subgoals.map_inputs import MAP_INPUTS
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK, NetworkHeader

CALIBRATION = PlattScaling(1.7, -0.4)


def trained_like(scaling: str, seed: int = 0) -> SubgoalNet:
    """A network whose buffers and norms are as far from their defaults as training takes them."""
    torch.manual_seed(seed)
    net = SubgoalNet(target_scaling=scaling)  # type: ignore[arg-type]
    net.input_mean.copy_(torch.rand(260) * 8)
    net.input_std.copy_(torch.rand(260) * 4 + 0.5)
    net.target_mean.copy_(torch.tensor([2.0, 3.0]))
    net.target_std.copy_(torch.tensor([1.5, 0.8]))
    for layer in net.layers:
        layer[1].running_mean.normal_()
        layer[1].running_var.uniform_(0.1, 3.0)
        torch.nn.init.normal_(layer[1].weight)
        torch.nn.init.normal_(layer[1].bias)
    torch.nn.init.normal_(net.head.weight)
    return net.eval()


def save(path: Path, net: SubgoalNet, *, frame: str = "subgoal", inputs: int = 260) -> Path:
    header = NetworkHeader(
        inputs=inputs,
        hidden=(256, 128, 48, 16),
        dropout=0.5,
        input_frame=frame,
        target_scaling=net.target_scaling,
        calibration=CALIBRATION,
    )
    state = net.state_dict()
    save_weights(
        path, SUBGOAL_NETWORK, header, {name: state[name].numpy() for name in state if "num_batches" not in name}
    )
    return path


def scene(seed: int, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(0, 10, 256).astype(np.float32), rng.normal(0, 8, 2), rng.normal(0, 5, (count, 2))


@pytest.mark.parametrize("scaling", ["standardise", "log"])
@pytest.mark.parametrize("frame", ["subgoal", "robot"])
def test_it_equals_torch(tmp_path: Path, scaling: str, frame: str) -> None:
    net = trained_like(scaling)
    estimator = LearnedEstimator.load(save(tmp_path / "network.safetensors", net, frame=frame))
    predictor = SubgoalPredictor(net, slope=CALIBRATION.slope, offset=CALIBRATION.offset).eval()
    for seed in range(200):  # 1,000 rows
        ranges, goal, subgoals = scene(seed, 5)
        inputs = torch.from_numpy(subgoal_inputs(ranges, goal, subgoals, frame=frame))  # type: ignore[arg-type]
        with torch.no_grad():
            expected = predictor(inputs).numpy()
        found = np.stack(estimator.estimate_scan(ranges, goal, subgoals), axis=1)
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("beams", [64, 72, 512])
@pytest.mark.parametrize("frame", ["subgoal", "robot"])
def test_it_equals_torch_for_scans_of_any_length(tmp_path: Path, beams: int, frame: str) -> None:
    torch.manual_seed(3)
    net = SubgoalNet(inputs=beams + 4).eval()
    path = save(tmp_path / "network.safetensors", net, frame=frame, inputs=beams + 4)
    estimator = LearnedEstimator.load(path, input_beams=beams)
    rng = np.random.default_rng(beams)
    ranges, goal, subgoals = rng.uniform(0, 10, beams), rng.normal(0, 8, 2), rng.normal(0, 5, (3, 2))
    inputs = subgoal_inputs(ranges, goal, subgoals, frame=frame)  # type: ignore[arg-type]
    assert estimator.beams == beams and inputs.shape == (3, beams + 4)
    with torch.no_grad():
        expected = SubgoalPredictor(net, slope=CALIBRATION.slope, offset=CALIBRATION.offset)(torch.from_numpy(inputs))
    found = np.stack(estimator.estimate_scan(ranges, goal, subgoals), axis=1)
    np.testing.assert_allclose(found, expected.numpy(), rtol=1e-5, atol=1e-5)


def test_a_sensor_of_other_beams_is_refused(tmp_path: Path) -> None:
    path = save(tmp_path / "network.safetensors", trained_like("log"))
    with pytest.raises(
        TableError, match=r"network.safetensors takes scans of 256 ranges, sensor.input_beams = 128: set"
    ):
        LearnedEstimator.load(path, input_beams=128)
    estimator = LearnedEstimator.load(path, input_beams=256)
    for wrong in (np.ones(128), np.ones(512), np.ones((1, 256))):
        with pytest.raises(TableError, match=r"for one scan of 256 ranges, got ranges of shape"):
            estimator.estimate_scan(wrong, (1.0, 0.0), [(1.0, 0.0)])


def test_a_network_that_reads_the_map_estimates_no_scan(tmp_path: Path) -> None:
    path = save(tmp_path / "network.safetensors", SubgoalNet(inputs=MAP_INPUTS).eval(), frame="map", inputs=MAP_INPUTS)
    estimator = LearnedEstimator.load(path, input_beams=128)
    assert estimator.beams is None and not estimator.lasting
    for beams in (256, MAP_INPUTS - 4):
        with pytest.raises(TableError, match=r"for the robot's whole map .* no estimate can be made from one scan"):
            estimator.estimate_scan(np.ones(beams), (1.0, 0.0), [(1.0, 0.0)])


def test_probabilities_stay_inside_and_costs_at_or_above_zero(tmp_path: Path) -> None:
    found = []
    for sign in (1.0, -1.0):
        net = trained_like("standardise")
        with torch.no_grad():
            net.head.weight.mul_(sign * 1e4)
        estimator = LearnedEstimator.load(save(tmp_path / "network.safetensors", net))
        with np.errstate(all="raise", under="ignore"):
            found += [estimator.estimate_scan(*scene(seed, 8)) for seed in range(20)]
    p = np.concatenate([each.p_success for each in found])
    assert ((p > 0) & (p < 1)).all()
    assert p.min() < 0.001
    assert p.max() > 0.999
    for each in found:
        assert (each.delta_success >= 0).all()
        assert (each.exploration >= 0).all()


def test_one_subgoal_is_estimated_as_among_many(tmp_path: Path) -> None:
    estimator = LearnedEstimator.load(save(tmp_path / "network.safetensors", trained_like("log")))
    ranges, goal, subgoals = scene(0, 6)
    together = np.stack(estimator.estimate_scan(ranges, goal, subgoals), axis=1)
    alone = [np.stack(estimator.estimate_scan(ranges, goal, [subgoal]), axis=1)[0] for subgoal in subgoals]
    assert np.array_equal(together, alone)


@pytest.mark.parametrize("frame", ["world", "Subgoal"])
def test_weights_for_other_inputs_are_refused(tmp_path: Path, frame: str) -> None:
    path = save(tmp_path / "network.safetensors", trained_like("log"), frame=frame)
    with pytest.raises(
        TableError, match=f"of the kind '{frame}', this code builds .* of the kinds subgoal and robot, 4 more"
    ):
        LearnedEstimator.load(path)


def test_a_worker_needs_no_torch() -> None:
    code = "import sys, pipeline.systems.subgoals.estimator; print({'torch', 'lightning', 'mlflow'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parents[2], capture_output=True, check=True)
    assert done.stdout.decode().strip() == "set()"
