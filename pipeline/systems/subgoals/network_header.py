"""The weights file of the subgoal network: what its header says, and which arrays it holds."""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

from pipeline.learning.platt import PlattScaling
from pipeline.learning.weights import Shapes, WeightsHeader, WeightsKind


@dataclass(frozen=True, kw_only=True)
class NetworkHeader(WeightsHeader):
    """What one must know to use the weights: architecture, meaning of inputs and outputs, origin."""

    inputs: int
    hidden: tuple[int, ...]
    dropout: float
    input_frame: str
    """Which canonical frame the inputs are built in; see pipeline.systems.subgoals.inputs."""
    target_scaling: str
    """"standardise" or "log"; mean and spread are among the arrays."""
    calibration: PlattScaling = field(default_factory=PlattScaling)
    """What makes P_S of the logit."""


def shapes_of(header: NetworkHeader) -> Shapes:
    """Return the shapes of the arrays of a network, by their names in it."""
    widths = (header.inputs, *header.hidden)
    shapes: dict[str, tuple[int, ...]] = {f"input_{part}": (header.inputs,) for part in ("mean", "std")}
    shapes |= {f"target_{part}": (2,) for part in ("mean", "std")}
    shapes |= {"head.weight": (3, widths[-1]), "head.bias": (3,)}
    for index, (fan_in, fan_out) in enumerate(pairwise(widths)):
        shapes |= {f"layers.{index}.0.weight": (fan_out, fan_in), f"layers.{index}.0.bias": (fan_out,)}
        parts = ("weight", "bias", "running_mean", "running_var")
        shapes |= {f"layers.{index}.1.{part}": (fan_out,) for part in parts}
    return shapes


SUBGOAL_NETWORK: Final = WeightsKind(name="subgoal_network", version=1, header=NetworkHeader, shapes=shapes_of)
