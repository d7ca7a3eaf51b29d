"""The evaluate stage on a drawn world, through its own entry: what is recorded, and what is said of the network."""

import json
import shutil
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
import torch
from omegaconf import DictConfig, OmegaConf

from models.subgoals import SubgoalNet
from pipeline.errors import PartError, TableError
from pipeline.evaluation.trials import read_episodes, read_trials, trial_rows
from pipeline.grids.occupancy import Cell, center_of
from pipeline.grids.sampling import ends_between
from pipeline.grids.store import GridRecord, Pair, read_pairs, read_worlds, write_pairs, write_worlds
from pipeline.learning.weights import save_weights
from pipeline.stages import evaluate as stage
from pipeline.stages.evaluate import evaluate
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK, NetworkHeader
from tests.worlds import DEAD_END, draw

MADE_WITH = {
    "sensor.beams": 256, "sensor.input_beams": 256, "sensor.max_range_m": 4.0, "sensor.noise_m": 0.0,
    "robot.radius_m": 0.0, "robot.step_m": 0.7, "robot.merge_m": 0.0, "rasterize.resolution_m": 1.0,
    "harvest.weight_floor_m": 1.0, "sensor.field_of_view_deg": 360.0, "sensor.layers": [], "robot.motion": "walk",
    "robot.primitives": 65, "robot.turn_m": 0.0, "robot.turning_radius_m": 0.6,
}  # fmt: skip
COMPETITORS = {
    "optimistic": {"role": "baseline", "use": "optimistic"},
    "learned": {"role": "candidate", "use": "subgoals"},
    "perfect": {"role": "bound", "use": "subgoals", "settings": {"estimator": "labels"}},
    "known_map": {"role": "bound", "use": "known_map"},
}
ENDS = [((6, 5), (6, 18)), ((6, 18), (6, 5)), ((1, 1), (6, 6)), ((11, 18), (6, 13)), ((6, 1), (6, 14)),
        ((3, 3), (11, 10)), ((9, 16), (1, 3))]  # fmt: skip


@pytest.fixture
def artifacts(tmp_path: Path) -> Path:
    """Return a folder with one drawn plan, seven trials on it, and a network of random weights."""
    grid = draw(*DEAD_END).grid
    identity = ("dead_end", "hall", "drawn", "test")
    pairs = []
    for index, (start, goal) in enumerate(ENDS):
        points = (center_of(grid, Cell(*end)) for end in (start, goal))
        pairs.append(Pair(f"dead_end/{index}", *identity, *ends_between(grid, *points, plan_id="p", robot_radius=0.0)))
    write_worlds(tmp_path / "rasterize", [GridRecord(*identity, grid, 0.0)])
    write_pairs(tmp_path / "rasterize", pairs)
    write_network(tmp_path, MADE_WITH)
    return tmp_path


def write_network(artifacts: Path, made_with: dict[str, Any]) -> None:
    torch.manual_seed(0)
    net = SubgoalNet(inputs=260, hidden=(8, 4))
    torch.nn.init.normal_(net.head.weight, std=3.0)
    header = NetworkHeader(inputs=260, hidden=(8, 4), dropout=0.1, input_frame="subgoal",
                           target_scaling="standardise", made_with=made_with)  # fmt: skip
    arrays = {name: value.numpy() for name, value in net.state_dict().items() if "num_batches" not in name}
    save_weights(artifacts / "train" / "network.safetensors", SUBGOAL_NETWORK, header, arrays)


def configuration(artifacts: Path, *overrides: str) -> DictConfig:
    base = OmegaConf.create(
        {
            "seed": 3,
            "artifacts": str(artifacts),
            "experiment_name": "test",
            "system": "subgoals",
            "execution": {"workers": 1, "progress": False},
            "tracking": {"enabled": False},
            "sensor": {"beams": 256, "input_beams": 256, "max_range_m": 4.0},
            "robot": {"radius_m": 0.0, "step_m": 0.7},
            "planner": {},
            "evaluate": {"competitors": COMPETITORS, "recorded_trials": 3, "pairs_per_unit": 3},
        }
    )
    return OmegaConf.merge(base, OmegaConf.from_dotlist(list(overrides)))  # type: ignore[return-value]


def ratios(artifacts: Path) -> dict[str, float]:
    rows = trial_rows(read_trials(artifacts / "evaluate/trials.parquet"))
    costs = {(row.trial_id, row.competitor): row.cost_m for row in rows}
    return {name: cost / costs[name, "optimistic"] for (name, who), cost in costs.items() if who == "learned"}


def test_the_worst_and_the_best_trial_are_recorded_whatever_their_place(artifacts: Path) -> None:
    evaluate(configuration(artifacts))
    found = ratios(artifacts)
    ranked = sorted(found, key=lambda name: (-found[name], name))
    assert found[ranked[0]] > 1.2
    assert found[ranked[-1]] < 0.8
    assert {ranked[0], ranked[-1]}.isdisjoint({"dead_end/0", "dead_end/1", "dead_end/2"}), "not the first ones"
    episodes = read_episodes(artifacts / "evaluate/episodes.parquet")
    recorded = {episode.trial_id for episode in episodes}
    assert len(recorded) == 3
    assert {ranked[0], ranked[-1]} <= recorded
    assert {episode.competitor for episode in episodes} == {"optimistic", "learned", "perfect"}
    costs = {(row.trial_id, row.competitor): row.cost_m for row in
             trial_rows(read_trials(artifacts / "evaluate/trials.parquet"))}  # fmt: skip
    assert all(episode.cost_m == costs[episode.trial_id, episode.competitor] for episode in episodes)


