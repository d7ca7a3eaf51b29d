"""dvc.yaml lists what each stage really uses, whatever the system: the packages it imports, the sections it reads."""

import importlib
import re
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import grimp
import pytest
import yaml

from pipeline.parts import resolve
from pipeline.stages.compose import OWN, STAGES, Request
from pipeline.systems.subgoals import training
from pipeline.systems.system import Contest, System, find_system, known_systems

ROOT = Path(__file__).resolve().parents[1]
PIPELINE: dict[str, Any] = yaml.safe_load((ROOT / "dvc.yaml").read_text(encoding="utf-8"))["stages"]
SYSTEM, PARTS = "${system}", "${parts}"

# What a stage takes from a system: the attribute of System that names its place.
PLACES = {"harvest": "harvest", "train": "training", "evaluate": "contest", "report": "figures"}

# These change no result: the door and its messages, tracking, progress, how a file is written, how a part is found.
WITHOUT_EFFECT = {
    *(f"pipeline/stages/{name}.py" for name in ("__init__", "composing", "door", "recording", "settings", "progress",
                                                "stopping")),
    *(f"pipeline/{name}.py" for name in ("__init__", "checking", "errors", "files", "parts", "settings",
                                         "source_code", "tables")),
    "pipeline/systems",
    "pipeline/tracking",
}  # fmt: skip


@cache
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("pipeline", "models", cache_dir=None)


def records() -> set[str]:
    """Return the modules that hold records of settings and of what a system offers.

    They import packages for the types of their fields alone; the settings themselves reach DVC as parameters.
    """
    kinds = [kind for name in known_systems() for kind in find_system(name).settings.values()]
    ours = (f"pipeline.systems.{name}.system" for name in known_systems())
    return {"pipeline.systems.system", *ours, *(kind.__module__ for kind in kinds)}


def named_in(module: str) -> set[str]:
    """Return the modules that the places in mappings of ``module`` lie in: parts that it imports when they are used."""
    tables = [value for value in vars(importlib.import_module(module)).values() if isinstance(value, Mapping)]
    texts = [text for table in tables for text in table.values() if isinstance(text, str)]
    return {text.partition(":")[0] for text in texts if re.fullmatch(r"(pipeline|models)[\w.]*:\w+", text)}


def used_from(starts: Iterable[str]) -> set[str]:
    """Return the modules that ``starts`` import, and those that a system's modules among them name as places."""
    open_, seen = set(starts), set[str]()
    while open_:
        module = open_.pop()
        seen.add(module)
        found = set() if module in records() else set(graph().find_modules_directly_imported_by(module))
        if re.match(r"pipeline\.systems\.\w+\.", module):
            found |= named_in(module)
        open_ |= found - seen
    return seen


def source_of(module: str) -> str:
    """Return what dvc.yaml would list for ``module``: a file of pipeline/ or stages/, a system, or a whole package."""
    parts = module.split(".")
    if parts[0] == "models":
        return "models"
    if len(parts) == 1:
        return "pipeline/__init__.py"
    if parts[1] == "systems":
        return "/".join(parts[:3]) if (ROOT / "/".join(parts[:3])).is_dir() else "pipeline/systems"
    if parts[1] == "stages" or (len(parts) == 2 and (ROOT / "pipeline" / f"{parts[1]}.py").exists()):
        return f"{'/'.join(parts)}.py" if len(parts) > 2 or parts[1] != "stages" else "pipeline/stages/__init__.py"
    return "/".join(parts[:2])


def places_of(system: System, stage: str) -> set[str]:
    """Return the modules that ``stage`` imports by the places that ``system`` names."""
    place = getattr(system, PLACES[stage]) if stage in PLACES else None
    if place is None:
        return set()
    found = resolve(place)
    parts = found.parts.values() if isinstance(found, Contest) else ()
    return {text.partition(":")[0] for text in (place, *parts)}


FREE_TO_USE = {"report": {"pipeline/planning", "pipeline/simulation"}}
"""What the figures of any system may use: where it changed, evaluate runs again before the report anyway."""


@cache
def sources(stage: str, name: str) -> set[str]:
    """Return the code that ``stage`` uses when it runs the system ``name``; the system's own folder by DVC's name."""
    modules = used_from({f"pipeline.stages.{stage}", *places_of(find_system(name), stage)})
    found = {source_of(module) for module in modules} - WITHOUT_EFFECT
    if stage in PLACES:
        found |= {PARTS, SYSTEM}
    elif stage == "plans":
        found.add(PARTS)  # a generator or a reader of one's own
    return {SYSTEM if source == f"pipeline/systems/{name}" else source for source in found}


def code_deps(stage: str) -> set[str]:
    return {dep for dep in PIPELINE[stage]["deps"] if dep.startswith(("pipeline", "models", "${")) and dep != "${data}"}


