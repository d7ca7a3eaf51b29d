"""What stages make of a system: its typed job, and one sentence for each part that it does without."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict
from math import isnan
from pathlib import Path
from typing import Any

import pytest
from omegaconf import DictConfig, OmegaConf

from pipeline.errors import ConfigError
from pipeline.evaluation.trials import read_episodes, read_trials, trial_rows
from pipeline.files import digest_file, write_json, write_text
from pipeline.grids.occupancy import Cell, center_of
from pipeline.grids.sampling import ends_between
from pipeline.grids.store import GridRecord, Pair, write_pairs, write_worlds
from pipeline.parts import add_to_path
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.stages.compose import check
from pipeline.stages.composing import composed
from pipeline.stages.door import StageResult, workspace
from pipeline.stages.evaluate import evaluate
from pipeline.stages.harvest import harvest
from pipeline.stages.jobs import fingerprint_of, job_of, made_with, system_of
from pipeline.stages.report import report
from pipeline.stages.train import train
from pipeline.systems.subgoals.settings import HarvestConfig
from pipeline.systems.system import find_system
from tests.worlds import TWO_ROOMS, draw

ROOT = Path(__file__).resolve().parents[2]

# A system without any part, and one whose planners drive but learn nothing.
OWN = """
from dataclasses import asdict

import numpy as np

from pipeline.evaluation.competitors import Outcome
from pipeline.evaluation.driving import enter_driver, rules_of
from pipeline.evaluation.settings import EvaluateSettings
from pipeline.evaluation.trials import Replay
from pipeline.systems.system import Contest, System

def enter(competitor, part, settings, job):
    return enter_driver(competitor, part, settings, rules_of(job.sections["sensor"], job.sections["robot"], None))

CONTEST = Contest(
    parts={"plain": "pipeline.planning.optimistic:OptimisticPlanner", "truth": "pipeline.evaluation.driving:KnownMap"},
    enter=enter,
)
BARE = System(name="bare", title="Wandering", settings={})
DRIVES = System(
    name="drives", title="Plain driving", settings={"evaluate": EvaluateSettings}, contest=f"{__name__}:CONTEST",
)

class Stays:
    def drive(self, ground, pair, rng):
        cells = ground.record.grid.cells
        home = pair.start.row * cells.shape[1] + pair.start.col
        cost = 1.0 if pair.goal == (-1, -1) else 2.0
        return Outcome(cost_m=cost, ending="covered", replay=Replay(cells, np.array([home, home], dtype=np.int32)))

