"""What happens between steps of training, or strides of them: a look at validation, curves, checkpoints, a bar."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import torch
from lightning.pytorch import Callback, LightningModule, Trainer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from torch import Tensor

from pipeline.files import replacing
from pipeline.learning.batches import Stride
from pipeline.learning.curves import CurvePoint, read_curves, write_curves
from pipeline.learning.rows import Rows
from pipeline.learning.seeding import seed_step
from pipeline.learning.trainable import Strided, validate

LAST: Final = "last.ckpt"
BEST: Final = "best.ckpt"
CURVES: Final = "curves.parquet"
MARK: Final = "hinterland"


class Looks(Callback):
    """Counts the steps, validates before the first, then every ``every`` and after the last, and writes what it saw.

    The count is its own: Lightning's takes a stride of many steps for one. The best weights are written before the
    state to resume from, so that what the latter calls best is on disk.
    """

    def __init__(
        self,
        validation: Rows,
        folder: Path,
        *,
        first: int,
        steps: int,
        every: int,
        first_seed: int,
        rows_at_once: int,
        fingerprint: str,
    ) -> None:
        """Look at ``validation`` and write to ``folder``; ``fingerprint`` marks the checkpoints.

        first: steps done already. first_seed: the seed of step 0.
        """
        self.validation, self.folder, self.fingerprint = validation, folder, fingerprint
        self.step, self.steps, self.every = first, steps, every
        self.first_seed, self.rows_at_once = first_seed, rows_at_once
        self.best_loss, self.best_step = math.inf, -1
        self.points: list[CurvePoint] = []
        self._taken: dict[str, list[Tensor]] = {}  # the losses of each step since the last look

    def state_dict(self) -> dict[str, Any]:
        """Return what a resumed training must know."""
        return {"step": self.step, "best_loss": self.best_loss, "best_step": self.best_step}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Take up the state of :meth:`state_dict`."""
        self.step = int(state_dict["step"])
        self.best_loss, self.best_step = float(state_dict["best_loss"]), int(state_dict["best_step"])

    def on_save_checkpoint(self, trainer: Trainer, pl_module: LightningModule, checkpoint: dict[str, Any]) -> None:
        """Mark the checkpoint with the data and configuration it belongs to."""
        checkpoint[MARK] = {"fingerprint": self.fingerprint, "step": self.step, "best_loss": self.best_loss}

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Look before anything is learned, or take up the curves where they stopped.

        Raises ValueError for a schedule of the learning rate that would never be stepped.
        """
        _check_schedules(trainer)
        if self.step == 0:
            self._look(trainer, pl_module)
        else:
            self.points = read_curves(self.folder / CURVES, until=self.step)

    def on_train_batch_start(self, trainer: Trainer, pl_module: LightningModule, *_: Any) -> None:
        """Seed what the step draws; a stride seeds each of its own."""
        seed_step(self.first_seed + self.step, pl_module.device)

    def on_train_batch_end(
        self, trainer: Trainer, pl_module: LightningModule, outputs: Any, batch: Any, batch_idx: int
    ) -> None:
        """Count, keep the losses, look when it is time, and end after the last step."""
        self.step += len(batch.steps) if isinstance(batch, Stride) else 1
        self._keep(outputs)
        trainer.should_stop = self.step >= self.steps
        if self.step % self.every == 0 or self.step == self.steps:
            self._look(trainer, pl_module)

    def _keep(self, outputs: Mapping[str, Any]) -> None:
        for name, value in outputs.items():
            if isinstance(value, Tensor) and value.ndim <= 1:
                self._taken.setdefault(name, []).append(value.detach().reshape(-1))

    def _take_means(self) -> dict[str, float]:
        """Return the mean of each loss over the steps since the last look, and start anew."""
        means = {name: float(torch.cat(values).double().cpu().mean()) for name, values in self._taken.items()}
        self._taken = {}
        return means

    def _look(self, trainer: Trainer, pl_module: LightningModule) -> None:
        inside = pl_module.training_inside if isinstance(pl_module, Strided) else pl_module
        seen = {"validation": validate(inside, self.validation, self.rows_at_once)}
        if self.step > 0:
            seen["train"] = self._take_means()
        named = [(split, name, value) for split in seen for name, value in seen[split].items()]
        self.points += [CurvePoint(self.step, *each) for each in named]
        for logger in trainer.loggers:
            logger.log_metrics({f"{split}.{name}": value for split, name, value in named}, self.step)
        if seen["validation"]["loss"] < self.best_loss or self.best_step < 0:
            self.best_loss, self.best_step = seen["validation"]["loss"], self.step
            self._save(trainer, BEST)
        write_curves(self.folder / CURVES, self.points)
        self._save(trainer, LAST)

    def _save(self, trainer: Trainer, name: str) -> None:
        with replacing(self.folder / name, summed=True) as scratch:
            trainer.save_checkpoint(scratch)


def _check_schedules(trainer: Trainer) -> None:
    for schedule in trainer.lr_scheduler_configs:
        if schedule.interval != "step" or schedule.reduce_on_plateau:
            raise ValueError(
                f"{type(schedule.scheduler).__name__} waits for the end of an epoch or for a plateau, and a training "
                'has steps only: return {"scheduler": ..., "interval": "step"} from configure_optimizers.'
            )


class Bar(Callback):
    """A bar on stderr with steps per second and the latest validation loss."""

    def __init__(self, looks: Looks) -> None:
        """Show the steps that ``looks`` has counted, after it has, and the best loss that it has seen."""
        self.looks = looks
        columns = (
            TextColumn("train"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]}"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            TextColumn("best validation loss {task.fields[loss]}"),
        )
        self.progress = Progress(*columns, console=Console(stderr=True))
        self.task: TaskID | None = None
        self.first = 0

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Show the bar."""
        self.first = self.looks.step
        self.task = self.progress.add_task("", total=self.looks.steps, completed=self.first, rate="-/s", loss="-")
        self.progress.start()

    def on_train_batch_end(self, trainer: Trainer, *_: Any) -> None:
        """Move the bar."""
        step = self.looks.step
        if self.task is not None:
            elapsed = self.progress.tasks[self.task].elapsed or 0.0
            rate = f"{(step - self.first) / elapsed:.0f}/s" if elapsed > 0 else "-/s"
            self.progress.update(self.task, completed=step, rate=rate, loss=f"{self.looks.best_loss:.4f}")

    def on_train_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Leave the bar as it stands."""
        self.progress.stop()

    def on_exception(self, trainer: Trainer, pl_module: LightningModule, exception: BaseException) -> None:
        """Give the terminal back."""
        self.progress.stop()
