"""Train any network; killed at any point, the same call goes on and ends with the same weights."""

import contextlib
import hashlib
import json
import logging
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

import torch
from lightning.pytorch import Callback, LightningModule, Trainer
from lightning.pytorch.loggers import Logger

from pipeline.errors import TableError
from pipeline.files import damage, remove_partials
from pipeline.learning.batches import Batches
from pipeline.learning.looks import BEST, CURVES, LAST, MARK, Bar, Looks
from pipeline.learning.rows import Rows
from pipeline.learning.seeding import first_step_seed
from pipeline.learning.trainable import Strided, Trainable

_LOG = logging.getLogger(__name__)

Module = TypeVar("Module", bound=LightningModule)


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """How a network is trained, whatever it is."""

    steps: int
    batch_size: int
    validate_every: int
    """Steps between two looks at validation, each of which leaves a state to resume from."""
    seed: int
    """Of the order of the rows and of what steps draw at random."""
    stride: int = 1
    """Steps between two moments at which Lightning may act. 1 is its automatic optimisation; more is for networks so
    small that its loop costs as much as a step, see :class:`pipeline.learning.trainable.Strided`."""
    validation_rows: int = 1024
    """Validation rows in one block."""
    threads: int = 1
    """Of torch on a CPU; sums are rounded by their number, so other ones make other weights. On small nets more than
    one gain nothing and lose much on a busy machine."""
    accelerator: str = "cpu"
    network: Mapping[str, Any] = field(default_factory=dict)
    """What else the network and its optimizer were made of, as plain values, such as the learning rate."""
    code: str = ""
    """Digest of the code that trains: a checkpoint of other code is not taken up."""


@dataclass(frozen=True, kw_only=True)
class Fitted(Generic[Module]):
    """The module with the lowest validation loss, in evaluation mode on the CPU, and how it came about."""

    training: Module
    step: int
    validation_loss: float
    fingerprint: str
    resumed_from: int


def fit(
    training: Module,
    train: Rows,
    validation: Rows,
    settings: FitSettings,
    folder: Path,
    *,
    logger: Logger | None = None,
    progress: bool = True,
    callbacks: Sequence[Callback] = (),
) -> Fitted[Module]:
    """Train on ``train``, keep what is best on ``validation``; last.ckpt, best.ckpt, curves.parquet go to ``folder``.

    training: with its first weights, which :func:`pipeline.learning.seeding.first_weights` makes repeatable; see
        :class:`pipeline.learning.trainable.Trainable` for what it must keep.
    callbacks: called between steps, or strides of them, before the looks at validation.
    A last.ckpt of the same data, first weights and settings is taken up; any other is replaced, with a line in the log.
    Sets the number of torch's threads.

    Raises:
        TableError: there are too few rows to train on.
        TypeError: ``training`` does not say its losses.
    """
    if train.count < 2 or validation.count < 1:
        raise TableError(
            f"{train.count} training and {validation.count} validation rows: expected at least 2 and 1. Harvest more "
            "plans of both splits."
        )
    if not isinstance(training, Trainable):
        raise TypeError(f"{type(training).__name__} has no method `losses`: see pipeline.learning.trainable.Trainable")
    torch.set_num_threads(settings.threads)
    folder.mkdir(parents=True, exist_ok=True)
    remove_partials(folder)
    fingerprint = fingerprint_of(training, train, validation, settings)
    done = _steps_done(folder / LAST, fingerprint, settings.steps)
    if done < settings.steps:
        looks = Looks(
            validation,
            folder,
            first=done,
            steps=settings.steps,
            every=settings.validate_every,
            first_seed=first_step_seed(settings.seed),
            rows_at_once=settings.validation_rows,
            fingerprint=fingerprint,
        )
        _run(training, train, settings, folder, looks, callbacks, logger, progress=progress)
    return _best(training, folder, fingerprint, resumed_from=done)


def fingerprint_of(training: LightningModule, train: Rows, validation: Rows, settings: FitSettings) -> str:
    """Return the sha256 of all that decides the weights after a given step; how many steps is not part of it."""
    content = {name: value for name, value in asdict(settings).items() if name not in ("steps", "stride")}
    content |= {"train": train.fingerprint(), "validation": validation.fingerprint()}
    content |= {"first": Rows({name: value[None] for name, value in training.state_dict().items()}).fingerprint()}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _run(
    training: LightningModule,
    train: Rows,
    settings: FitSettings,
    folder: Path,
    looks: Looks,
    callbacks: Sequence[Callback],
    logger: Logger | None,
    *,
    progress: bool,
) -> None:
    batches = Batches(
        rows=train,
        batch_size=settings.batch_size,
        seed=settings.seed,
        first=looks.step,
        steps=settings.steps,
        look_every=settings.validate_every,
        stride=settings.stride,
        scratch=folder,
    )
    resume = folder / LAST if looks.step > 0 else None
    with _quiet():
        trainer = Trainer(
            accelerator=settings.accelerator,
            devices=1,
            max_epochs=-1,  # the loader has no end, and `looks` stops after the last step
            logger=logger or False,
            callbacks=[*callbacks, looks, *([Bar(looks)] if progress else [])],
            default_root_dir=folder,
            enable_checkpointing=False,
            enable_progress_bar=False,
            enable_model_summary=False,
            num_sanity_val_steps=0,
        )
        module = training if settings.stride == 1 else Strided(training)
        trainer.fit(module, batches, ckpt_path=resume, weights_only=True)


def _steps_done(path: Path, fingerprint: str, steps: int) -> int:
    """Return the steps that the checkpoint at ``path`` saves us: 0 unless it belongs to this very training."""
    if not path.is_file():
        return 0
    for name in (LAST, BEST, CURVES):
        if wrong := damage(path.with_name(name)):
            _LOG.warning("%s: starting anew.", wrong)
            return 0
    try:
        mark = _load(path).get(MARK, {})
    except TableError as error:
        _LOG.warning("%s Starting anew.", error)
        return 0
    if mark.get("fingerprint") != fingerprint:
        _LOG.warning("%s belongs to other data or settings: starting anew.", path)
        return 0
    done = int(mark["step"])
    if done > steps:
        _LOG.warning("%s is %d steps old, more than the %d asked for: starting anew.", path, done, steps)
        return 0
    _LOG.info("%s: going on after step %d.", path, done)
    return done


def _best(training: Module, folder: Path, fingerprint: str, *, resumed_from: int) -> Fitted[Module]:
    checkpoint = _load(folder / BEST)
    mark = checkpoint.get(MARK, {})
    if mark.get("fingerprint") != fingerprint:
        raise TableError(f"{folder / BEST} belongs to other data or settings: delete {folder} and run train again.")
    training.load_state_dict(checkpoint["state_dict"])
    return Fitted(
        training=training.cpu().eval(),
        step=int(mark["step"]),
        validation_loss=float(mark["best_loss"]),
        fingerprint=fingerprint,
        resumed_from=resumed_from,
    )


def _load(path: Path) -> dict[str, Any]:
    """Load a checkpoint without running any code in it."""
    try:
        checkpoint: dict[str, Any] = torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises what it likes for a file that is cut short or not its own
        raise TableError(f"{path} is not a readable checkpoint ({type(error).__name__}).") from error
    return checkpoint


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep Lightning's tips and notes about hardware and loaders off the screen; errors still come through."""
    names = ("lightning.pytorch", "lightning.pytorch.utilities.rank_zero", "lightning.fabric", "lightning")
    levels = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module=r"lightning\..*")
            warnings.filterwarnings("ignore", module=r"torch\.jit\..*")
            yield
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)
