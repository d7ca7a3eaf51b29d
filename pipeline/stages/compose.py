"""Compose: the one configuration file that all later stages run with and that DVC tracks key by key."""

import dataclasses
import importlib
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from pipeline.errors import ConfigError
from pipeline.files import write_text
from pipeline.stages.checking import typed, unknown_key
from pipeline.stages.door import StageResult, launch, refuse, tracker, workspace
from pipeline.stages.settings import ExecutionConfig, PlannerConfig, RobotConfig, SensorConfig, TrackingConfig

STAGES = ("plans", "rasterize", "harvest", "train", "evaluate", "report")
SHARED: dict[str, type[Any]] = {
    "sensor": SensorConfig,
    "robot": RobotConfig,
    "planner": PlannerConfig,
    "execution": ExecutionConfig,
    "tracking": TrackingConfig,
}
ROOT_KEYS = ("seed", "artifacts", "experiment_name", *SHARED, *STAGES)
PARAMS = Path("params.yaml")
NO_DATA = "conf/plans"
"""What `data` in params.yaml names when the plans are generated: DVC wants a dependency that exists."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """What params.yaml asks DVC to run: an experiment, further overrides, and the data that plans.root names."""

    experiment: str = "demo"
    overrides: Sequence[str] = field(default_factory=list)
    data: str = NO_DATA

    def as_overrides(self) -> list[str]:
        """Return the request as Hydra overrides."""
        root = [] if self.data == NO_DATA else [f"plans.root={_quoted(self.data)}"]
        return [f"experiment={self.experiment}", *self.overrides, *root]


def section_types() -> dict[str, type[Any]]:
    """Return the record of every section, the stages' ones taken from their modules."""
    stages = {
        name: getattr(importlib.import_module(f"pipeline.stages.{name}"), f"{name.title()}Config") for name in STAGES
    }
    return SHARED | stages


def check(raw: DictConfig) -> None:
    """Refuse a configuration that any stage would refuse: every section is typed here, before anything runs.

    Raises:
        ConfigError: an unknown root key, or what `typed` refuses in a section.

    """
    for name in raw:
        if name not in ROOT_KEYS:
            raise ConfigError(unknown_key(str(name), ROOT_KEYS, "conf/config.yaml"))
    workspace(raw)
    tracker(raw)
    for name, schema in section_types().items():
        typed(schema, raw, name)
    if raw.plans.get("source") == "files" and not raw.plans.get("root"):
        raise ConfigError(
            "plans.root is not given, and plans.source=files reads floor plans: expected the folder, file or archive "
            "to read. Add plans.root=/data/floors"
        )


def compose(raw: DictConfig) -> StageResult:
    """Write the checked and resolved configuration to ``<artifacts>/config.yaml``."""
    check(raw)
    target = workspace(raw).root / "config.yaml"
    try:
        write_text(target, OmegaConf.to_yaml(raw, resolve=True))
    except OmegaConfBaseException as error:
        raise ConfigError(f"{error.full_key}: {str(error).splitlines()[0]}") from error
    return StageResult(files=[target])


def read_request(path: Path) -> Request:
    """Read params.yaml.

    Raises:
        ConfigError: the file is missing, is no YAML, has unknown keys, overrides what DVC has to see elsewhere, or
            names data that is not there.

    """
    return checked_request(load_request(path))


def load_request(path: Path) -> Request:
    """Read params.yaml as `read_request` does, without a look at what it asks for."""
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, yaml.YAMLError) as error:
        raise ConfigError(f"{path} cannot be read: {' '.join(str(error).split())}") from error
    allowed = [entry.name for entry in dataclasses.fields(Request)]
    if not isinstance(content, dict):
        raise ConfigError(f"{path} holds {type(content).__name__}: expected the keys {', '.join(allowed)}")
    for name in content:
        if name not in allowed:
            raise ConfigError(unknown_key(str(name), allowed, str(path)))
    return Request(**content)


def checked_request(request: Request) -> Request:
    """Return ``request`` if DVC can run it, else raise a ConfigError."""
    overrides = request.overrides
    if not isinstance(overrides, list) or not all(isinstance(entry, str) for entry in overrides):
        raise ConfigError(
            f"overrides = {overrides!r} in {PARAMS}: expected a list of texts such as ['train.steps=500']"
        )
    for entry in overrides:
        key = entry.partition("=")[0].lstrip("+~")
        if key in ("artifacts", "experiment", "plans.root"):
            instead = {"artifacts": "DVC keeps outputs in artifacts/", "experiment": "set the key experiment"}
            raise ConfigError(
                f"overrides in {PARAMS} hold {entry}: {instead.get(key, 'set the key data, which DVC watches')}"
            )
    if not isinstance(request.data, str) or not Path(request.data).exists():
        raise ConfigError(
            f"plans.root (key data of {PARAMS}) = {request.data}: no such file or folder. "
            f"Expected the floor plans to read, or {NO_DATA} for generated ones"
        )
    return request


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"


def _from_params(arguments: Sequence[str]) -> list[str]:
    """Turn ``--params FILE`` into the overrides that the file asks for; the rest stays and comes later."""
    given = list(arguments)
    if "--params" not in given:
        return given
    place = given.index("--params")
    file = Path(given[place + 1]) if place + 1 < len(given) else PARAMS
    return [*given[:place], *read_request(file).as_overrides(), *given[place + 2 :]]


if __name__ == "__main__":
    try:
        sys.argv[1:] = _from_params(sys.argv[1:])
    except ConfigError as failure:
        refuse(failure)
    launch("compose", compose)
