"""How a planner asks a trained network, whatever runs it: numbers in, numbers out, on one thread."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray


class Inference(Protocol):
    """A trained network that needs no torch: a dense one in one kernel, or any in a session of onnxruntime."""

    def run(self, inputs: NDArray[Any]) -> NDArray[np.float32]:
        """Return the outputs [n, ...] for ``inputs`` [n, ...]."""
        ...
