"""What the recipe asks of a LightningModule, and how one steps through many small batches at once."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Protocol, runtime_checkable

import torch
from lightning.pytorch import LightningModule
from torch import Tensor, nn

from pipeline.learning.batches import Stride
from pipeline.learning.rows import Block, Rows
from pipeline.learning.seeding import seed_step


@runtime_checkable
class Trainable(Protocol):
    """A LightningModule with automatic optimisation that also says its losses.

    Beside Lightning's own ``configure_optimizers`` (one optimizer; schedules by the step, since there are no epochs)
    and ``training_step``, which is ``return self.losses(batch)`` unless there is a reason:

    - ``losses(batch)``: by name tensors [B, ...] -> by name scalars, each a mean over the rows; ``loss`` is minimised.
      They are what the curves show.
    - ``validate(blocks)``, where the mean over rows is not enough: all validation rows in blocks, on the module's
      device, in evaluation mode and without gradients -> numbers by name, ``loss`` among them. Less is better.

    What a step draws at random is seeded by the step, so that a resumed training draws the same. A module that counts
    steps keeps its count in a buffer, which the checkpoint holds.
    """

    def losses(self, batch: Block) -> Mapping[str, Tensor]:
        """Return the losses of ``batch`` by name."""
        ...

    def configure_optimizers(self) -> Any:
        """Return the optimizer and its schedules, as Lightning asks for them."""
        ...


@runtime_checkable
class _ValidatesItself(Protocol):
    def validate(self, blocks: Iterable[Block]) -> Mapping[str, float]: ...


def validate(training: nn.Module, rows: Rows, rows_at_once: int) -> dict[str, float]:
    """Return what ``training`` says of all ``rows``: by its own ``validate``, or each of its losses averaged over rows.

    The blocks are of ``rows_at_once``; the module ends in the mode it was in.
    """
    with evaluating(training) as device:
        blocks = ({name: part.to(device) for name, part in block.items()} for block in rows.blocks(rows_at_once))
        if isinstance(training, _ValidatesItself):
            return {name: float(value) for name, value in training.validate(blocks).items()}
        assert isinstance(training, Trainable)
        sums: dict[str, float] = {}
        for block in blocks:
            count = len(next(iter(block.values())))
            for name, value in training.losses(block).items():
                sums[name] = sums.get(name, 0.0) + float(value) * count
        return {name: total / rows.count for name, total in sums.items()}


@contextmanager
def evaluating(module: nn.Module) -> Iterator[torch.device]:
    """Put ``module`` into evaluation mode, without gradients, and say where it is; it ends in the mode it was in."""
    was_training = module.training
    module.eval()
    try:
        with torch.no_grad():
            yield next(module.parameters()).device
    finally:
        module.train(was_training)


class Strided(LightningModule):
    """Takes the steps of a whole stride in one call, where Lightning's loop around a step costs as much as the step.

    A plain loop of torch (Lightning's manual optimisation) over the losses of the module inside, to the bit what
    automatic optimisation does with it; its other hooks are not called. Checkpoints hold the module inside.
    """

    def __init__(self, training: LightningModule) -> None:
        """Train ``training``."""
        super().__init__()
        self.automatic_optimization = False
        self.training_inside = training

    def training_step(self, stride: Stride, _: int) -> dict[str, Tensor]:
        """Take one optimizer step with each batch of ``stride``; return each loss of every step [S]."""
        inside, optimizer = self.training_inside, self.optimizers(use_pl_optimizer=False)
        assert isinstance(inside, Trainable)
        if not isinstance(optimizer, torch.optim.Optimizer):
            raise ValueError("A training in strides has one optimizer: set stride = 1, or return one.")
        schedules = self.trainer.lr_scheduler_configs
        taken: list[Mapping[str, Tensor]] = []
        for step, (seed, batch) in zip(stride.steps, stride, strict=True):
            seed_step(seed, self.device)
            losses = inside.losses(batch)
            optimizer.zero_grad()
            torch.autograd.backward(losses["loss"])
            optimizer.step()
            for schedule in schedules:
                if (step + 1) % schedule.frequency == 0:
                    schedule.scheduler.step()  # type: ignore[call-arg]  # one on a plateau is refused before
            taken.append(losses)
        return {name: torch.stack([losses[name].detach() for losses in taken]) for name in taken[0]}

    def configure_optimizers(self) -> Any:
        """Return those of the module inside."""
        return self.training_inside.configure_optimizers()

    def state_dict(self, *args: Any, **kwargs: Any) -> dict[str, Any]:  # type: ignore[override]  # torch's overloads
        """Return the state of the module inside, so that its checkpoints are those of a training without strides."""
        return dict(self.training_inside.state_dict(*args, **kwargs))

    def load_state_dict(self, state_dict: Mapping[str, Any], strict: bool = True, assign: bool = False) -> Any:
        """Take up the state of the module inside."""
        return self.training_inside.load_state_dict(state_dict, strict=strict, assign=assign)
