"""A network that nobody trained, as a file: random numbers, without torch."""

from pathlib import Path

import numpy as np

from pipeline.learning.weights import save_weights
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK, NetworkHeader

MADE_WITH = {
    "rasterize.resolution_m": 0.3,
    "robot.radius_m": 0.3,
    "robot.step_m": 0.54,
    "robot.merge_m": 0.0,
    "sensor.max_range_m": 9.0,
}


def write_network(path: Path, *, beams: int = 256) -> Path:
    """Write the weights of one hidden layer for scans of ``beams`` ranges."""
    rng, inputs, hidden = np.random.default_rng(7), beams + 4, (8,)
    shapes = {"layers.0.0.weight": (8, inputs), "layers.0.0.bias": (8,), "layers.0.1.weight": (8,),
              "layers.0.1.bias": (8,), "layers.0.1.running_mean": (8,), "head.weight": (3, 8), "head.bias": (3,),
              "input_mean": (inputs,), "target_mean": (2,)}  # fmt: skip
    arrays = {name: rng.normal(size=shape).astype(np.float32) for name, shape in shapes.items()}
    for name, size in (("layers.0.1.running_var", 8), ("input_std", inputs), ("target_std", 2)):
        arrays[name] = np.full(size, 4.0, dtype=np.float32)
    header = NetworkHeader(inputs=inputs, hidden=hidden, dropout=0.0, input_frame="subgoal",
                           target_scaling="standardise", made_with=MADE_WITH)  # fmt: skip
    save_weights(path, SUBGOAL_NETWORK, header, arrays)
    return path
