"""From a finished stage to a run in the tracking store."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from pipeline.errors import ConfigError
from pipeline.stages.checking import typed
from pipeline.stages.settings import TrackingConfig
from pipeline.tracking import Dataset, Destination, Model, Run, log_run

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
    config = typed(TrackingConfig, raw, "tracking")
    name = config.experiment or raw.get("experiment_name")
    if not isinstance(name, str) or not name:
        raise ConfigError(f"experiment_name = {name!r}: expected a name (conf/config.yaml or conf/experiment/)")
    return Destination.chosen(uri=config.uri, experiment=name) if config.enabled else None


def record_run(stage: str, raw: DictConfig, result: StageResult) -> None:
    """Log ``result`` as the run ``stage``. The outputs exist already, so a failing store costs only a warning."""
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
    try:
        log_run(destination, run)
    except Exception as error:
        reason = (str(error).strip().splitlines() or [type(error).__name__])[0]
        print(f"warning: {stage} is finished, but was not logged to {destination.uri}: {reason}", file=sys.stderr)


def _flat(tree: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in tree.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value
