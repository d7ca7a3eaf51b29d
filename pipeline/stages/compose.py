"""Compose: the one configuration file that all later stages run with and that DVC tracks key by key."""

import dataclasses
import importlib
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import yaml
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from pipeline.checking import typed, typed_settings, unknown_key
from pipeline.errors import ConfigError
from pipeline.evaluation.competitors import make_roster
from pipeline.evaluation.settings import EvaluateSettings
from pipeline.files import write_text
from pipeline.parts import resolve
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.stages.composing import CONF, quoted
from pipeline.stages.door import StageResult, launch, refuse, tracker, workspace
from pipeline.stages.jobs import system_of
from pipeline.stages.roots import KEY, Root, RootsConfig
from pipeline.stages.settings import ExecutionConfig, TrackingConfig
from pipeline.systems.system import Contest, System

STAGES = ("plans", "rasterize", "harvest", "train", "evaluate", "report")
SHARED: dict[str, type[Any]] = {
    "sensor": SensorConfig,
    "robot": RobotConfig,
    "execution": ExecutionConfig,
    "tracking": TrackingConfig,
}
OWN = ("planner", "harvest", "train", "evaluate")
"""Sections that the system types."""
ROOT_KEYS = ("seed", "artifacts", "experiment_name", "parts", "system", "planner", *SHARED, *STAGES)
PARAMS = Path("params.yaml")
NO_DATA = "conf/plans"
"""What `data` in params.yaml names when the plans are generated: DVC wants a dependency that exists."""
NO_PARTS = "conf/system"
"""What `parts` names when there are none of one's own, for the same reason."""


@dataclass(frozen=True, kw_only=True)
class Request:
    """What params.yaml asks DVC to run.

    experiment: a file of conf/experiment. overrides: further ones. data: what plans.root names. parts: the folder of
    own parts. system: the folder of the code of the system that the experiment belongs to.
    """

    experiment: str = "demo"
    overrides: Sequence[str] = field(default_factory=list)
    data: str = NO_DATA
    parts: str = NO_PARTS
    system: str = "pipeline/systems/subgoals"

    def as_overrides(self) -> list[str]:
        """Return the request as Hydra overrides."""
        many = any(entry.lstrip("+").startswith("plans.roots") for entry in self.overrides)
        root = [] if many or self.data == NO_DATA else [f"plans.root={quoted(self.data)}"]
        parts = [] if self.parts == NO_PARTS else [f"parts={quoted(self.parts)}"]
        return [f"experiment={self.experiment}", *self.overrides, *root, *parts]


def section_types(system: System) -> dict[str, type[Any]]:
    """Return the record of every section: those of the stages from their modules, those of the method from its system.

    A section that the system does not type must be empty.
    """
    stages = {
        name: getattr(importlib.import_module(f"pipeline.stages.{name}"), f"{name.title()}Config")
        for name in STAGES
        if name not in OWN
    }
    return SHARED | stages | {name: system.settings.get(name, Nothing) for name in OWN}


@dataclass(frozen=True, kw_only=True)
class Nothing:
    """A section in which a system has nothing to set."""


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
    system = system_of(raw)
    sections = {name: _typed(schema, raw, name, system) for name, schema in section_types(system).items()}
    _check_competitors(system, sections["evaluate"])
    given = raw.plans.get("root") or any((raw.plans.get("roots") or {}).values())
    if raw.plans.get("source") == "files" and not given:
        raise ConfigError(
            "plans.root is not given, and plans.source=files reads floor plans: expected the folder, file or archive "
            "to read. Add plans.root=/data/floors, or plans.roots.train=... and plans.roots.test=..."
        )


def _typed(schema: type[Any], raw: DictConfig, name: str, system: System) -> Any:
    if schema is not Nothing:
        return typed(schema, raw, name)
    if given := raw.get(name):
        keys = ", ".join(f"{name}.{key}" for key in given)
        raise ConfigError(f"{keys}: the system {system.name} has nothing to set in the section {name}. Take it out")
    return Nothing()


