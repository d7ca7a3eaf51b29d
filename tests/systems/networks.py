"""Networks that were never trained: whatever they say, a planner must live with it."""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from models.subgoals import SubgoalNet
from pipeline.learning.weights import save_weights
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.map_inputs import MAP_INPUTS
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK, NetworkHeader


def untrained(frame: str, *, beams: int = 256, seed: int = 0, boldness: float = 30.0) -> LearnedEstimator:
    """Return an estimator with random weights; ``boldness`` scales its head, so that it is sure of much."""
    return LearnedEstimator(*_weights(frame, beams, seed, boldness, {}))


def some_network(path: Path, made_with: dict[str, Any]) -> Path:
    """Write weights of one that reads the map, which say that they were made with these settings; return ``path``."""
    save_weights(path, SUBGOAL_NETWORK, *_weights("map", 256, 0, 30.0, made_with))
    return path


def _weights(
    frame: str, beams: int, seed: int, boldness: float, made_with: dict[str, Any]
) -> tuple[NetworkHeader, dict[str, NDArray[np.float32]]]:
    torch.manual_seed(seed)
    inputs = MAP_INPUTS if frame == "map" else beams + 4
    net = SubgoalNet(inputs=inputs, hidden=(16, 8))
    with torch.no_grad():
        net.input_std.fill_(5.0)
        net.head.weight.mul_(boldness)
    header = NetworkHeader(
        inputs=inputs, hidden=(16, 8), dropout=0.0, input_frame=frame, target_scaling="standardise", made_with=made_with
    )
    state = net.state_dict()
    return header, {name: state[name].numpy().astype(np.float32) for name in state if "num_" not in name}


def subgoal_network() -> LearnedEstimator:
    """Return one that reads scans in the subgoal's frame: a part by its place."""
    return untrained("subgoal")


def map_network() -> LearnedEstimator:
    """Return one that reads the map: a part by its place."""
    return untrained("map")
