"""The learned estimator: the trained network without torch, so that workers start soon and stay small."""

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.errors import TableError
from pipeline.learning.dense import DenseNetwork
from pipeline.learning.inference import Inference
from pipeline.learning.weights import Arrays, load_weights
from pipeline.planning.protocols import Estimates
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings
from pipeline.systems.subgoals.inputs import INPUT_FRAMES, PLACES, InputFrame, subgoal_inputs
from pipeline.systems.subgoals.map_inputs import MAP_INPUTS, map_inputs
from pipeline.systems.subgoals.map_view import MapViews
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK, NetworkHeader
from pipeline.systems.subgoals.observation import observe

_CERTAIN = 1e-6  # how close P_S comes to 0 and 1: a planner may divide by either, and no network knows better


class LearnedEstimator:
    """Estimates subgoals with a trained network. One instance may serve trials one after another.

    Scaling of inputs, batch norm and calibration are folded into the linear layers, so that one estimate is five
    small products. A subgoal's estimate is the same bits alone and among others. P_S lies inside (0, 1); no cost is
    below 0, since no way is shorter than the optimistic one.
    """

    def __init__(self, header: NetworkHeader, arrays: Arrays) -> None:
        """Fold the network that ``header`` and ``arrays`` describe."""
        self.header = header
        self._frame: InputFrame = "robot" if header.input_frame == "robot" else "subgoal"
        self._from_map = header.input_frame == "map"
        self._views: MapViews | None = None
        self._network: Inference = _fold(header, arrays)
        self._log_targets = header.target_scaling == "log"

    @classmethod
    def load(cls, path: Path, *, input_beams: int | None = None) -> Self:
        """Return the estimator whose weights are at ``path``.

        input_beams: how many ranges the sensor will hand over, where that is known already.
        Raises TableError naming the file when it is missing, damaged, of another version or for other inputs.
        """
        header, arrays = load_weights(path, SUBGOAL_NETWORK)
        known = header.input_frame in (*INPUT_FRAMES, "map")
        if not known or (header.inputs != MAP_INPUTS if header.input_frame == "map" else header.inputs <= PLACES):
            raise TableError(
                f"{path} takes {header.inputs} inputs of the kind {header.input_frame!r}, this code builds "
                f"{MAP_INPUTS} of the kind map and, of the kinds {' and '.join(INPUT_FRAMES)}, {PLACES} more than a "
                "scan has ranges: run `dvc repro train`."
            )
        found = cls(header, arrays)
        if input_beams is not None and found.beams not in (None, input_beams):
            raise TableError(
                f"{path} takes scans of {found.beams} ranges, sensor.input_beams = {input_beams}: set it to "
                f"{found.beams}, or harvest and train again."
            )
        return found

    @property
    def beams(self) -> int | None:
        """How many ranges a scan must have; None where the network reads the map instead."""
        return None if self._from_map else self.header.inputs - PLACES

    @property
    def lasting(self) -> bool:
        """Whether estimates are made from a scan, and so hold until the frontier is scanned again."""
        return not self._from_map

    def estimate(self, seen: Seen, around: Surroundings, subgoals: Sequence[Subgoal]) -> Estimates:
        """Return the estimates of ``subgoals``, in their order, from this step's scan or map."""
        if self._from_map:
            if self._views is None or not self._views.are_of(around):
                self._views = MapViews(seen, around)
            return self._run(map_inputs(np.round(self._views.views(seen, subgoals), 3)))
        observed = observe(seen, subgoals)
        return self.estimate_scan(observed.ranges, observed.goal, observed.subgoals)

    def estimate_scan(self, ranges: NDArray[np.floating], goal_xy: ArrayLike, subgoal_xy: ArrayLike) -> Estimates:
        """Return the estimates of N subgoals seen in one scan.

        ranges: [beams] m. goal_xy: [2], subgoal_xy: [N, 2] m, all in the robot frame (x ahead, y left).
        Raises TableError when the network reads the map, or scans of another number of ranges.
        """
        if self._from_map:
            raise TableError(
                "The weights are for the robot's whole map (train.input_frame = map), and no estimate can be made from "
                "one scan: call `estimate` with the map, or use weights of train.input_frame = subgoal or robot."
            )
        if np.shape(ranges) != (self.beams,):
            raise TableError(
                f"The weights are for one scan of {self.beams} ranges, got ranges of shape {np.shape(ranges)}: set "
                f"sensor.input_beams = {self.beams}, or harvest and train again."
            )
        return self._run(subgoal_inputs(ranges, goal_xy, subgoal_xy, frame=self._frame))

    def _run(self, inputs: NDArray[np.float32]) -> Estimates:
        raw = self._network.run(inputs).astype(np.float64)
        p = 0.5 * (1.0 + np.tanh(0.5 * raw[:, 0]))  # the sigmoid, without overflow
        costs = np.maximum(np.expm1(raw[:, 1:]) if self._log_targets else raw[:, 1:], 0.0)
        return Estimates(np.clip(p, _CERTAIN, 1.0 - _CERTAIN), costs[:, 0], costs[:, 1])


def load_estimator(network: Path, input_beams: int) -> LearnedEstimator:
    """Return the estimator of the weights at ``network``. Raises TableError as `LearnedEstimator.load`."""
    return LearnedEstimator.load(network, input_beams=input_beams)


def _fold(header: NetworkHeader, arrays: Arrays) -> DenseNetwork:
    """Return the network with everything affine folded into its layers: scalings, batch norms, calibration."""
    wide = {name: array.astype(np.float64) for name, array in arrays.items()}
    scale = 1.0 / wide["input_std"]
    shift = -wide["input_mean"] * scale
    layers = []
    for index, _ in enumerate(header.hidden):
        norm = {part: wide[f"layers.{index}.1.{part}"] for part in ("weight", "bias", "running_mean", "running_var")}
        gain = norm["weight"] / np.sqrt(norm["running_var"] + 1e-5)  # torch's default eps
        weight = wide[f"layers.{index}.0.weight"]
        bias = (weight @ shift + wide[f"layers.{index}.0.bias"] - norm["running_mean"]) * gain + norm["bias"]
        layers.append((weight * scale * gain[:, None], bias))
        scale, shift = np.ones(len(bias)), np.zeros(len(bias))
    gain = np.array([header.calibration.slope, *wide["target_std"]])
    offset = np.array([header.calibration.offset, *wide["target_mean"]])
    return DenseNetwork([*layers, (wide["head.weight"] * gain[:, None], wide["head.bias"] * gain + offset)])
