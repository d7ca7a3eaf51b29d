"""Harvest: what a system learns from, made in units of work over the training plans."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from pipeline.files import write_json
from pipeline.grids.store import grid_resolution
from pipeline.parts import resolve
from pipeline.stages.door import StageResult, launch, workspace
from pipeline.stages.jobs import blamed, fingerprint_of, job_of, made_with, nothing_to_do, system_of
from pipeline.stages.units import run_units
from pipeline.systems.system import Harvest, Job

SECTIONS = ("harvest", "sensor", "robot")
CODE = ("stages/harvest.py", "datums", "grids", "planning", "randomness.py", "simulation")


def harvest(raw: DictConfig) -> StageResult:
    """Write the tables that the system learns from, and harvest.json, to ``artifacts/harvest``."""
    work, system = workspace(raw), system_of(raw)
    source, target = work.folder("rasterize"), work.folder("harvest")
    if system.harvest is None:
        return nothing_to_do("harvest", target, f"{system.title} learns from nothing")
    part: Harvest = resolve(system.harvest)
    job = job_of(raw, system, work, SECTIONS)
    with blamed(raw.system, system.harvest):
        units, folder = part.units(source, job), target / part.folder
    job = replace(job, resolution_m=grid_resolution(source))
    resumed = run_units(
        [(_place(folder, index, part.suffix), unit) for index, unit in enumerate(units)],
        partial(_make, job=job, make=part.make, system=raw.system, place=system.harvest),
        folder,
        fingerprint_of(job, system, source, CODE),
        workers=work.workers,
        label="harvest",
        progress=work.progress,
    )
    with blamed(raw.system, system.harvest):
        found = part.summarise(folder, job)
    write_json(
        target / "harvest.json",
        found.numbers | {"shards": len(units), "digest": found.digest, "made_with": made_with(job)},
    )
    print(
        f"harvest: {found.sentence} in {len(units)} shards ({resumed} were there already), digest {found.digest[:12]}"
    )
    return StageResult(
        metrics={name: float(value) for name, value in found.numbers.items() if isinstance(value, int | float)},
        files=[target / "harvest.json"],
        datasets={part.folder: (folder, found.digest)},
    )


def _make(scratch: Path, unit: Any, *, job: Job, make: Callable[..., None], system: str, place: str) -> None:
    with blamed(system, place):
        make(scratch, unit, job=job)


def _place(folder: Path, index: int, suffix: str) -> Path:
    return folder / f"part-{index:06d}{suffix}"


if __name__ == "__main__":
    launch("harvest", harvest)
