"""What a network's estimate costs, by number of subgoals, beside torch on the same weights, one thread."""

from pathlib import Path

import numpy as np
import pytest
import torch

from models.subgoals import SubgoalNet, SubgoalPredictor
from pipeline.learning.weights import save_weights
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.inputs import subgoal_inputs
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK, NetworkHeader


@pytest.fixture(scope="module")
def network(tmp_path_factory) -> tuple[SubgoalNet, LearnedEstimator]:
    torch.manual_seed(0)
    net = SubgoalNet().eval()
    header = NetworkHeader(
        inputs=260, hidden=(256, 128, 48, 16), dropout=0.5, input_frame="subgoal", target_scaling="standardise"
    )
    path: Path = tmp_path_factory.mktemp("network") / "network.safetensors"
    save_weights(
        path,
        SUBGOAL_NETWORK,
        header,
        {name: value.numpy() for name, value in net.state_dict().items() if "num" not in name},
    )
    return net, LearnedEstimator.load(path)


@pytest.mark.parametrize("who", ["hinterland", "torch"])
@pytest.mark.parametrize("count", [1, 3, 12])
def test_estimate(benchmark, network, count: int, who: str) -> None:
    benchmark.group = f"estimates of {count} subgoals"
    net, estimator = network
    rng = np.random.default_rng(0)
    scene = rng.uniform(0, 10, 256).astype(np.float32), rng.normal(0, 8, 2), rng.normal(0, 5, (count, 2))
    predictor = SubgoalPredictor(net, slope=1.0, offset=0.0).eval()
    torch.set_num_threads(1)

    def by_torch() -> np.ndarray:
        with torch.inference_mode():
            return predictor(torch.from_numpy(subgoal_inputs(*scene))).numpy()

    expected = by_torch()
    if who == "torch":
        benchmark(by_torch)
    else:
        found = benchmark(estimator.estimate_scan, *scene)
        np.testing.assert_allclose(np.stack(found, axis=1), expected, rtol=1e-4, atol=1e-4)
    benchmark.extra_info["ms"] = 1e3 * benchmark.stats.stats.median
