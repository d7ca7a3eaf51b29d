"""The stages as a person or DVC runs them: one process each, files between them, one line when something is wrong."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from mlflow import MlflowClient

from pipeline.stages.compose import STAGES

ROOT = Path(__file__).resolve().parents[2]


def run_stage(stage: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name not in ("MLFLOW_TRACKING_URI",)}
    return subprocess.run(
        [sys.executable, "-m", f"pipeline.stages.{stage}", *arguments],
        cwd=ROOT,
        env=environment | {"MLFLOW_DISABLE_TELEMETRY": "true"},
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run every stage on tiny mazes with the composed file, as dvc.yaml does; tracking at the last one only."""
    artifacts = tmp_path_factory.mktemp("run") / "artifacts"
    store = f"tracking.uri=sqlite:///{artifacts.parent / 'mlflow.db'}"
    quiet = ("execution.workers=1", "execution.progress=false")
    done = run_stage("compose", "experiment=tiny", f"artifacts={artifacts}", store, *quiet, "tracking.enabled=false")
    assert done.returncode == 0, done.stderr
    for stage in STAGES:
        tracked = ["tracking.enabled=true"] if stage == "report" else []
        done = run_stage(stage, "--config", str(artifacts / "config.yaml"), *tracked)
        assert done.returncode == 0, f"{stage}: {done.stderr}"
    return artifacts


@pytest.mark.slow
def test_stages_run_in_order(finished: Path) -> None:
    assert {path.name for path in finished.iterdir()} == {"config.yaml", *STAGES}
    trials = pq.read_table(finished / "evaluate" / "trials.parquet").to_pandas()
    assert set(trials["competitor"]) == {"optimistic", "learned", "perfect", "known_map"}
    assert set(trials["ending"]) == {"reached"}
    assert json.loads((finished / "harvest" / "harvest.json").read_text(encoding="utf-8"))["datums"] > 0
    page = (finished / "report" / "report.html").read_text(encoding="utf-8")
    assert "<svg" in page or "data:image" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert not list(finished.rglob("*.partial"))


@pytest.mark.slow
def test_the_last_stage_is_in_the_store(finished: Path) -> None:
    client = MlflowClient(f"sqlite:///{finished.parent / 'mlflow.db'}")
    experiment = client.get_experiment_by_name("tiny")
    (run,) = client.search_runs([experiment.experiment_id])
    assert run.info.run_name == "report"
    assert run.data.params["sensor.beams"] == "1024"
    assert run.data.metrics
    assert any(entry.path == "report.html" for entry in client.list_artifacts(run.info.run_id))


@pytest.mark.slow
def test_hydra_leaves_no_folders(finished: Path) -> None:
    assert not (ROOT / "outputs").exists()
    assert not (ROOT / "multirun").exists()


REFUSED = [
    ("plans", ["plans.cuonts.train=3"], ("unknown key plans.cuonts.train", "Did you mean plans.counts.train?")),
    ("plans", ["experiment=tinny"], ("no conf/experiment/tinny.yaml", "Did you mean tiny?")),
    ("plans", ["plans.source=files"], ("plans.root",)),
    ("rasterize", [], ("plans.parquet",)),
    ("rasterize", ["+rasterize.resolution=1"], ("unknown key rasterize.resolution",)),
    ("rasterize", ["rasterize.resolution_m=fine"], ("rasterize.resolution_m = 'fine'", "a number")),
    ("rasterize", ["--config", "no/such.yaml"], ("no/such.yaml: no such file", "pipeline.stages.compose")),
]


@pytest.mark.parametrize(("stage", "arguments", "expected"), REFUSED)
def test_a_refusal_is_one_line_and_leaves_nothing(
    stage: str, arguments: list[str], expected: tuple[str, ...], tmp_path: Path
) -> None:
    artifacts = tmp_path / "artifacts"
    given = arguments if "--config" in arguments else ["experiment=tiny", *arguments, f"artifacts={artifacts}"]
    if any(entry.startswith("experiment=") for entry in arguments):
        given.remove("experiment=tiny")
    done = run_stage(stage, *given)
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("error: ")
    for part in expected:
        assert part in line
    assert not artifacts.exists()


def test_help_names_the_groups_and_the_stages() -> None:
    done = run_stage("plans", "--help")
    assert done.returncode == 0
    for part in (
        f"experiment: {', '.join(sorted(file.stem for file in (ROOT / 'conf/experiment').glob('*.yaml')))}",
        "--config FILE",
        "max_range_m: 5.0",
    ):
        assert part in done.stdout
