"""Every shipped configuration composes and is typed; what Hydra refuses reaches the user in plain words."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from pipeline.checking import typed
from pipeline.errors import ConfigError
from pipeline.stages.compose import (
    NO_DATA,
    OWN,
    ROOT_KEYS,
    Request,
    check,
    check_data,
    check_system,
    checked_request,
    compose,
    read_request,
    section_types,
    watched_data,
)
from pipeline.stages.composing import CONF, composed
from pipeline.stages.jobs import system_of
from pipeline.stages.requests import requested, write_request
from pipeline.systems.system import known_systems

EXPERIMENTS = sorted(file.stem for file in (CONF / "experiment").glob("*.yaml"))
OPTIONS = sorted(
    (folder.name, file.stem)
    for folder in CONF.iterdir()
    if folder.is_dir() and folder.name not in ("experiment", "system")
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
    """An option of a section that systems type is named after the system that it belongs to."""
    chosen = [f"system={_owner(option)}"] if group in OWN else []
    raw = composed([*chosen, f"{group}={option}", *SOME_DATA])
    assert raw[group]
    typed(section_types(system_of(raw))[group], raw, group)


def _owner(option: str) -> str:
    return max((name for name in known_systems() if f"{option}_".startswith(f"{name}_")), key=len)


@pytest.mark.parametrize("name", known_systems())
def test_every_system_brings_sections_that_it_types(name: str) -> None:
    """Chosen by one of its experiments: those of other systems may set what it does not have."""
    own = (composed([f"experiment={each}", *SOME_DATA]) for each in EXPERIMENTS)
    raw = next(each for each in own if each.system == name)
    check(raw)
    settings = system_of(raw).settings
    assert {section for section in OWN if raw.get(section) is not None} >= set(settings) & set(OWN)


def test_the_default_experiment_is_the_demo() -> None:
    assert composed() == composed(["experiment=demo"])
    assert set(composed()) == set(ROOT_KEYS)


REFUSED = [
    ("experiment=dmo", ("no conf/experiment/dmo.yaml", "Did you mean demo?", "guided_maze")),
    ("system=subgoal", ("no conf/system/subgoal.yaml", "Did you mean subgoals?")),
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
    assert set(content) == {"experiment", "overrides", "data", "parts", "system"}
    request = read_request(Path("params.yaml"))
    raw = composed(request.as_overrides())
    check(raw)
    check_system(raw, request)


def test_dvc_has_to_watch_the_system_that_runs(tmp_path: Path) -> None:
    request = Request(experiment="tiny", system="pipeline/systems/others")
    raw = composed([*request.as_overrides(), f"artifacts={tmp_path / 'artifacts'}"])
    with pytest.raises(ConfigError) as refusal:
        compose(raw, request)
    assert str(refusal.value) == (
        "system = pipeline/systems/others in params.yaml, but experiment=tiny belongs to pipeline/systems/subgoals: "
        "set the key system to pipeline/systems/subgoals, or run `hinterland experiment=tiny`, which does"
    )
    assert not (tmp_path / "artifacts").exists()
    compose(raw, Request(experiment="tiny", system="pipeline/systems/subgoals"))
    assert (tmp_path / "artifacts" / "config.yaml").is_file()


BAD_REQUESTS = [
    ("experimnt: demo", "unknown key experimnt. Did you mean experiment?"),
    ("overrides: train.steps=3", "expected a list of texts"),
    ("overrides: [artifacts=elsewhere]", "DVC keeps outputs in artifacts/"),
    ("overrides: [plans.root=floors]", "set the key data"),
    ("overrides: [experiment=tiny]", "set the key experiment"),
    ("data: no/such/folder", "no/such/folder: no such file or folder"),
    ("parts: no/such/folder", "parts = no/such/folder: no such folder"),
    ("parts: params.yaml", "parts = params.yaml: no such folder"),
    ("overrides: [parts=mine]", "set the key parts, which DVC watches"),
    ("overrides: [system=subgoals]", "an experiment chooses it"),
    ("- demo", "expected the keys experiment, overrides, data, parts, system"),
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
    parts = tmp_path / "my parts"
    parts.mkdir()
    request = requested(["experiment=mit_floors", f"plans.root={floors}", "seed=3", f"parts={parts}"])
    assert request == Request(experiment="mit_floors", overrides=["seed=3"], data=str(floors), parts=str(parts))
    raw = composed(request.as_overrides())
    assert (raw.plans.root, raw.seed, raw.parts) == (str(floors), 3, str(parts))
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


def test_several_roots_are_watched_by_the_folder_that_holds_them(tmp_path: Path) -> None:
    for name in ("north", "south", "elsewhere"):
        (tmp_path / "floors" / name).mkdir(parents=True)
    roots = f"plans.roots={{train: {tmp_path}/floors/north, test: [{tmp_path}/floors/south]}}"
    request = Request(experiment="floors", overrides=[roots])
    raw = composed(request.as_overrides())
    watched = watched_data(raw, request)
    assert (CONF.parent / watched).resolve() == tmp_path / "floors"
    kept = replace(request, data=str(tmp_path / "floors"))
    assert kept.as_overrides() == request.as_overrides()
    check_data(raw, kept)
    with pytest.raises(ConfigError, match=r"plans.roots has .*south for the split test, which DVC does not watch"):
        check_data(raw, replace(request, data=str(tmp_path / "floors/north")))
    assert watched_data(composed(["experiment=demo"]), Request()) == NO_DATA