def _check_competitors(system: System, evaluate: Any) -> None:
    """Refuse competitors that evaluate would refuse, hours later."""
    if system.contest is None or not isinstance(evaluate, EvaluateSettings):
        return
    contest: Contest = resolve(system.contest)
    for competitor in make_roster(evaluate.competitors):
        contest.part_of(competitor)


def compose(raw: DictConfig, request: Request | None = None) -> StageResult:
    """Write the checked and resolved configuration to ``<artifacts>/config.yaml``; ``request`` is what asked for it."""
    check(raw)
    if request is not None:
        check_system(raw, request)
        check_data(raw, request)
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
        if key in _ELSEWHERE:
            raise ConfigError(f"overrides in {PARAMS} hold {entry}: {_ELSEWHERE[key]}")
    if not isinstance(request.parts, str) or not Path(request.parts).is_dir():
        raise ConfigError(
            f"parts = {request.parts}: no such folder. Expected the folder of your own parts, or {NO_PARTS} for none"
        )
    if not isinstance(request.data, str) or not Path(request.data).exists():
        raise ConfigError(
            f"plans.root (key data of {PARAMS}) = {request.data}: no such file or folder. "
            f"Expected the floor plans to read, or {NO_DATA} for generated ones"
        )
    return request


_ELSEWHERE = {
    "artifacts": "DVC keeps outputs in artifacts/",
    "experiment": "set the key experiment",
    "plans.root": "set the key data, which DVC watches",
    "parts": "set the key parts, which DVC watches",
    "system": "an experiment chooses it (conf/experiment/)",
}


def system_folder(raw: DictConfig) -> str:
    """Return the folder of the code of the system that ``raw`` names, from the root of the checkout on."""
    return os.path.relpath(system_of(raw).folder, CONF.parent)


def _roots(raw: DictConfig) -> list[Root]:
    given = OmegaConf.to_container(raw, resolve=True)
    assert isinstance(given, dict)
    return typed_settings(RootsConfig, given["plans"].get("roots") or {}, KEY).listed()


def watched_data(raw: DictConfig, request: Request) -> str:
    """Return what DVC has to watch for the plans that ``raw`` reads: with several roots, the folder around them all."""
    roots = [root.path for root in _roots(raw)]
    return (
        request.data
        if not roots
        else os.path.relpath(os.path.commonpath([path.resolve() for path in roots]), CONF.parent)
    )


def check_data(raw: DictConfig, request: Request) -> None:
    """Check that DVC watches the floor plans that are read.

    Raises:
        ConfigError: plans.roots lie outside of the folder that params.yaml names.
    """
    watched = Path(request.data).resolve()
    for root in _roots(raw):
        if not root.path.resolve().is_relative_to(watched):
            raise ConfigError(
                f"plans.roots has {root.path} for the split {root.split}, which DVC does not watch: set the key data "
                f"of {PARAMS} to a folder that holds all of them, or run `hinterland` with these overrides, which does"
            )


def check_system(raw: DictConfig, request: Request) -> None:
    """Check that DVC watches the code of the system that runs.

    Raises:
        ConfigError: params.yaml names the folder of another system.
    """
    found = system_folder(raw)
    if found != request.system:
        raise ConfigError(
            f"system = {request.system} in {PARAMS}, but experiment={request.experiment} belongs to {found}: set the "
            f"key system to {found}, or run `hinterland experiment={request.experiment}`, which does"
        )


def _from_params(arguments: Sequence[str]) -> tuple[list[str], Request | None]:
    """Turn ``--params FILE`` into the overrides that the file asks for; the rest stays and comes later."""
    given = list(arguments)
    if "--params" not in given:
        return given, None
    place = given.index("--params")
    request = read_request(Path(given[place + 1]) if place + 1 < len(given) else PARAMS)
    return [*given[:place], *request.as_overrides(), *given[place + 2 :]], request


if __name__ == "__main__":
    try:
        sys.argv[1:], asked = _from_params(sys.argv[1:])
    except ConfigError as failure:
        refuse(failure)
    launch("compose", partial(compose, request=asked))
