"""A network recipe of one's own: a system that is ours but for its training."""

import json
import sys
from pathlib import Path

import pytest

from pipeline.errors import HinterlandError
from pipeline.parts import add_to_path
from pipeline.stages.composing import composed
from pipeline.stages.train import train

SYSTEM = """
from dataclasses import replace

from pipeline.systems.subgoals.system import SYSTEM as SUBGOALS

SYSTEM = replace(SUBGOALS, name="mine", training="{package}.fit:train")
BROKEN = replace(SUBGOALS, name="broken", training="{package}.fit:broken")
LOST = replace(SUBGOALS, name="lost", training="{package}.fit:trian")
"""

FIT = """
from pipeline.files import write_json
from pipeline.systems.subgoals.settings import TrainConfig
from pipeline.systems.system import Trained


def train(job, *, logger, progress):
    file = job.folder("train") / "mine.json"
    write_json(file, {"steps": job.section("train", TrainConfig).steps})
    return Trained(summary={"by": "mine"}, scores={}, files=[file], model=None, data=(job.folder("harvest"), "d"),
                   sentence="done")


def broken(job, *, logger, progress):
    return {}["weights"]
"""


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    name = f"own_{tmp_path.name.replace('-', '_')}"
    (tmp_path / name).mkdir()
    (tmp_path / name / "system.py").write_text(SYSTEM.format(package=name), encoding="utf-8")
    (tmp_path / name / "fit.py").write_text(FIT, encoding="utf-8")
    monkeypatch.setattr("sys.path", list(sys.path))
    add_to_path(tmp_path)
    return name


def request(package: str, attribute: str, folder: Path):
    raw = composed(["experiment=tiny", "train.steps=7", f"artifacts={folder}"])
    raw.system = f"{package}.system:{attribute}"
    return raw


def test_an_own_recipe_trains_for_the_stage(package: str, tmp_path: Path) -> None:
    train(request(package, "SYSTEM", tmp_path / "a"))
    assert json.loads((tmp_path / "a" / "train" / "mine.json").read_text(encoding="utf-8")) == {"steps": 7}
    assert json.loads((tmp_path / "a" / "train" / "train.json").read_text(encoding="utf-8")) == {"by": "mine"}


def test_a_recipe_that_is_not_there_is_named(package: str, tmp_path: Path) -> None:
    with pytest.raises(HinterlandError, match=r"fit has no 'trian'\. Did you mean train\?"):
        train(request(package, "LOST", tmp_path / "a"))


def test_a_recipe_that_fails_is_named_with_its_line(package: str, tmp_path: Path) -> None:
    with pytest.raises(
        HinterlandError, match=rf"^{package}\.fit:broken failed: KeyError: 'weights' \(fit\.py, line 15\)"
    ):
        train(request(package, "BROKEN", tmp_path / "a"))