@pytest.mark.parametrize("stage", STAGES)
def test_code_dependencies_equal_what_all_systems_import(stage: str) -> None:
    """One dvc.yaml serves all systems: it lists what any of them uses, and nothing that none may use."""
    used = set().union(*(sources(stage, name) for name in known_systems()))
    assert used <= code_deps(stage) <= used | FREE_TO_USE.get(stage, set())


@pytest.mark.parametrize("name", known_systems())
def test_a_system_uses_no_other(name: str) -> None:
    """DVC watches the folder of the system that runs, so it may take nothing from the folder of another."""
    found = {source for stage in STAGES for source in sources(stage, name) if source.startswith("pipeline/systems")}
    assert not found


def test_parts_named_in_mappings_are_followed() -> None:
    """A competitor's estimator is named by a text and not imported; its module counts all the same."""
    assert "pipeline.systems.subgoals.perfect" not in graph().find_upstream_modules("pipeline.systems.subgoals.contest")
    assert "pipeline.systems.subgoals.perfect" in used_from({"pipeline.systems.subgoals.contest"})
    assert "pipeline.planning.optimistic" in places_of(find_system("subgoals"), "evaluate")


@pytest.mark.parametrize("stage", ["harvest", "evaluate"])
def test_what_makes_finished_work_stale_is_the_code_that_dvc_watches(stage: str) -> None:
    """A unit of work found on the disk is taken up only if all code that made it is still the same.

    The system's folder joins it as that of the running one, a competitor's own part by itself; how units are kept,
    what the job is made of and which network was chosen show in the units and in the fingerprint.
    """
    code = importlib.import_module(f"pipeline.stages.{stage}").CODE
    apart = {*(f"pipeline/stages/{name}.py" for name in ("units", "jobs", "networks")), SYSTEM, PARTS}
    assert {f"pipeline/{package}" for package in code} == code_deps(stage) - apart


def test_what_makes_a_finished_training_stale_is_the_code_of_the_fit() -> None:
    """What reads and lays out the datums shows in the examples, whose fingerprint the fit looks at too."""
    fit = {source_of(module) for module in used_from({"pipeline.learning.fit"})} - WITHOUT_EFFECT
    code = {(ROOT / "pipeline" / package).resolve().relative_to(ROOT).as_posix() for package in training.CODE}
    network = {"models", *(f"pipeline/systems/subgoals/{name}.py" for name in ("training", "scaling"))}
    assert code == fit | network
    assert code - network <= code_deps("train")
    assert {"models", SYSTEM} <= {*code_deps("train"), *PIPELINE["train"]["deps"]}


@pytest.mark.parametrize("stage", STAGES)
def test_tracked_keys_are_the_ones_the_stage_reads(stage: str) -> None:
    (tracked,) = (entry["artifacts/config.yaml"] for entry in PIPELINE[stage]["params"])
    source = (ROOT / "pipeline" / "stages" / f"{stage}.py").read_text(encoding="utf-8")
    read = set(re.findall(r'typed\(\w+, raw, "(\w+)"\)', source)) - {"execution", "tracking"}
    if "job_of(raw, system, work, SECTIONS)" in source:
        read |= {*importlib.import_module(f"pipeline.stages.{stage}").SECTIONS}
    if "system_of(raw)" in source:
        read.add("system")
    assert set(tracked) == {"seed", *read}
    assert ("system" in tracked) == (stage in PLACES)


@pytest.mark.parametrize("stage", STAGES)
def test_stage_word_is_the_same_everywhere(stage: str) -> None:
    assert f"-m pipeline.stages.{stage} " in PIPELINE[stage]["cmd"]
    own = [name for name in known_systems() if stage in find_system(name).settings]
    for option in own if stage in OWN else ["default"]:
        assert (ROOT / "conf" / stage / f"{option}.yaml").is_file()
    (out,) = PIPELINE[stage]["outs"]
    assert (out if isinstance(out, str) else next(iter(out))) == f"artifacts/{stage}"


def test_params_yaml_fills_in_what_dvc_yaml_leaves_open() -> None:
    params = yaml.safe_load((ROOT / "params.yaml").read_text(encoding="utf-8"))
    open_ = set(re.findall(r"\$\{(\w+)\}", (ROOT / "dvc.yaml").read_text(encoding="utf-8")))
    assert open_ == {"data", "parts", "system"}
    assert all((ROOT / params[name]).is_dir() for name in open_)
    assert set(PIPELINE["compose"]["params"]) == set(params) == set(Request.__dataclass_fields__)
    assert {SYSTEM, PARTS, "conf"} <= set(PIPELINE["compose"]["deps"])


def test_data_flows_one_way() -> None:
    assert list(PIPELINE) == ["compose", *STAGES]
    made: set[str] = set()
    for name, stage in PIPELINE.items():
        needed = {dep for dep in stage["deps"] if dep.startswith("artifacts/")}
        assert needed <= made, f"{name} reads what no earlier stage makes"
        made |= {f"artifacts/{name}"}
