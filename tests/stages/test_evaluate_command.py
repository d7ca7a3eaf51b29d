"""`hinterland evaluate NETWORK FLOORS`: what is composed of a network's own settings, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from omegaconf import OmegaConf

from pipeline.errors import ConfigError, TableError
from pipeline.stages.composing import composed
from pipeline.stages.evaluate_command import main, prepared, taken_over
from tests.systems.networks import some_network

RAW = OmegaConf.create(
    {"sensor": {"beams": 1024, "max_range_m": 12.0}, "robot": {"radius_m": 0.15}, "rasterize": {"resolution_m": 0.3}}
)


def test_a_network_brings_its_sensor_robot_and_cells() -> None:
    made_with = {"sensor.max_range_m": 5.0, "robot.radius_m": 0.3, "rasterize.resolution_m": 0.2, "harvest.x": 1}
    taken, remarks = taken_over(made_with, RAW, [])
    assert taken == ["rasterize.resolution_m=0.2", "robot.radius_m=0.3", "sensor.max_range_m=5.0"]
    assert remarks == []


def test_what_is_asked_for_wins_and_is_remarked_where_it_differs() -> None:
    asked = OmegaConf.merge(RAW, {"sensor": {"max_range_m": 8.0}, "robot": {"radius_m": 0.3}})
    assert isinstance(asked, type(RAW))
    made_with = {"sensor.max_range_m": 5.0, "robot.radius_m": 0.3}
    taken, remarks = taken_over(made_with, asked, ["sensor.max_range_m", "robot.radius_m"])
    assert taken == []
    assert remarks == ["sensor.max_range_m = 8.0 as asked for; the network was made with 5.0."]


def test_what_this_version_does_not_know_or_the_network_does_not_say_is_remarked() -> None:
    taken, remarks = taken_over({"sensor.wings": 2, "rasterize.resolution_m": [0.1, 0.3]}, RAW, [])
    assert taken == []
    assert [remark.split(",")[0] for remark in remarks] == [
        "The network was made with cells of [0.1",
        "The network was made with sensor.wings = 2",
    ]
    assert taken_over({}, RAW, [])[1] == [
        "The network does not say what it was made with: sensor, robot and cells are the experiment's."
    ]


@pytest.fixture
def network(tmp_path: Path) -> Path:
    return some_network(tmp_path / "network.safetensors", made_with={"sensor.max_range_m": 7.5, "robot.radius_m": 0.2})


@pytest.fixture
def floors(tmp_path: Path) -> Path:
    folder = tmp_path / "floors"
    folder.mkdir()
    np.savez(folder / "a.npz", occ_grid=np.ones((4, 4), dtype=np.uint8))
    return folder


def test_the_whole_is_composed_and_checked_before_anything_runs(network: Path, floors: Path) -> None:
    found = prepared(str(network), floors, ["robot.step_m=0.9"])
    raw = composed(found.overrides)
    assert (raw.sensor.max_range_m, raw.robot.radius_m, raw.robot.step_m) == (7.5, 0.2, 0.9)
    assert (raw.plans.root, raw.plans.split, raw.evaluate.network) == (str(floors), "test", str(network))
    assert raw.experiment_name == "floors"
    again, other = prepared(str(network), floors, ["robot.step_m=0.9"]), prepared(str(network), floors, [])
    assert found.folder == again.folder != other.folder
    assert found.folder.parent == Path("artifacts/evaluations")


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["plans.root=x"], "FLOORS says that already"),
        (["evaluate.network=x"], "NETWORK says that already"),
        (["quick"], "'quick' is not an override: expected key=value after NETWORK and FLOORS"),
        (["robot.stp_m=1"], "unknown key robot.stp_m"),
        (["robot.step_m=-1"], "robot.step_m = -1"),
    ],
)
def test_a_wrong_setting_is_refused(network: Path, floors: Path, overrides: list[str], message: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        prepared(str(network), floors, overrides)
    assert message in str(refusal.value)


def test_what_is_no_network_is_refused(tmp_path: Path, floors: Path) -> None:
    with pytest.raises(ConfigError, match=r"gone\.safetensors: no such file"):
        prepared(str(tmp_path / "gone.safetensors"), floors, [])
    (tmp_path / "text.safetensors").write_text("not weights", encoding="utf-8")
    with pytest.raises(TableError, match="is not a complete safetensors file"):
        prepared(str(tmp_path / "text.safetensors"), floors, [])


def test_no_floors_is_one_line(
    network: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(network.parent)
    with pytest.raises(SystemExit) as end:
        main([str(network), "nowhere"])
    assert end.value.code == 1
    assert capsys.readouterr().err.startswith("error: FLOORS = nowhere: no such folder, file or archive.")
