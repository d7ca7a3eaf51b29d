"""A system is found by its name or its place, and every system here keeps what its record promises."""

import dataclasses
import inspect
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from pipeline.errors import ConfigError, PartError
from pipeline.evaluation.settings import EvaluateSettings
from pipeline.files import write_text
from pipeline.parts import add_to_path, find_part, resolve
from pipeline.reports.figures import SystemFigures
from pipeline.stages.compose import OWN
from pipeline.stages.composing import CONF, composed
from pipeline.stages.jobs import system_of
from pipeline.systems.system import Contest, Harvest, System, find_system, known_systems

ROOT = Path(__file__).resolve().parents[2]
KNOWN = known_systems()

OUTSIDE = """
from pipeline.systems.system import System
SYSTEM = System(name="rover", title="Roving", settings={})
title = "no system"
"""


@pytest.fixture
def outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    package = f"rovers_{tmp_path.name.replace('-', '_')}"
    write_text(tmp_path / package / "__init__.py", "")
    write_text(tmp_path / package / "system.py", OUTSIDE)
    write_text(tmp_path / package / "broken.py", "raise RuntimeError('out of fuel')\n")
    monkeypatch.setattr("sys.path", list(sys.path))
    add_to_path(tmp_path)
    return package


def test_a_system_is_a_folder_with_a_file_of_its_name() -> None:
    folders = {file.parent.name for file in (ROOT / "pipeline" / "systems").glob("*/system.py")}
    assert set(KNOWN) == folders
    assert "subgoals" in KNOWN
    assert sorted(KNOWN) == KNOWN


def test_a_system_of_anybodys_is_found_by_its_place(outside: str, tmp_path: Path) -> None:
    found = find_system(f"{outside}.system:SYSTEM")
    assert (found.name, found.title, found.folder) == ("rover", "Roving", tmp_path / outside)
    assert found.harvest is found.training is found.contest is found.figures is None


WRONG = [
    ("subgoal", ConfigError, "system = subgoal: expected one of "),
    ("system", ConfigError, "(conf/system/), or your own as my_package.my_module:SYSTEM"),
    ("../subgoals", ConfigError, "system = ../subgoals: expected one of "),
    ("{outside}.system:title", ConfigError, ".system:title is a str, expected a System"),
    ("{outside}.system:SYSTEMS", ConfigError, "has no 'SYSTEMS'. Did you mean SYSTEM?"),
    ("{outside}.sytem:SYSTEM", ConfigError, "no module '{outside}.sytem'"),
    ("{outside}.broken:SYSTEM", PartError, "cannot be imported: RuntimeError: out of fuel (broken.py, line 1)"),
]


@pytest.mark.parametrize(("name", "kind", "said"), WRONG)
def test_what_is_no_system_is_one_sentence(outside: str, name: str, kind: type[Exception], said: str) -> None:
    with pytest.raises(kind) as refusal:
        find_system(name.format(outside=outside))
    message = str(refusal.value)
    assert message.startswith("system = ")
    assert said.format(outside=outside) in message
    assert "\n" not in message


@pytest.mark.parametrize("name", KNOWN)
class TestEverySystem:
    def test_is_called_as_its_folder_and_its_option(self, name: str) -> None:
        system = find_system(name)
        assert system.name == name
        assert system.title.strip() == system.title != ""
        assert system.folder == ROOT / "pipeline" / "systems" / name
        assert (CONF / "system" / f"{name}.yaml").is_file()
        assert system_of(composed([f"system={name}"])) == system

    def test_types_its_sections_by_frozen_records(self, name: str) -> None:
        settings = find_system(name).settings
        assert set(settings) <= set(OWN)
        for section, kind in settings.items():
            assert dataclasses.is_dataclass(kind), section
            assert kind.__dataclass_params__.frozen, section
            assert kind.__module__.startswith((f"pipeline.systems.{name}.", "pipeline.evaluation.settings"))
        if find_system(name).contest is not None:
            assert issubclass(settings["evaluate"], EvaluateSettings)

    def test_has_at_each_place_what_the_stage_takes(self, name: str) -> None:
        system = find_system(name)
        assert "__main__" not in str(system)
        if system.harvest is not None:
            harvest = resolve(system.harvest)
            assert isinstance(harvest, Harvest)
            assert {"scratch", "job"} <= set(inspect.signature(harvest.make).parameters)
            assert harvest.folder and "/" not in harvest.folder
        if system.training is not None:
            assert {"job", "logger", "progress"} <= set(inspect.signature(resolve(system.training)).parameters)
        if system.contest is not None:
            contest = resolve(system.contest)
            assert isinstance(contest, Contest)
            assert contest.parts
            assert "trials" not in contest.tables, "that is the name of everybody's table"
        if system.figures is not None:
            assert isinstance(resolve(system.figures), SystemFigures)

    def test_has_a_part_behind_each_name_that_a_competitor_may_use(self, name: str) -> None:
        system = find_system(name)
        if system.contest is None:
            return
        contest: Contest = resolve(system.contest)
        for use in contest.parts:
            assert callable(find_part("evaluate.competitors.x.use", use, contest.parts).make)
        for table in contest.tables.values():
            assert table([]).num_rows == 0
        shipped = composed([f"system={name}"]).evaluate.competitors
        assert isinstance(shipped, Mapping)
        assert {entry.use for entry in shipped.values()} <= set(contest.parts)

    def test_lets_planners_drive_without_a_network_library(self, name: str) -> None:
        """A worker that drives loads neither torch nor what draws figures."""
        code = (
            "import sys\n"
            "from pipeline.parts import find_part, resolve\n"
            "from pipeline.systems.system import find_system\n"
            f"system = find_system({name!r})\n"
            "contest = resolve(system.contest) if system.contest else None\n"
            "[find_part('x', use, contest.parts) for use in (contest.parts if contest else ())]\n"
            "print(sorted({'torch', 'lightning', 'matplotlib', 'mlflow'} & set(sys.modules)))\n"
        )
        done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=120)
        assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


def test_a_system_is_a_record_that_cannot_be_changed() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        find_system(KNOWN[0]).title = "other"  # type: ignore[misc]
    assert System(name="a", title="b", settings={}) == System(name="a", title="b", settings={})