AIMLESS = Contest(parts={"stays": f"{__name__}:Stays"}, enter=lambda *given: Stays(), goals=False)
STAYS = System(
    name="stays", title="Staying", settings={"evaluate": EvaluateSettings}, contest=f"{__name__}:AIMLESS",
)
"""


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    name = f"systems_{tmp_path.name.replace('-', '_')}"
    folder = tmp_path / "parts"
    write_text(folder / f"{name}.py", OWN)
    monkeypatch.setattr("sys.path", list(sys.path))
    add_to_path(folder)
    return name


def configuration(artifacts: Path, system: str, **sections: Any) -> DictConfig:
    return OmegaConf.create(
        {
            "seed": 3,
            "artifacts": str(artifacts),
            "experiment_name": "test",
            "system": system,
            "execution": {"workers": 1, "progress": False},
            "tracking": {"enabled": False},
            "sensor": {"beams": 256, "max_range_m": 4.0},
            "robot": {"radius_m": 0.0, "step_m": 0.7},
            "report": {"dpi": 40},
        }
        | sections
    )


def write_grids(artifacts: Path) -> None:
    drawn = draw(*TWO_ROOMS)
    identity = ("two_rooms", "hall", "drawn", "test")
    ends = [(drawn.start, drawn.goal), (Cell(2, 2), Cell(4, 11)), (Cell(1, 9), Cell(5, 1))]
    write_worlds(artifacts / "rasterize", [GridRecord(*identity, drawn.grid, 0.0)])
    write_pairs(
        artifacts / "rasterize",
        [
            Pair(
                f"two_rooms/{index}",
                *identity,
                *ends_between(drawn.grid, *(center_of(drawn.grid, end) for end in pair), plan_id="p", robot_radius=0.0),
            )
            for index, pair in enumerate(ends)
        ],
    )


STAGES: list[tuple[str, Callable[[DictConfig], StageResult], str]] = [
    ("harvest", harvest, "Wandering learns from nothing"),
    ("train", train, "Wandering has no network"),
    ("evaluate", evaluate, "Wandering compares nobody"),
    ("report", report, "Wandering compares nobody"),
]


@pytest.mark.parametrize(("stage", "body", "why"), STAGES)
def test_a_stage_without_a_part_says_so_and_leaves_a_file(
    own: str, tmp_path: Path, stage: str, body: Callable[[DictConfig], StageResult], why: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    artifacts = tmp_path / "artifacts"
    result = body(configuration(artifacts, f"{own}:BARE"))
    file = artifacts / stage / f"{stage}.json"
    assert json.loads(file.read_text(encoding="utf-8")) == {"nothing": why}
    assert (result.files, dict(result.metrics), result.model) == ([file], {}, None)
    told = capsys.readouterr()
    assert (told.out, told.err) == (f"{stage}: nothing to do. {why}\n", "")
    assert {path.name for path in artifacts.iterdir()} == {stage}


def test_no_page_of_another_system_stays_behind(own: str, tmp_path: Path) -> None:
    left = [tmp_path / "report" / name for name in ("report.html", "cost_table.txt", "figures/ratios.png")]
    for file in left:
        write_text(file, "of another system")
    report(configuration(tmp_path, f"{own}:BARE"))
    assert not any(file.exists() for file in left)


def test_the_report_names_the_parts_that_a_system_does_without(own: str, tmp_path: Path) -> None:
    artifacts = tmp_path / "artifacts"
    write_grids(artifacts)
    write_text(artifacts / "train" / "curves.parquet", "of another system, whose training lies here still")
    competitors = {"simple": {"role": "baseline", "use": "plain"}, "best": {"role": "bound", "use": "truth"}}
    section = {"competitors": competitors, "recorded_trials": 1}
    raw = configuration(artifacts, f"{own}:DRIVES", evaluate=section)
    for body in (harvest, train, evaluate, report):
        body(raw)
    page = (artifacts / "report" / "report.html").read_text(encoding="utf-8")
    for said in ("harvest: Plain driving learns from nothing.", "train: Plain driving has no network."):
        assert page.count(said) == 1
    assert "Training curves" not in page
    summary = json.loads((artifacts / "evaluate" / "summary.json").read_text(encoding="utf-8"))
    assert {name: found["finished"] for name, found in summary["competitors"].items()} == {"simple": 3, "best": 3}


def test_a_contest_without_goals_has_none_in_tables_and_pictures(own: str, tmp_path: Path) -> None:
    write_grids(tmp_path)
    competitors = {"one": {"role": "baseline", "use": "stays"}, "two": {"role": "candidate", "use": "stays"}}
    raw = configuration(tmp_path, f"{own}:STAYS", evaluate={"competitors": competitors, "recorded_trials": 2})
    for body in (harvest, train, evaluate, report):
        body(raw)
    rows = trial_rows(read_trials(tmp_path / "evaluate" / "trials.parquet"))
    assert {(row.cost_m, row.ending) for row in rows} == {(1.0, "covered")} and len(rows) == 6
    assert all(isnan(row.goal_x_m) and isnan(row.goal_y_m) and row.start_x_m > 0.0 for row in rows)
    episodes = read_episodes(tmp_path / "evaluate" / "episodes.parquet")
    assert {(row.goal_row, row.goal_col) for row in episodes} == {(-1, -1)}
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert "Disc: start." in page and "Star: goal." not in page


def test_a_system_of_ones_own_runs_through_the_door(own: str, tmp_path: Path) -> None:
    """Four processes, as DVC starts them: exit code 0, one sentence each."""
    conf = tmp_path / "parts" / "conf"
    write_text(conf / "system" / "bare.yaml", f"# @package _global_\nsystem: {own}:BARE\n")
    write_text(
        conf / "experiment" / "wander.yaml",
        "# @package _global_\ndefaults:\n  - override /system: bare\n  - override /tracking: 'off'\n\n"
        "experiment_name: wander\n",
    )
    given = ["experiment=wander", f"parts={tmp_path / 'parts'}", f"artifacts={tmp_path / 'artifacts'}"]
    command = [sys.executable, "-m", "pipeline.stages.compose", *given]
    done = subprocess.run(command, cwd=ROOT, env=os.environ, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    for stage, _, why in STAGES:
        command = [sys.executable, "-m", f"pipeline.stages.{stage}", "--config", f"{tmp_path}/artifacts/config.yaml"]
        done = subprocess.run(command, cwd=ROOT, env=os.environ, capture_output=True, text=True, timeout=120)
        assert (done.returncode, done.stdout, done.stderr) == (0, f"{stage}: nothing to do. {why}\n", "")


def test_a_section_that_a_system_does_not_type_must_be_empty(own: str) -> None:
    raw = composed(["experiment=tiny"])
    raw.system = f"{own}:BARE"
    with pytest.raises(ConfigError) as refusal:
        check(raw)
    assert str(refusal.value).startswith("planner.max_subgoals, ")
    assert str(refusal.value).endswith(": the system bare has nothing to set in the section planner. Take it out")
    for section in ("planner", "harvest", "train", "evaluate"):
        raw[section] = None
    check(raw)


@pytest.mark.parametrize("given", [None, "", 3, ["subgoals"]])
def test_a_system_is_named_by_a_text(given: Any) -> None:
    with pytest.raises(ConfigError, match=r"^system = .*: expected the name of a system \(conf/system/\)"):
        system_of(OmegaConf.create({"system": given}))


def test_a_job_holds_typed_sections_and_a_network_is_bound_to_them(tmp_path: Path) -> None:
    raw = configuration(tmp_path, "subgoals", harvest={"weight_floor_m": 0.5})
    job = job_of(raw, find_system("subgoals"), workspace(raw), ("harvest", "sensor", "robot"))
    assert (job.seed, job.folder("train")) == (3, tmp_path / "train")
    assert job.section("robot", RobotConfig) == RobotConfig(radius_m=0.0, step_m=0.7)
    assert job.section("sensor", SensorConfig).beams == 256
    assert job.section("harvest", HarvestConfig).weight_floor_m == 0.5
    with pytest.raises(TypeError, match="section robot is a RobotConfig, expected SensorConfig"):
        job.section("robot", SensorConfig)
    bound = made_with(job)
    assert {name.partition(".")[0] for name in bound} == {"harvest", "sensor", "robot", "rasterize"}
    assert (bound["robot.step_m"], bound["sensor.max_range_m"], bound["harvest.weight_floor_m"]) == (0.7, 4.0, 0.5)
    assert bound["rasterize.resolution_m"] is None


def test_what_units_depend_on_follows_inputs_settings_and_the_code_of_the_system(own: str, tmp_path: Path) -> None:
    for name in ("grids.parquet", "pairs.parquet"):
        write_json(tmp_path / "rasterize" / name, name)
    raw = configuration(tmp_path, f"{own}:BARE")

    def found(**changes: Any) -> dict[str, Any]:
        changed = OmegaConf.merge(raw, changes)
        assert isinstance(changed, DictConfig)
        system = find_system(f"{own}:BARE")
        job = job_of(changed, system, workspace(changed), ("robot",))
        return fingerprint_of(job, system, tmp_path / "rasterize", ("randomness.py",))

    before = found()
    assert before["grids"] == digest_file(tmp_path / "rasterize" / "grids.parquet")
    assert before["robot"] == asdict(RobotConfig(radius_m=0.0, step_m=0.7))
    assert found(sensor={"beams": 512}) == before, "a section that the stage does not read"
    assert [key for key in before if found(seed=4)[key] != before[key]] == ["seed"]
    assert [key for key in before if found(robot={"step_m": 0.8})[key] != before[key]] == ["robot"]
    (tmp_path / "parts" / f"{own}.py").write_text(OWN + "# edited\n", encoding="utf-8")
    assert [key for key in before if found()[key] != before[key]] == ["code"]
    write_json(tmp_path / "rasterize" / "pairs.parquet", "others")
    assert sorted(key for key in before if found()[key] != before[key]) == ["code", "pairs"]
