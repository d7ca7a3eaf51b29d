"""Networks that were never trained: whatever they say, a planner must live with it."""

import numpy as np
import torch

from models.subgoals import SubgoalNet
from pipeline.learning.weights import NetworkHeader
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.map_inputs import MAP_INPUTS


def untrained(frame: str, *, beams: int = 256, seed: int = 0, boldness: float = 30.0) -> LearnedEstimator:
    """Return an estimator with random weights; ``boldness`` scales its head, so that it is sure of much."""
    torch.manual_seed(seed)
    inputs = MAP_INPUTS if frame == "map" else beams + 4
    net = SubgoalNet(inputs=inputs, hidden=(16, 8))
    with torch.no_grad():
        net.input_std.fill_(5.0)
        net.head.weight.mul_(boldness)
    header = NetworkHeader(inputs=inputs, hidden=(16, 8), dropout=0.0, input_frame=frame, target_scaling="standardise")
    state = net.state_dict()
    return LearnedEstimator(
        header, {name: state[name].numpy().astype(np.float32) for name in state if "num_" not in name}
    )
