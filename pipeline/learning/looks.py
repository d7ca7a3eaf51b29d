"""What happens between strides of training steps: a look at validation, curves, checkpoints, a bar."""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

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

from models.subgoals import SubgoalTraining
from pipeline.files import replacing
from pipeline.learning.curves import CurvePoint, read_curves, write_curves
from pipeline.learning.examples import Examples
from pipeline.learning.prediction import validate

LAST: Final = "last.ckpt"
BEST: Final = "best.ckpt"
CURVES: Final = "curves.parquet"
MARK: Final = "hinterland"


_NAMES: Final = ("loss", "weighted_cross_entropy", "delta_success_error", "exploration_error")  # of Losses, for readers


def _named(losses: Iterable[float]) -> dict[str, float]:
    return dict(zip(_NAMES, losses, strict=True))


class Looks(Callback):
    """Validates before the first step, then every ``every`` steps and after the last, and writes what it saw.

    The best weights are written before the state to resume from, so that what the latter calls best is on disk.
    """

    def __init__(self, validation: Examples, folder: Path, *, every: int, steps: int, fingerprint: str) -> None:
        """Look at ``validation`` and write to ``folder``; ``fingerprint`` marks the checkpoints."""
        self.validation, self.folder, self.fingerprint = validation, folder, fingerprint
        self.every, self.steps = every, steps
        self.best_loss, self.best_step = math.inf, -1
        self.points: list[CurvePoint] = []

    def state_dict(self) -> dict[str, Any]:
        """Return what a resumed training must know."""
        return {"best_loss": self.best_loss, "best_step": self.best_step}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Take up the state of :meth:`state_dict`."""
        self.best_loss, self.best_step = float(state_dict["best_loss"]), int(state_dict["best_step"])

    def on_save_checkpoint(self, trainer: Trainer, pl_module: LightningModule, checkpoint: dict[str, Any]) -> None:
        """Mark the checkpoint with the data and configuration it belongs to."""
        checkpoint[MARK] = {"fingerprint": self.fingerprint, "step": trainer.global_step}

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Look before anything is learned, or take up the curves where they stopped."""
        if trainer.global_step == 0:
            self._look(trainer, pl_module)
        else:
            self.points = read_curves(self.folder / CURVES, until=trainer.global_step)

    def on_train_batch_end(self, trainer: Trainer, pl_module: LightningModule, *_: Any) -> None:
        """Look when it is time."""
        step = trainer.global_step
        if step % self.every == 0 or step == self.steps:
            self._look(trainer, pl_module)

    def _look(self, trainer: Trainer, pl_module: LightningModule) -> None:
        assert isinstance(pl_module, SubgoalTraining)
        step = trainer.global_step
        seen = {"validation": _named(map(float, validate(pl_module, self.validation)))}
        if step > 0:
            seen["train"] = _named(pl_module.take_mean_losses())
        self.points += [CurvePoint(step, split, name, value) for split in seen for name, value in seen[split].items()]
        for logger in trainer.loggers:
            logger.log_metrics(
                {f"{split}.{name}": value for split in seen for name, value in seen[split].items()}, step
            )
        if seen["validation"]["loss"] < self.best_loss or self.best_step < 0:
            self.best_loss, self.best_step = seen["validation"]["loss"], step
            self._save(trainer, BEST)
        write_curves(self.folder / CURVES, self.points)
        self._save(trainer, LAST)

    def _save(self, trainer: Trainer, name: str) -> None:
        with replacing(self.folder / name, summed=True) as scratch:
            trainer.save_checkpoint(scratch)


class Bar(Callback):
    """A bar on stderr with steps per second and the latest validation loss."""

    def __init__(self, looks: Looks) -> None:
        """Show the best loss that ``looks`` has seen."""
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
        self.first = trainer.global_step
        self.task = self.progress.add_task("", total=self.looks.steps, completed=self.first, rate="-/s", loss="-")
        self.progress.start()

    def on_train_batch_end(self, trainer: Trainer, *_: Any) -> None:
        """Move the bar."""
        step = trainer.global_step
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
