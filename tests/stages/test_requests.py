"""What the command line asks for, on top of the last request; params.yaml is put back when nothing came of it."""

from pathlib import Path

import pytest
import yaml

from pipeline.errors import ConfigError
from pipeline.stages.compose import NO_DATA, Request
from pipeline.stages.composing import CONF, composed
from pipeline.stages.requests import described, fallbacks, last_request, requested, trying

LAST = Request(experiment="guided_maze", overrides=["harvest.max_steps=90", "train.steps=500"])


@pytest.fixture(autouse=True)
def at_the_root(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CONF.parent)


def test_what_is_not_named_stays() -> None:
    request = requested(["train.steps=5"], LAST)
    assert request == Request(experiment="guided_maze", overrides=["harvest.max_steps=90", "train.steps=5"])


def test_an_experiment_starts_anew(tmp_path: Path) -> None:
    last = Request(experiment="mit_floors", overrides=["seed=3"], data=str(tmp_path))
    assert requested(["experiment=office", "seed=4"], last) == Request(experiment="office", overrides=["seed=4"])


def test_data_stay_with_their_experiment(tmp_path: Path) -> None:
    last = Request(experiment="mit_floors", overrides=[], data=str(tmp_path))
    assert requested(["seed=4"], last) == Request(experiment="mit_floors", overrides=["seed=4"], data=str(tmp_path))
    assert requested(["~plans.root"], last).data == NO_DATA


def test_a_tilde_takes_an_override_back() -> None:
    assert requested(["~train.steps"], LAST).overrides == ["harvest.max_steps=90"]
    assert requested(["~harvest"], LAST).overrides == ["train.steps=500"]
    assert requested(["~experiment"], LAST).experiment == "demo"


def test_a_tilde_says_what_it_falls_back_to() -> None:
    request = requested(["~train.steps"], Request(overrides=["train.steps=5"]))
    lines = fallbacks(["~train.steps"], composed(request.as_overrides()), request)
    assert lines == ["~train.steps: falls back to 8000, as experiment=demo has it"]
    with pytest.raises(ConfigError, match=r"unknown key train\.stepz\. Did you mean train\.steps\?"):
        fallbacks(["~train.stepz"], composed(), Request())


def test_what_runs_is_said_with_what_no_longer_does(tmp_path: Path) -> None:
    request = requested(["train.steps=5"], LAST)
    assert described(request, LAST) == "runs experiment=guided_maze harvest.max_steps=90 train.steps=5"
    assert described(requested(["experiment=demo"], LAST), LAST) == (
        "runs experiment=demo; no longer harvest.max_steps=90 train.steps=500"
    )
    data = Request(experiment="mit_floors", data=str(tmp_path))
    assert described(data, LAST).startswith(f"runs experiment=mit_floors plans.root={tmp_path}; no longer ")


@pytest.mark.parametrize(("entry", "expected"), [("--dry", "follow --"), ("harvest", "'harvest' is not an override")])
def test_what_is_no_override_is_refused(entry: str, expected: str) -> None:
    with pytest.raises(ConfigError, match=expected):
        requested([entry], LAST)


def test_lost_data_do_not_bar_another_experiment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "params.yaml").write_text("experiment: mit_floors\ndata: /gone\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    last = last_request()
    monkeypatch.chdir(CONF.parent)
    assert requested(["experiment=demo"], last).experiment == "demo"
    with pytest.raises(ConfigError, match=r"/gone: no such file or folder"):
        requested(["seed=3"], last)


def test_a_request_that_is_not_kept_leaves_no_trace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    params = tmp_path / "params.yaml"
    params.write_text("# Mine.\nexperiment: demo   # as ever\n", encoding="utf-8")
    before = params.read_bytes(), params.stat().st_mtime_ns
    with trying(LAST):
        assert yaml.safe_load(params.read_text(encoding="utf-8"))["experiment"] == "guided_maze"
    assert (params.read_bytes(), params.stat().st_mtime_ns) == before
    with pytest.raises(KeyboardInterrupt), trying(LAST):
        raise KeyboardInterrupt
    assert params.read_bytes() == before[0]
    with trying(LAST) as trial:
        trial.keep = True
    assert yaml.safe_load(params.read_text(encoding="utf-8"))["experiment"] == "guided_maze"
    params.unlink()
    with trying(LAST):
        assert params.exists()
    assert not params.exists()
