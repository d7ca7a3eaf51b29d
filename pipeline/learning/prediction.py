"""What a network says about many rows, in evaluation mode, block by block."""

from collections.abc import Iterator
from typing import Final

import torch
from torch import Tensor, nn

from pipeline.learning.rows import Rows
from pipeline.learning.scratch import row_blocks
from pipeline.learning.trainable import evaluating

_ROWS_AT_ONCE: Final = 65536  # of outputs


def predictions(
    network: nn.Module, rows: Rows, *, name: str = "inputs", inputs_at_once: int = 1024
) -> Iterator[tuple[slice, Tensor]]:
    """Yield which rows and what ``network`` says of their tensor ``name``, [n, ...] on the CPU, in order.

    inputs_at_once: rows whose inner values are in memory. The network ends in the mode it was in.
    """
    for block in row_blocks(rows.count, _ROWS_AT_ONCE):
        with evaluating(network) as device:
            parts = [network(inputs.to(device)).cpu() for inputs in torch.split(rows[name][block], inputs_at_once)]
        yield block, torch.cat(parts)
