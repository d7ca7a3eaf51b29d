"""The learned estimator: the trained network in plain numpy, so that workers need no torch."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.errors import TableError
from pipeline.learning.calibration import Calibration
from pipeline.learning.weights import Arrays, NetworkHeader, load_weights
from pipeline.planning.protocols import Estimates
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings
from pipeline.systems.subgoals.inputs import InputFrame, subgoal_inputs
from pipeline.systems.subgoals.map_inputs import INPUTS_OF, map_inputs
from pipeline.systems.subgoals.map_view import view_map
from pipeline.systems.subgoals.observation import observe

_CERTAIN = 1e-6  # how close P_S comes to 0 and 1: a planner may divide by either, and no network knows better


class _Layer(NamedTuple):
    weight: NDArray[np.float32]  # [fan_in, fan_out]
    bias: NDArray[np.float32]  # [fan_out]


class LearnedEstimator:
    """Estimates subgoals with a trained network; holds no state between calls.

    Scaling of inputs, batch norm and calibration are folded into the linear layers, so that one estimate is five
    small products. P_S lies inside (0, 1); no cost is below 0, since no way is shorter than the optimistic one.
    """

    def __init__(self, header: NetworkHeader, arrays: Arrays) -> None:
        """Fold the network that ``header`` and ``arrays`` describe."""
        self.header = header
        self._frame: InputFrame = "robot" if header.input_frame == "robot" else "subgoal"
        self._from_map = header.input_frame == "map"
        self._hidden = _fold_hidden(header, arrays)
        self._head = _fold_head(arrays, header.calibration)
        self._log_targets = header.target_scaling == "log"

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the estimator whose weights are at ``path``.

        Raises TableError naming the file when it is missing, damaged, of another version or for other inputs.
        """
        header, arrays = load_weights(path)
        if header.inputs != INPUTS_OF.get(header.input_frame):
            raise TableError(
                f"{path} takes {header.inputs} inputs of the kind {header.input_frame!r}, this code builds "
                f"{', '.join(f'{count} of the kind {kind}' for kind, count in INPUTS_OF.items())}: "
                "run `dvc repro train`."
            )
        return cls(header, arrays)

    @property
    def lasting(self) -> bool:
        """Whether estimates are made from a scan, and so hold until the frontier is scanned again."""
        return not self._from_map

    def estimate(self, seen: Seen, around: Surroundings, subgoals: Sequence[Subgoal]) -> Estimates:
        """Return the estimates of ``subgoals``, in their order, from this step's scan or map."""
        if self._from_map:
            return self._run(map_inputs(np.round(view_map(seen, around, subgoals), 3)))
        observed = observe(seen, subgoals)
        return self.estimate_scan(observed.ranges, observed.goal, observed.subgoals)

    def estimate_scan(self, ranges: NDArray[np.floating], goal_xy: ArrayLike, subgoal_xy: ArrayLike) -> Estimates:
        """Return the estimates of N subgoals seen in one scan.

        ranges: [256] m. goal_xy: [2], subgoal_xy: [N, 2] m, all in the robot frame (x ahead, y left).
        """
        return self._run(subgoal_inputs(ranges, goal_xy, subgoal_xy, frame=self._frame))

    def _run(self, hidden: NDArray[np.float32]) -> Estimates:
        for weight, bias in self._hidden:  # biases and weights are halved: sigmoid(x) = (1 + tanh(x / 2)) / 2
            hidden = np.tanh(hidden @ weight + bias)
        raw = (hidden @ self._head.weight + self._head.bias).astype(np.float64)
        p = 0.5 * (1.0 + np.tanh(0.5 * raw[:, 0]))
        costs = np.maximum(np.expm1(raw[:, 1:]) if self._log_targets else raw[:, 1:], 0.0)
        return Estimates(np.clip(p, _CERTAIN, 1.0 - _CERTAIN), costs[:, 0], costs[:, 1])


def _fold_hidden(header: NetworkHeader, arrays: Arrays) -> list[_Layer]:
    """Return the hidden layers with everything affine folded in; each is to be followed by tanh.

    With t = tanh(x / 2), sigmoid(x) = (1 + t) / 2: the factor 1/2 and the shift go into the next layer.
    """
    wide = {name: array.astype(np.float64) for name, array in arrays.items()}
    scale = 1.0 / wide["input_std"]
    shift = -wide["input_mean"] * scale
    layers: list[_Layer] = []
    for index, _ in enumerate(pairwise((header.inputs, *header.hidden))):
        norm = {part: wide[f"layers.{index}.1.{part}"] for part in ("weight", "bias", "running_mean", "running_var")}
        gain = norm["weight"] / np.sqrt(norm["running_var"] + 1e-5)  # torch's default eps
        weight = wide[f"layers.{index}.0.weight"]
        bias = (weight @ shift + wide[f"layers.{index}.0.bias"] - norm["running_mean"]) * gain + norm["bias"]
        folded = 0.5 * (weight * scale * gain[:, None]).T
        layers.append(_Layer(np.ascontiguousarray(folded, np.float32), (0.5 * bias).astype(np.float32)))
        scale, shift = np.full(len(bias), 0.5), np.full(len(bias), 0.5)
    return layers


def _fold_head(arrays: Arrays, calibration: Calibration) -> _Layer:
    """Return the head with the calibration of the logit and the scaling of the targets folded in."""
    weight, bias = arrays["head.weight"].astype(np.float64), arrays["head.bias"].astype(np.float64)
    bias = bias + 0.5 * weight.sum(axis=1)
    gain = np.array([calibration.slope, *arrays["target_std"].astype(np.float64)])
    offset = np.array([calibration.offset, *arrays["target_mean"].astype(np.float64)])
    folded = 0.5 * (weight * gain[:, None]).T
    return _Layer(np.ascontiguousarray(folded, np.float32), (bias * gain + offset).astype(np.float32))
