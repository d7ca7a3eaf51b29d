"""From the configuration to what a system's parts work with: the system, its typed sections, what results depend on."""

from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import asdict
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from pipeline.checking import typed
from pipeline.errors import ConfigError
from pipeline.files import digest_file, write_json
from pipeline.parts import named
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.source_code import digest_code
from pipeline.stages.door import StageResult, Workspace
from pipeline.systems.system import Job, System, find_system

SHARED: dict[str, type[Any]] = {"sensor": SensorConfig, "robot": RobotConfig}


def system_of(raw: DictConfig) -> System:
    """Return the system that ``raw`` names.

    Raises:
        ConfigError: the key ``system`` is missing or names none.
    """
    name = raw.get("system")
    if not isinstance(name, str) or not name:
        raise ConfigError(f"system = {name!r}: expected the name of a system (conf/system/)")
    return find_system(name)


def blamed(system: str, place: str) -> AbstractContextManager[None]:
    """Return what turns errors within ``place``, a part of ``system``, into a sentence if that is not ours."""
    return named(place) if ":" in system else nullcontext()


def job_of(raw: DictConfig, system: System, work: Workspace, sections: Sequence[str]) -> Job:
    """Return the job of a stage that may read ``sections``, typed by the system or shared; others it does not have."""
    types = SHARED | dict(system.settings)
    known = {name: typed(types[name], raw, name) for name in sections if name in types}
    return Job(seed=work.seed, artifacts=work.root, sections=known)


def fingerprint_of(job: Job, system: System, source: Path, code: Sequence[str]) -> dict[str, Any]:
    """Return all that units made from the grids and pairs of ``source`` depend on; ``code`` beside the system's own."""
    return {name: asdict(section) for name, section in job.sections.items()} | {
        "system": system.name,
        "code": digest_code(*code, system.folder),
        "grids": digest_file(source / "grids.parquet"),
        "pairs": digest_file(source / "pairs.parquet"),
        "seed": job.seed,
    }


def made_with(job: Job) -> dict[str, object]:
    """Return the settings that a network of this harvest is bound to, by their whole names."""
    flat = {f"{name}.{key}": value for name, section in job.sections.items() for key, value in asdict(section).items()}
    return flat | {"rasterize.resolution_m": job.resolution_m}


def nothing_to_do(stage: str, target: Path, why: str) -> StageResult:
    """Say that the system has no part for ``stage``, in a sentence and in a file that later stages find."""
    print(f"{stage}: nothing to do. {why}")
    file = target / f"{stage}.json"
    write_json(file, {"nothing": why})
    return StageResult(files=[file])
