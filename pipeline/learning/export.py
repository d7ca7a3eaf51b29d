"""A trained network as ONNX, which runs without torch: see pipeline.learning.onnx_session."""

import warnings
from pathlib import Path

import torch
from torch import Tensor, nn

from pipeline.errors import TableError
from pipeline.files import replacing

_ROWS = 2  # of the example: 0 and 1 rows are cases of their own to the exporter


def export_onnx(module: nn.Module, example: Tensor, path: Path) -> None:
    """Write ``module`` in evaluation mode to ``path``, atomically, for any number of rows; it keeps its mode.

    example: rows of the one input [n, ...], n > 0; their values do not matter.

    Raises:
        TableError: the extra `onnx` is not installed, or the module does what ONNX has no words for.
    """
    rows = example[:1].repeat(_ROWS, *[1] * (example.ndim - 1)).cpu()
    was_training = module.training
    try:
        with warnings.catch_warnings(), torch.no_grad():
            warnings.simplefilter("ignore")  # torch's own deprecations
            program = torch.onnx.export(
                module.eval(), (rows,), dynamo=True, dynamic_shapes=({0: torch.export.Dim("rows")},), verbose=False
            )
    except ModuleNotFoundError as error:
        raise TableError(f"{path} needs torch's exporter ({error}): pip install 'hinterland[onnx]'.") from error
    except torch.onnx.errors.OnnxExporterError as error:
        raise TableError(f"{path}: {type(module).__name__} cannot be written as ONNX ({error}).") from error
    finally:
        module.train(was_training)
    assert program is not None
    with replacing(path, summed=True) as scratch:
        program.save(scratch, external_data=False)
