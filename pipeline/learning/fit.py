"""Train a subgoal network; killed at any point, the same call goes on and ends with the same weights."""

import contextlib
import hashlib
import json
import logging
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import torch
from lightning.pytorch import Callback, Trainer
from lightning.pytorch.loggers import Logger

from models.subgoals import SubgoalNet, SubgoalTraining, TargetScaling
from pipeline.errors import TableError
from pipeline.files import damage, remove_partials
from pipeline.learning.batches import Batches
from pipeline.learning.examples import Examples
from pipeline.learning.looks import BEST, CURVES, LAST, MARK, Bar, Looks
from pipeline.learning.scaling import fit_scaling
from pipeline.randomness import stream

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class FitSettings:
    """How the network is made and trained (LSP, section 4)."""

    steps: int
    batch_size: int
    learning_rate: float
    decay: float
    decay_every: int
    hidden: Sequence[int]
    dropout: float
    success_weight: float
    exploration_weight: float
    target_scaling: TargetScaling
    validate_every: int
    seed: int
    accelerator: str = "cpu"
    code: str = ""
    """Digest of the code that trains: a checkpoint of other code is not taken up."""


@dataclass(frozen=True, kw_only=True)
class Fitted:
    """The network with the lowest validation loss, in evaluation mode on the CPU, and how it came about."""

    net: SubgoalNet
    step: int
    validation_loss: float
    fingerprint: str
    resumed_from: int


def fit(
    train: Examples,
    validation: Examples,
    settings: FitSettings,
    folder: Path,
    *,
    logger: Logger | None = None,
    progress: bool = True,
    callbacks: Sequence[Callback] = (),
) -> Fitted:
    """Train on ``train``, keep what is best on ``validation``; last.ckpt, best.ckpt, curves.parquet go to ``folder``.

    callbacks: called between strides of steps, before the looks at validation.
    Sets torch to one thread: on a net of this size more threads gain nothing and lose much on a busy machine.
    A last.ckpt of the same data and settings is taken up; any other is replaced, with a line in the log.
    Raises TableError when there are too few examples to train on.
    """
    if train.count < 2 or validation.count < 1:
        raise TableError(
            f"{train.count} training and {validation.count} validation datums: expected at least 2 and 1. Harvest more "
            "plans of both splits."
        )
    torch.set_num_threads(1)
    folder.mkdir(parents=True, exist_ok=True)
    remove_partials(folder)
    fingerprint = fingerprint_of(train, validation, settings)
    done = _steps_done(folder / LAST, fingerprint, settings.steps)
    training = make_training(train, settings)
    looks = Looks(validation, folder, every=settings.validate_every, steps=settings.steps, fingerprint=fingerprint)
    if done < settings.steps:
        called = [*callbacks, looks, *([Bar(looks)] if progress else [])]
        _run(training, train, settings, folder, called, logger, resume=done > 0)
    return _best(training.net, folder, fingerprint, resumed_from=done)


def fingerprint_of(train: Examples, validation: Examples, settings: FitSettings) -> str:
    """Return the sha256 of all that decides the weights after a given step; how many steps is not part of it."""
    content = {name: value for name, value in asdict(settings).items() if name != "steps"}
    content |= {"hidden": list(settings.hidden), "train": train.fingerprint(), "validation": validation.fingerprint()}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def make_training(train: Examples, settings: FitSettings) -> SubgoalTraining:
    """Return an untrained network, scaled to ``train``, whose first weights depend on the seed alone."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(int(stream(settings.seed, "weights").integers(2**62)))
        net = SubgoalNet(
            inputs=train.inputs.shape[1],
            hidden=settings.hidden,
            dropout=settings.dropout,
            target_scaling=settings.target_scaling,
        )
    fit_scaling(net, train)
    return SubgoalTraining(
        net,
        learning_rate=settings.learning_rate,
        decay=settings.decay,
        decay_every=settings.decay_every,
        success_weight=settings.success_weight,
        exploration_weight=settings.exploration_weight,
    )


def _run(
    training: SubgoalTraining,
    train: Examples,
    settings: FitSettings,
    folder: Path,
    callbacks: list[Callback],
    logger: Logger | None,
    *,
    resume: bool,
) -> None:
    with _quiet():
        trainer = Trainer(
            accelerator=settings.accelerator,
            devices=1,
            max_epochs=-1,
            max_steps=settings.steps,
            logger=logger or False,
            callbacks=callbacks,
            default_root_dir=folder,
            enable_checkpointing=False,
            enable_progress_bar=False,
            enable_model_summary=False,
            num_sanity_val_steps=0,
        )
        batches = Batches(
            examples=train,
            batch_size=settings.batch_size,
            seed=settings.seed,
            steps=settings.steps,
            look_every=settings.validate_every,
            scratch=folder,
            step=lambda: trainer.global_step,
        )
        trainer.fit(training, batches, ckpt_path=folder / LAST if resume else None, weights_only=True)


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


def _best(net: SubgoalNet, folder: Path, fingerprint: str, *, resumed_from: int) -> Fitted:
    checkpoint = _load(folder / BEST)
    mark = checkpoint.get(MARK, {})
    if mark.get("fingerprint") != fingerprint:
        raise TableError(f"{folder / BEST} belongs to other data or settings: delete {folder} and run train again.")
    prefix = "net."
    state = {name.removeprefix(prefix): value for name, value in checkpoint["state_dict"].items()}
    net.load_state_dict(state)
    states = [state for name, state in checkpoint["callbacks"].items() if name.startswith("Looks")]
    return Fitted(
        net=net.cpu().eval(),
        step=int(mark["step"]),
        validation_loss=float(states[0]["best_loss"]),
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
