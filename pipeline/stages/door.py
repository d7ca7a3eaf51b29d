"""The door: behind it there is no DictConfig, only frozen records, and every error is one clear line."""

import os
import sys
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import hydra
from hydra.errors import HydraException
from omegaconf import DictConfig
from omegaconf.errors import OmegaConfBaseException

from pipeline.checking import note_taken_out, typed
from pipeline.errors import ConfigError, HinterlandError, one_line
from pipeline.parts import add_to_path
from pipeline.stages.composing import CONF, QUIET, explain, search_path
from pipeline.stages.recording import StageResult, record_run, tracker
from pipeline.stages.settings import ExecutionConfig
from pipeline.stages.stopping import Stopped, disk_words, ending_by_signal
from pipeline.tracking import Model

__all__ = ["Model", "StageResult", "Workspace", "launch", "refuse", "tracker", "typed", "workspace"]


@dataclass(frozen=True, kw_only=True)
class Workspace:
    """Where a stage works and with what: the artifacts folder, the seed and the number of worker processes."""

    root: Path
    seed: int
    workers: int
    progress: bool

    def folder(self, stage: str) -> Path:
        """Return the output folder of ``stage``. It is not created here: writers make it with their first file."""
        return self.root / stage


def workspace(raw: DictConfig) -> Workspace:
    """Return where and with what the stage works, from the root keys ``artifacts``, ``seed`` and ``execution``."""
    execution = typed(ExecutionConfig, raw, "execution")
    seed, artifacts = raw.get("seed"), raw.get("artifacts")
    if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
        raise ConfigError(f"seed = {seed!r}: expected a whole number of at least 0 (conf/config.yaml)")
    if not isinstance(artifacts, str) or not artifacts:
        raise ConfigError(f"artifacts = {artifacts!r}: expected the folder of all outputs (conf/config.yaml)")
    workers = execution.workers if execution.workers is not None else os.cpu_count() or 1
    return Workspace(root=Path(artifacts), seed=seed, workers=workers, progress=execution.progress)


def launch(stage: str, body: Callable[[DictConfig], StageResult]) -> None:
    """Run ``body`` as the command line of ``stage``, then log what it returned to the tracking store.

    Arguments are Hydra overrides (``experiment=tiny harvest.max_steps=5``), on top of conf/config.yaml or of a
    composed file: ``--config artifacts/config.yaml``. Hydra's own flags (``--help``, ``--cfg job``, ``--multirun``)
    work. A refused input ends the program with one line and exit code 1; HINTERLAND_TRACEBACK=1 shows the trace.
    """
    # Hydra then raises instead of printing its own trace, and the error is presented below.
    os.environ["HYDRA_FULL_ERROR"] = "1"
    arguments = sys.argv[1:]

    def task(raw: DictConfig) -> None:
        try:
            find_parts(raw)
            record_run(stage, raw, body(raw))
        except (HinterlandError, OSError) as error:
            refuse(error)  # here, because Hydra adds a line of its own to what leaves the task

    note_taken_out(arguments)
    try:
        with ending_by_signal():
            sys.argv = [sys.argv[0], *_arranged(_from_file(arguments))]
            hydra.main(version_base="1.3", config_path=str(CONF), config_name="config")(task)()
    except (HinterlandError, HydraException, OmegaConfBaseException) as error:
        refuse(error if isinstance(error, HinterlandError) else explain(error, arguments))
    except KeyboardInterrupt as stop:
        print(f"\nstopped: the same command continues {stage}", file=sys.stderr)
        sys.exit(stop.exit_code if isinstance(stop, Stopped) else 130)


def find_parts(raw: DictConfig) -> None:
    """Put the folder of one's own parts on the import path, from which worker processes take it over."""
    parts = raw.get("parts")
    if parts is None:
        return
    if not isinstance(parts, str) or not Path(parts).is_dir():
        raise ConfigError(f"parts = {parts!r}: no such folder. Expected the folder of your own parts, or null")
    add_to_path(Path(parts))


def refuse(error: Exception) -> None:
    """End the program with one line that says what is wrong, and exit code 1."""
    if os.environ.get("HINTERLAND_TRACEBACK"):
        traceback.print_exception(error)
    print(f"error: {one_line(disk_words(error) if isinstance(error, OSError) else error)}", file=sys.stderr)
    sys.exit(1)


def _from_file(arguments: Sequence[str]) -> list[str]:
    """Turn ``--config FILE`` into Hydra's two flags; the rest stays."""
    given = list(arguments)
    if "--config" not in given:
        return given
    place = given.index("--config")
    file = Path(given[place + 1]) if place + 1 < len(given) else None
    if file is None or not file.is_file():
        refuse(ConfigError(f"--config {file or ''}: no such file. Write it with: python -m pipeline.stages.compose"))
    assert file is not None
    return [*given[:place], *given[place + 2 :], "-cp", str(file.resolve().parent), "-cn", file.stem]


def _arranged(arguments: Sequence[str]) -> list[str]:
    """Return flags first, then all overrides in one block: argparse takes them in no other order."""
    overrides = [entry for entry in arguments if not entry.startswith("-") and ("=" in entry or entry.startswith("~"))]
    return [*(entry for entry in arguments if entry not in overrides), *QUIET, *overrides, *search_path(overrides)]
