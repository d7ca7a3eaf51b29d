"""One seed for the data, one for the training: the second changes no bit of the first's."""

import hashlib
from pathlib import Path

import pytest

from pipeline.stages.composing import composed
from pipeline.stages.harvest import harvest
from pipeline.stages.plans import plans
from pipeline.stages.rasterize import rasterize
from pipeline.stages.training_seeds import main

SMALL = [
    "experiment=tiny", "plans.counts.train=1", "plans.counts.validation=1", "plans.counts.test=1",
    "execution.workers=1", "execution.progress=false", "tracking.enabled=false", "sensor.beams=256",
]  # fmt: skip


def digests(root: Path, *overrides: str) -> dict[str, str]:
    """Make the data in ``root`` and return the SHA-256 of every file, fingerprints left out as they name folders."""
    raw = composed([*SMALL, f"artifacts={root}", *overrides])
    for stage in (plans, rasterize, harvest):
        stage(raw)
    files = sorted(root.rglob("*.parquet"))
    return {str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def test_the_training_seed_leaves_all_data_bit_by_bit(tmp_path: Path) -> None:
    first = digests(tmp_path / "a", "train.seed=1")
    assert any("harvest" in name for name in first)
    assert digests(tmp_path / "b", "train.seed=2") == first
    assert digests(tmp_path / "c", "train.seed=1", "seed=7") != first


def test_a_summary_that_is_none_ends_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.json").write_text("[1]", encoding="utf-8")
    with pytest.raises(SystemExit):
        main([str(tmp_path / "a.json"), str(tmp_path / "b.json")])
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("a.json: not the summary.json of an evaluate stage, but a JSON list.")
