"""The page names the networks that drove, and says nothing of a training that was not theirs."""

import json
from pathlib import Path

from pipeline.files import digest_file, write_json
from pipeline.reports.inputs import read_inputs
from pipeline.reports.networks import ELSEWHERE, networks
from pipeline.stages.report import report
from tests.reports.synthetic import write_artifacts
from tests.reports.test_report import config


def driven_by(artifacts: Path, digest: str) -> Path:
    path = artifacts / "evaluate/summary.json"
    summary = json.loads(path.read_text(encoding="utf-8"))
    for found in summary["competitors"].values():
        if found["role"] == "candidate":
            found |= {"weights": digest, "made_with": {"sensor.max_range_m": 7.25, "train.seed": 31}}
    write_json(path, summary)
    return artifacts


def page_of(artifacts: Path) -> str:
    report(config(artifacts))
    return (artifacts / "report/report.html").read_text(encoding="utf-8")


def test_a_network_from_elsewhere_is_named_and_no_training_told(tmp_path: Path) -> None:
    artifacts = driven_by(write_artifacts(tmp_path), "ab" * 32)
    (artifacts / "train/network.safetensors").write_bytes(b"another one")
    page = page_of(artifacts)
    inputs = read_inputs(artifacts)
    assert inputs.elsewhere
    assert (inputs.train, inputs.harvest, inputs.curves, inputs.missing) == ({}, {}, {}, [])
    assert ELSEWHERE in page
    assert "ab" * 32 in page
    assert "sensor.max_range_m" in page
    assert "7.25" in page
    assert 'id="training"' not in page
    assert 'id="data"' not in page


def test_a_network_of_this_run_stands_beside_its_training(tmp_path: Path) -> None:
    artifacts = write_artifacts(tmp_path)
    weights = artifacts / "train/network.safetensors"
    weights.write_bytes(b"ours")
    page = page_of(driven_by(artifacts, digest_file(weights)))
    assert not read_inputs(artifacts).elsewhere
    assert ELSEWHERE not in page
    assert digest_file(weights) in page
    assert 'id="training"' in page


def test_settings_stand_side_by_side_for_several_networks() -> None:
    summary = {
        "competitors": {
            "optimistic": {"title": "optimistic", "weights": None, "made_with": None},
            "one": {
                "title": "seed 1",
                "weights": "11",
                "made_with": {"train.seed": 1, "harvest.splits": ["train", "x"]},
            },
            "two": {"title": "seed 2", "weights": "22", "made_with": {"train.seed": 2}},
        }
    }
    (table,) = networks(summary, elsewhere=False)
    assert "optimistic" not in table
    assert '<th scope="row">train.seed</th><td>1</td><td>2</td>' in table
    assert '<th scope="row">harvest.splits</th><td>train, x</td><td>-</td>' in table
    assert networks({"competitors": {"optimistic": {"title": "o"}}}, elsewhere=False) == []
