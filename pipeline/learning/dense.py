"""A network of dense layers in one kernel, for nets so small that any library's call costs more than the products."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray


class DenseNetwork:
    """Dense layers with a sigmoid after each but the last: an `Inference`.

    An output is the same bits alone and among others.
    """

    def __init__(self, layers: Sequence[tuple[NDArray[Any], NDArray[Any]]]) -> None:
        """Take the ``layers``, each a matrix [fan out, fan in] and biases [fan out], as torch has them."""
        self.widths = np.array([layers[0][0].shape[1], *(len(bias) for _, bias in layers)], dtype=np.int64)
        parts = [part for matrix, bias in layers for part in (matrix.T.ravel(), bias)]
        self._weights: NDArray[np.float32] = np.concatenate(parts).astype(np.float32)

    def run(self, inputs: NDArray[Any]) -> NDArray[np.float32]:
        """Return the outputs [n, fan out of the last] for ``inputs`` [n, fan in of the first].

        Raises:
            ValueError: the inputs are of another width.
        """
        if inputs.ndim != 2 or inputs.shape[1] != self.widths[0]:
            raise ValueError(f"got inputs of shape {inputs.shape}, expected [n, {self.widths[0]}]")
        outputs: NDArray[np.float32] = _forward(np.ascontiguousarray(inputs, np.float32), self._weights, self.widths)
        return outputs


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
