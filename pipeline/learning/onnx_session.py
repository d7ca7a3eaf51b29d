"""Any exported network in a session of onnxruntime, on one thread of a CPU: the extra `onnx`."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import TableError
from pipeline.files import check_sum


class OnnxSession:
    """A network of one input and one output whose first axes are the rows: an `Inference`.

    path, input_shape, input_type: of what it takes, for whoever checks what it hands over; the rows are None.
    """

    def __init__(self, path: Path) -> None:
        """Load the network at ``path``.

        Raises:
            TableError: the file is missing, damaged or no such network, or onnxruntime is not installed.
        """
        try:
            import onnxruntime as ort
        except ImportError as error:
            raise TableError(f"{path} needs onnxruntime ({error}): pip install 'hinterland[onnx]'.") from error
        if not path.is_file():
            raise TableError(f"{path} does not exist: run the train stage first.")
        check_sum(path, "Run `dvc repro -f train`: with its checkpoints whole, it writes the same network at once.")
        options = ort.SessionOptions()
        # Workers fill the cores: more threads in each would wait for one another, and order their sums by chance.
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.execution_mode = ort.ExecutionMode.ORT_SEQUENTIAL
        options.log_severity_level = 3
        try:
            self._session = ort.InferenceSession(path, options, providers=["CPUExecutionProvider"])
        except Exception as error:  # onnxruntime raises a class of its own for each way to be wrong
            raise TableError(f"{path} is no network that onnxruntime runs ({error}): run the train stage.") from error
        inputs, outputs = self._session.get_inputs(), self._session.get_outputs()
        if len(inputs) != 1 or len(outputs) != 1:
            raise TableError(f"{path} has {len(inputs)} inputs and {len(outputs)} outputs: expected one of each.")
        self.path = path
        self.input_shape = (None, *inputs[0].shape[1:])
        self._name = inputs[0].name
        self.input_type = np.dtype(_TYPES.get(inputs[0].type, np.float32))

    def run(self, inputs: NDArray[Any]) -> NDArray[np.float32]:
        """Return the outputs [n, ...] for ``inputs`` [n, ...].

        Raises:
            TableError: the inputs are of another shape.
        """
        if inputs.shape[1:] != self.input_shape[1:]:
            rest = ", ".join(map(str, self.input_shape[1:]))
            raise TableError(f"{self.path} takes inputs of shape [n, {rest}], got {inputs.shape}.")
        outputs: NDArray[np.float32]
        (outputs,) = self._session.run(None, {self._name: np.ascontiguousarray(inputs, self.input_type)})
        return outputs


_TYPES = {"tensor(float)": np.float32, "tensor(uint8)": np.uint8, "tensor(int64)": np.int64, "tensor(bool)": np.bool_}
