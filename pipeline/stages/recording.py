"""From a finished stage to a run in the tracking store."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from pipeline.checking import typed
from pipeline.errors import ConfigError
from pipeline.stages.settings import TrackingConfig
from pipeline.tracking import Dataset, Destination, Model, Run, is_news, keep, known_outage, log_run, note_outage

_SHARED_SECTIONS = ("sensor", "robot", "planner")


@dataclass(frozen=True, kw_only=True)
class StageResult:
    """What a stage tells the tracking store; its outputs are already on disk.

    ``run_id`` names a tracking run that the stage opened itself (see `pipeline.tracking.training_logger`); without
    it a new run is made. ``datasets`` maps the name of
    data the stage wrote or read to where it lies and the digest of its content.
    """

    metrics: Mapping[str, float] = field(default_factory=dict)
    files: Sequence[Path] = ()
    tags: Mapping[str, str] = field(default_factory=dict)
    datasets: Mapping[str, tuple[Path, str]] = field(default_factory=dict)
    model: Model | None = None
    run_id: str | None = None


def tracker(raw: DictConfig) -> Destination | None:
    """Return the tracking store that ``raw`` asks for, or None when tracking is off.

    Raises:
        ConfigError: the section tracking or the key experiment_name is not as expected.

    """
    destination = store_of(raw)
    return destination if typed(TrackingConfig, raw, "tracking").enabled else None


def store_of(raw: DictConfig) -> Destination:
    """Return the tracking store that ``raw`` names, whether or not runs are logged to it. Raises as `tracker`."""
    config = typed(TrackingConfig, raw, "tracking")
    name = config.experiment or raw.get("experiment_name")
    if not isinstance(name, str) or not name:
        raise ConfigError(f"experiment_name = {name!r}: expected a name (conf/config.yaml or conf/experiment/)")
    return Destination.chosen(uri=config.uri, experiment=name, artifacts=Path(raw.get("artifacts") or "artifacts"))


def record_run(stage: str, raw: DictConfig, result: StageResult) -> None:
    """Log ``result`` as the run ``stage``. A store that fails costs one warning; the run is kept for later."""
    destination = tracker(raw)
    if destination is None:
        return
    config: Any = OmegaConf.to_container(raw, resolve=True)
    sections = {name: config[name] for name in ("seed", stage, *_SHARED_SECTIONS) if name in config}
    run = Run(
        name=stage,
        params=dict(_flat(sections)),
        config=config,
        metrics=result.metrics,
        files=result.files,
        tags=result.tags,
        datasets=[Dataset(name=name, path=path, digest=digest) for name, (path, digest) in result.datasets.items()],
        model=result.model,
        run_id=result.run_id,
    )
    if known_outage(destination.spool) is None:
        try:
            log_run(destination, run)
        except Exception as error:
            note_outage(destination.spool, error)
        else:
            return
    _keep(destination, run)


def _keep(destination: Destination, run: Run) -> None:
    """Keep ``run`` beside the outputs; warn where the store failed in this stage and not in one before it."""
    reason, warn = known_outage(destination.spool) or "", is_news(destination.spool)
    try:
        place = f"It is kept in {keep(destination, run, reason)}"
    except OSError as error:
        place, warn = f"Nor could it be kept in {destination.spool} ({error.strerror or error})", True
    if warn:
        print(
            f"warning: {run.name} is finished, but was not logged to {destination.shown}: {reason}. {place}",
            file=sys.stderr,
        )
    else:
        print(f"{run.name}: not logged to {destination.shown}, which failed before. {place}")


def _flat(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
