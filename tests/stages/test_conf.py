"""Every shipped configuration composes and is typed; what Hydra refuses reaches the user in plain words."""

from pathlib import Path

import pytest
import yaml

from pipeline.errors import ConfigError
from pipeline.stages.checking import typed
from pipeline.stages.compose import NO_DATA, ROOT_KEYS, Request, check, checked_request, read_request, section_types
from pipeline.stages.composing import CONF, composed
from pipeline.stages.requests import requested, write_request

EXPERIMENTS = sorted(file.stem for file in (CONF / "experiment").glob("*.yaml"))
OPTIONS = sorted(
    (folder.name, file.stem)
    for folder in CONF.iterdir()
    if folder.is_dir() and folder.name != "experiment"
    for file in folder.glob("*.yaml")
)

# Real floors have no default place.
SOME_DATA = ["plans.root=some/folder"]


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_experiment_is_typed(experiment: str) -> None:
    raw = composed([f"experiment={experiment}", *SOME_DATA])
    check(raw)
    assert raw.experiment_name == experiment


@pytest.mark.parametrize(("group", "option"), OPTIONS)
def test_every_option_is_typed(group: str, option: str) -> None:
    typed(section_types()[group], composed([f"{group}={option}", *SOME_DATA]), group)


def test_the_default_experiment_is_the_demo() -> None:
    assert composed() == composed(["experiment=demo"])
    assert set(composed()) == set(ROOT_KEYS)


REFUSED = [
    ("experiment=dmo", ("no conf/experiment/dmo.yaml", "Did you mean demo?", "guided_maze")),
    ("plans=guided_mazes", ("no conf/plans/guided_mazes.yaml", "Did you mean guided_maze?")),
    ("harvest.max_stepz=3", ("unknown key harvest.max_stepz", "Did you mean harvest.max_steps?")),
    ("harvst.max_steps=3", ("unknown key harvst.max_steps", "harvest")),
    ("exprimnt=demo", ("unknown key exprimnt", "Did you mean experiment?")),
    ("seeed=3", ("unknown key seeed", "Did you mean seed?")),
    ("harvest", ("'harvest' is not an override", "key=value")),
    ("a=[", ("'a=[' is not an override",)),
]


@pytest.mark.parametrize(("override", "expected"), REFUSED)
def test_composition_names_the_key_and_the_nearest(override: str, expected: tuple[str, ...]) -> None:
    with pytest.raises(ConfigError) as refusal:
        composed([override])
    for part in expected:
        assert part in str(refusal.value)


TYPED = [
    ("+sensor.beam=3", "unknown key sensor.beam. Did you mean sensor.beams?"),
    ("+colour=red", "unknown key colour"),
    ("sensor.max_range_m=far", "sensor.max_range_m = 'far': expected a number"),
    ("robot.step_m=-1", r"robot.step_m = -1"),
    ("tracking.enabled=perhaps", "tracking.enabled = 'perhaps': expected true or false"),
    ("seed=-1", "seed = -1"),
    ("experiment_name=null", "experiment_name = None"),
    ("artifacts=null", "artifacts = None"),
]


@pytest.mark.parametrize(("override", "expected"), TYPED)
def test_the_whole_configuration_is_checked(override: str, expected: str) -> None:
    with pytest.raises(ConfigError, match=expected):
        check(composed([override]))


def test_the_shipped_request_is_the_demo(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CONF.parent)
    content = yaml.safe_load(Path("params.yaml").read_text(encoding="utf-8"))
    assert set(content) == {"experiment", "overrides", "data"}
    check(composed(read_request(Path("params.yaml")).as_overrides()))


BAD_REQUESTS = [
    ("experimnt: demo", "unknown key experimnt. Did you mean experiment?"),
    ("overrides: train.steps=3", "expected a list of texts"),
    ("overrides: [artifacts=elsewhere]", "DVC keeps outputs in artifacts/"),
    ("overrides: [plans.root=floors]", "set the key data"),
    ("overrides: [experiment=tiny]", "set the key experiment"),
    ("data: no/such/folder", "no/such/folder: no such file or folder"),
    ("- demo", "expected the keys experiment, overrides, data"),
    ("experiment: [", "cannot be read"),
    ("!!python/object/apply:os.getcwd []", "cannot be read"),
]


@pytest.mark.parametrize(("text", "expected"), BAD_REQUESTS)
def test_bad_requests_are_refused(text: str, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CONF.parent)
    (tmp_path / "params.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as refusal:
        read_request(tmp_path / "params.yaml")
    assert expected in str(refusal.value)


def test_the_command_line_becomes_a_request(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    floors = tmp_path / "my floors, 2nd"
    floors.mkdir()
    request = requested(["experiment=mit_floors", f"plans.root={floors}", "seed=3"])
    assert request == Request(experiment="mit_floors", overrides=["seed=3"], data=str(floors))
    raw = composed(request.as_overrides())
    assert (raw.plans.root, raw.seed) == (str(floors), 3)
    monkeypatch.chdir(tmp_path)
    Path("params.yaml").write_text("# What runs.\nexperiment: demo\n", encoding="utf-8")
    write_request(request)
    assert Path("params.yaml").read_text(encoding="utf-8").startswith("# What runs.\nexperiment: mit_floors\n")
    assert read_request(Path("params.yaml")) == request


def test_generated_plans_need_no_data(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(CONF.parent)
    request = checked_request(Request())
    assert request.data == NO_DATA
    assert request.as_overrides() == ["experiment=demo"]
