"""The learned estimator: the trained network without torch, so that workers start soon and stay small."""

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from pipeline.errors import TableError
from pipeline.learning.weights import Arrays, NetworkHeader, load_weights
from pipeline.planning.protocols import Estimates
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings
from pipeline.systems.subgoals.inputs import INPUT_FRAMES, PLACES, InputFrame, subgoal_inputs
from pipeline.systems.subgoals.map_inputs import MAP_INPUTS, map_inputs
from pipeline.systems.subgoals.map_view import MapViews
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
        self._widths = np.array([header.inputs, *header.hidden, 3], dtype=np.int64)
        self._weights = _fold(header, arrays)
        self._log_targets = header.target_scaling == "log"

    @classmethod
    def load(cls, path: Path, *, input_beams: int | None = None) -> Self:
        """Return the estimator whose weights are at ``path``.

        input_beams: how many ranges the sensor will hand over, where that is known already.
        Raises TableError naming the file when it is missing, damaged, of another version or for other inputs.
        """
        header, arrays = load_weights(path)
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
        raw = _forward(np.ascontiguousarray(inputs), self._weights, self._widths).astype(np.float64)
        p = 0.5 * (1.0 + np.tanh(0.5 * raw[:, 0]))  # the sigmoid, without overflow
        costs = np.maximum(np.expm1(raw[:, 1:]) if self._log_targets else raw[:, 1:], 0.0)
        return Estimates(np.clip(p, _CERTAIN, 1.0 - _CERTAIN), costs[:, 0], costs[:, 1])


@njit(cache=True, nogil=True)
def _forward(
    inputs: NDArray[np.float32], weights: NDArray[np.float32], widths: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return the outputs [n, widths[-1]] for ``inputs`` [n, widths[0]]; a sigmoid follows each layer but the last.

    weights: of each layer the matrix [fan in, fan out], row by row, then the biases. The sums have a fixed order: a
    library of linear algebra orders them by the number of rows, and starts threads for a matter of microseconds.
    """
    here, at = inputs, 0
    for layer in range(widths.size - 1):
        fan_in, fan_out = widths[layer], widths[layer + 1]
        matrix = weights[at : at + fan_in * fan_out].reshape(fan_in, fan_out)
        at += fan_in * fan_out
        there = np.empty((inputs.shape[0], fan_out), dtype=np.float32)
        for row in range(inputs.shape[0]):
            _add_products(here[row], matrix, weights[at : at + fan_out], there[row])
            if layer < widths.size - 2:
                for unit in range(fan_out):
                    there[row, unit] = np.float32(1.0) / (np.float32(1.0) + np.exp(-there[row, unit]))
        at += fan_out
        here = there
    return here


@njit(cache=True, nogil=True)
def _add_products(
    values: NDArray[np.float32], matrix: NDArray[np.float32], bias: NDArray[np.float32], sums: NDArray[np.float32]
) -> None:
    """Write ``values @ matrix + bias`` into ``sums``: four rows of the matrix at a time, to store a sum less often."""
    for unit in range(sums.size):  # not sums[:] = bias, whose checks take seconds to compile
        sums[unit] = bias[unit]
    whole = values.size // 4 * 4
    for k in range(0, whole, 4):
        one, two, three, four = values[k], values[k + 1], values[k + 2], values[k + 3]
        for unit in range(sums.size):
            so_far = sums[unit] + one * matrix[k, unit]
            so_far += two * matrix[k + 1, unit]
            so_far += three * matrix[k + 2, unit]
            sums[unit] = so_far + four * matrix[k + 3, unit]
    for k in range(whole, values.size):
        for unit in range(sums.size):
            sums[unit] += values[k] * matrix[k, unit]


def _fold(header: NetworkHeader, arrays: Arrays) -> NDArray[np.float32]:
    """Return the weights for ``_forward``, with everything affine folded in: scalings, batch norms, calibration."""
    wide = {name: array.astype(np.float64) for name, array in arrays.items()}
    scale = 1.0 / wide["input_std"]
    shift = -wide["input_mean"] * scale
    parts = []
    for index, _ in enumerate(header.hidden):
        norm = {part: wide[f"layers.{index}.1.{part}"] for part in ("weight", "bias", "running_mean", "running_var")}
        gain = norm["weight"] / np.sqrt(norm["running_var"] + 1e-5)  # torch's default eps
        weight = wide[f"layers.{index}.0.weight"]
        bias = (weight @ shift + wide[f"layers.{index}.0.bias"] - norm["running_mean"]) * gain + norm["bias"]
        parts += [(weight * scale * gain[:, None]).T.ravel(), bias]
        scale, shift = np.ones(len(bias)), np.zeros(len(bias))
    gain = np.array([header.calibration.slope, *wide["target_std"]])
    offset = np.array([header.calibration.offset, *wide["target_mean"]])
    parts += [(wide["head.weight"] * gain[:, None]).T.ravel(), wide["head.bias"] * gain + offset]
    return np.concatenate(parts).astype(np.float32)
