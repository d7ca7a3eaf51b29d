"""dvc.yaml lists what each stage really uses: the packages it imports and the sections it reads."""

import importlib
import re
from pathlib import Path
from typing import Any

import grimp
import pytest
import yaml

from pipeline.stages.compose import STAGES

ROOT = Path(__file__).resolve().parents[1]
PIPELINE: dict[str, Any] = yaml.safe_load((ROOT / "dvc.yaml").read_text(encoding="utf-8"))["stages"]

# These change no result: the door and its messages, tracking, progress, how a file is written.
WITHOUT_EFFECT = {
    *(
        f"pipeline/stages/{name}.py"
        for name in ("__init__", "checking", "composing", "door", "recording", "settings", "progress", "stopping")
    ),
    "pipeline/tracking",
    "pipeline/errors.py",
    "pipeline/files.py",
    "pipeline/tables.py",
    "pipeline/__init__.py",
}
SHARED_SECTIONS = {"sensor", "robot", "planner"}


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("pipeline", "models", cache_dir=None)


def source_of(module: str) -> str:
    """Return what dvc.yaml would list for ``module``: a file of pipeline/ or stages/, a system, or a whole package."""
    parts = module.split(".")
    if parts[0] == "models":
        return "models"
    if len(parts) == 1:
        return "pipeline/__init__.py"
    if parts[1] == "stages" or (len(parts) == 2 and (ROOT / "pipeline" / f"{parts[1]}.py").exists()):
        return f"{'/'.join(parts)}.py" if len(parts) > 2 or parts[1] != "stages" else "pipeline/stages/__init__.py"
    return "/".join(parts[: 3 if parts[1] == "systems" else 2])


def code_deps(stage: str) -> set[str]:
    return {dep for dep in PIPELINE[stage]["deps"] if dep.startswith(("pipeline", "models"))}


@pytest.mark.parametrize("stage", STAGES)
def test_code_dependencies_equal_the_import_graph(stage: str, graph: grimp.ImportGraph) -> None:
    module = f"pipeline.stages.{stage}"
    # Packages pull each other in only through modules, so an __init__ that re-exports counts as used.
    used = {source_of(name) for name in {module, *graph.find_upstream_modules(module)}} - WITHOUT_EFFECT
    used -= {"pipeline/systems"}
    assert code_deps(stage) == used


@pytest.mark.parametrize("stage", ["harvest", "evaluate"])
def test_what_makes_finished_work_stale_is_the_code_that_dvc_watches(stage: str) -> None:
    """A unit of work found on the disk is taken up only if all code that made it is still the same."""
    code = importlib.import_module(f"pipeline.stages.{stage}").CODE
    assert {f"pipeline/{package}" for package in code} == code_deps(stage) - {"pipeline/stages/units.py"}


@pytest.mark.parametrize("stage", STAGES)
def test_tracked_sections_are_the_ones_the_stage_reads(stage: str) -> None:
    (tracked,) = (entry["artifacts/config.yaml"] for entry in PIPELINE[stage]["params"])
    source = (ROOT / "pipeline" / "stages" / f"{stage}.py").read_text(encoding="utf-8")
    read = set(re.findall(r'typed\(\w+, raw, "(\w+)"\)', source)) & (SHARED_SECTIONS | set(STAGES))
    assert set(tracked) == {"seed", *read}


@pytest.mark.parametrize("stage", STAGES)
def test_stage_word_is_the_same_everywhere(stage: str) -> None:
    assert f"-m pipeline.stages.{stage} " in PIPELINE[stage]["cmd"]
    assert (ROOT / "conf" / stage / "default.yaml").is_file()
    (out,) = PIPELINE[stage]["outs"]
    assert (out if isinstance(out, str) else next(iter(out))) == f"artifacts/{stage}"


def test_data_flows_one_way() -> None:
    assert list(PIPELINE) == ["compose", *STAGES]
    made: set[str] = set()
    for name, stage in PIPELINE.items():
        needed = {dep for dep in stage["deps"] if dep.startswith("artifacts/")}
        assert needed <= made, f"{name} reads what no earlier stage makes"
        made |= {f"artifacts/{name}"}