def test_records_do_not_depend_on_workers_units_or_restarts(artifacts: Path) -> None:
    evaluate(configuration(artifacts, "sensor.noise_m=0.05"))
    path = artifacts / "evaluate/episodes.parquet"
    first = pq.read_table(path)
    assert first.num_rows == 9
    shutil.rmtree(artifacts / "evaluate/records/part-000000")
    evaluate(configuration(artifacts, "sensor.noise_m=0.05"))
    assert pq.read_table(path).equals(first)
    evaluate(configuration(artifacts, "sensor.noise_m=0.05", "execution.workers=2", "evaluate.pairs_per_unit=1"))
    assert pq.read_table(path).equals(first)


def test_other_records_are_chosen_without_driving_all_anew(artifacts: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    evaluate(configuration(artifacts))
    parts = {path: path.stat().st_mtime_ns for path in (artifacts / "evaluate/parts").rglob("*.parquet")}
    evaluate(configuration(artifacts, "evaluate.recorded_trials=0", "evaluate.ransac_threshold_m=3.0"))
    assert read_episodes(artifacts / "evaluate/episodes.parquet") == []
    assert {path: path.stat().st_mtime_ns for path in parts} == parts


def test_a_drive_that_does_not_repeat_is_refused(artifacts: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def another(trials: Any) -> list[Any]:
        return [row._replace(cost_m=row.cost_m + 1.0) for row in trial_rows(trials)]

    monkeypatch.setattr(stage, "trial_rows", another)
    with pytest.raises(PartError, match=r"competitors\.optimistic: trial .*driven again from its seed.*must be equal"):
        evaluate(configuration(artifacts))


def test_a_network_made_alike_is_not_remarked_upon(artifacts: Path, capsys: pytest.CaptureFixture[str]) -> None:
    evaluate(configuration(artifacts))
    assert json.loads((artifacts / "evaluate/summary.json").read_text())["remarks"] == []
    assert "warning" not in capsys.readouterr().err


def test_each_setting_the_network_was_not_made_with_is_one_line(
    artifacts: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_network(artifacts, MADE_WITH | {"rasterize.resolution_m": 0.1})
    evaluate(configuration(artifacts, "sensor.max_range_m=5.0", "robot.merge_m=1.5"))
    remarks = json.loads((artifacts / "evaluate/summary.json").read_text())["remarks"]
    assert remarks == [
        "learned: The network was made with rasterize.resolution_m = 0.1; these trials are driven with 1.0.",
        "learned: The network was made with robot.merge_m = 0.0; these trials are driven with 1.5.",
        "learned: The network was made with sensor.max_range_m = 4.0; these trials are driven with 5.0.",
    ]
    said = capsys.readouterr()
    assert said.err.splitlines() == [f"warning: {remark}" for remark in remarks]
    assert all(remark in " ".join(said.out.split()) for remark in remarks), "the table says so too"


@pytest.mark.parametrize(
    ("split", "said"), [("train", "learned from these very plans"), ("validation", "chose the network's step")]
)
def test_plans_that_made_the_network_are_remarked_upon(artifacts: Path, split: str, said: str) -> None:
    worlds, pairs = read_worlds(artifacts / "rasterize"), read_pairs(artifacts / "rasterize")
    write_worlds(artifacts / "rasterize", [world._replace(split=split) for world in worlds])
    write_pairs(artifacts / "rasterize", [pair._replace(split=split) for pair in pairs])
    evaluate(configuration(artifacts, f"evaluate.split={split}"))
    (remark,) = json.loads((artifacts / "evaluate/summary.json").read_text())["remarks"]
    assert said in remark
    assert f"evaluate.split = {split}" in remark


def test_weights_that_do_not_say_what_they_were_made_with(artifacts: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_network(artifacts, {})
    evaluate(configuration(artifacts))
    assert capsys.readouterr().err.count("does not say what sensor, robot and resolution it was made with") == 1


def test_without_the_learned_planner_the_network_is_of_no_interest(artifacts: Path) -> None:
    shutil.rmtree(artifacts / "train")
    evaluate(configuration(artifacts, "evaluate.competitors.learned=null"))
    assert len(read_episodes(artifacts / "evaluate/episodes.parquet")) == 6


def test_grids_of_another_robot_are_refused_before_any_drive(artifacts: Path) -> None:
    with pytest.raises(TableError, match=r"made for robot\.radius_m = 0\.0, this run has 0\.25.*dvc repro rasterize"):
        evaluate(configuration(artifacts, "robot.radius_m=0.25"))
    assert not (artifacts / "evaluate").exists()
