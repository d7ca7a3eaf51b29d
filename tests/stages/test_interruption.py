"""Killed runs continue to the same table, and the number of workers changes nothing."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pipeline.evaluation.trials import digest, read_trials

ROOT = Path(__file__).resolve().parents[2]
TINY = (
    "experiment=tiny",
    "tracking=off",
    "execution.progress=false",
    "plans.counts.train=24",
    "harvest.pairs_per_shard=2",
)


def command(stage: str, artifacts: Path, *more: str) -> list[str]:
    return [sys.executable, "-m", f"pipeline.stages.{stage}", *TINY, f"artifacts={artifacts}", *more]


def run(stage: str, artifacts: Path, *more: str) -> None:
    done = subprocess.run(command(stage, artifacts, *more), cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


def harvested(artifacts: Path) -> str:
    return str(json.loads((artifacts / "harvest" / "harvest.json").read_text(encoding="utf-8"))["digest"])


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    artifacts = tmp_path_factory.mktemp("undisturbed") / "artifacts"
    for stage in ("plans", "rasterize", "harvest"):
        run(stage, artifacts, "execution.workers=1")
    return artifacts


def beside(undisturbed: Path, folder: Path) -> Path:
    """Return an artifacts folder with the same plans and grids and nothing else."""
    artifacts = folder / "artifacts"
    artifacts.mkdir()
    for stage in ("plans", "rasterize"):
        (artifacts / stage).symlink_to(undisturbed / stage)
    return artifacts


@pytest.mark.slow
def test_two_workers_harvest_the_same_table(undisturbed: Path, tmp_path: Path) -> None:
    artifacts = beside(undisturbed, tmp_path)
    run("harvest", artifacts, "execution.workers=2")
    assert harvested(artifacts) == harvested(undisturbed)


@pytest.mark.slow
def test_a_harvest_killed_in_the_middle_continues_to_the_same_table(undisturbed: Path, tmp_path: Path) -> None:
    artifacts = beside(undisturbed, tmp_path)
    shards = artifacts / "harvest" / "datums"
    process = subprocess.Popen(
        command("harvest", artifacts, "execution.workers=2"), cwd=ROOT, start_new_session=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    limit = time.monotonic() + 120
    while len(list(shards.glob("part-*.parquet"))) < 3 and time.monotonic() < limit:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    left = {path: path.stat().st_mtime_ns for path in shards.glob("part-*.parquet")}
    assert left, "the run was killed before its first shard"
    assert not (artifacts / "harvest" / "harvest.json").exists(), "the run was over before it was killed"
    run("harvest", artifacts, "execution.workers=2")
    assert harvested(artifacts) == harvested(undisturbed)
    assert all(path.stat().st_mtime_ns == written for path, written in left.items()), "a whole shard was made anew"
    assert not list(shards.glob("*.partial"))


@pytest.mark.slow
def test_another_configuration_takes_up_nothing(undisturbed: Path, tmp_path: Path) -> None:
    artifacts = beside(undisturbed, tmp_path)
    run("harvest", artifacts, "execution.workers=2", "robot.step_m=1.2")
    other = harvested(artifacts)
    run("harvest", artifacts, "execution.workers=2")
    assert other != harvested(undisturbed)
    assert harvested(artifacts) == harvested(undisturbed)


@pytest.mark.slow
def test_two_workers_drive_the_same_trials(undisturbed: Path, tmp_path: Path) -> None:
    digests = []
    for workers in (1, 2):
        folder = tmp_path / str(workers)
        folder.mkdir()
        artifacts = beside(undisturbed, folder)
        run("evaluate", artifacts, f"execution.workers={workers}", "evaluate.competitors.learned=null",
            "evaluate.pairs_per_unit=1")  # fmt: skip
        digests.append(digest(read_trials(artifacts / "evaluate" / "trials.parquet")))
    assert digests[0] == digests[1]
