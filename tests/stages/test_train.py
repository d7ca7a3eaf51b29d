"""The train stage on datums made here, through its own entry."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from omegaconf import DictConfig, OmegaConf

from pipeline.datums import shard_path, stack, write_shard
from pipeline.errors import ConfigError, TableError
from pipeline.simulation.trial import Ending, run_trial
from pipeline.simulation.world import make_world
from pipeline.stages.door import typed
from pipeline.stages.train import TrainConfig, train
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.planner import Estimated, SubgoalPlanner
from tests.datums.rows import make_datums
from tests.worlds import TWO_ROOMS, draw, small_lidar

QUICK: dict[str, Any] = {"steps": 20, "validate_every": 10, "batch_size": 16, "hidden": [16, 8]}


def configuration(artifacts: Path, **train_keys: Any) -> DictConfig:
    return OmegaConf.create(
        {
            "seed": 3,
            "artifacts": str(artifacts),
            "experiment_name": "test",
            "execution": {"workers": 1, "progress": False},
            "tracking": {"enabled": False},
            "train": QUICK | train_keys,
        }
    )


def write_datums(artifacts: Path, *, splits: tuple[str, ...] = ("train", "validation"), map_view: bool = False) -> None:
    for index, split in enumerate(splits):
        rows = stack(make_datums(60, split=split, seed=index, map_view=map_view))
        write_shard(shard_path(artifacts / "harvest" / "datums", index), rows)


def test_datums_become_weights_that_a_planner_can_use(tmp_path: Path) -> None:
    write_datums(tmp_path)
    result = train(configuration(tmp_path))
    folder = tmp_path / "train"
    names = {"network.safetensors", "last.ckpt", "best.ckpt", "curves.parquet", "train.json"}
    assert {path.name for path in folder.iterdir()} == names
    summary = json.loads((folder / "train.json").read_text())
    assert summary["validation"]["rows"] == 60
    assert summary["validation"]["base_rate"] == pytest.approx(1 / 3)
    assert result.metrics["validation.accuracy"] == summary["validation"]["accuracy"]
    assert pq.read_table(folder / "curves.parquet").column_names == ["step", "split", "name", "value"]
    estimates = LearnedEstimator.load(folder / "network.safetensors").estimate_scan(np.ones(256), (3, 0), [(1, 0)])
    assert 0 < estimates.p_success[0] < 1
    assert result.model is not None
    assert result.model.outputs.shape == (16, 3)


def test_a_network_may_read_the_map(tmp_path: Path) -> None:
    write_datums(tmp_path, map_view=True)
    train(configuration(tmp_path, input_frame="map"))
    estimator = LearnedEstimator.load(tmp_path / "train" / "network.safetensors")
    assert not estimator.lasting
    drawn = draw(*TWO_ROOMS)
    world = make_world("two rooms", drawn.grid, 0.0)
    planner = SubgoalPlanner(estimator=estimator)
    asked: list[Estimated] = []
    planner.on_estimate = asked.append
    lidar = small_lidar(2.0)
    episode = run_trial(world, drawn.start, drawn.goal, planner, lidar=lidar, step_m=0.5, rng=np.random.default_rng(0))
    assert episode.ending is Ending.REACHED
    assert any(0 < found.p_success < 1 for each in asked for found in each.properties)


def test_a_map_network_needs_views_of_the_map(tmp_path: Path) -> None:
    write_datums(tmp_path)
    with pytest.raises(TableError, match=r"no views of the map.*harvest\.map_views=true"):
        train(configuration(tmp_path, input_frame="map"))


def test_training_again_gives_the_same_weights(tmp_path: Path) -> None:
    written = []
    for artifacts in (tmp_path / "one", tmp_path / "two"):
        write_datums(artifacts)
        train(configuration(artifacts))
        written.append((artifacts / "train" / "network.safetensors").read_bytes())
    assert written[0] == written[1]


@pytest.mark.parametrize("splits", [("train",), ("validation",)])
def test_a_missing_split_says_where_it_comes_from(tmp_path: Path, splits: tuple[str, ...]) -> None:
    write_datums(tmp_path, splits=splits)
    with pytest.raises(TableError, match=r"no datums of the split .* Put both in harvest\.splits"):
        train(configuration(tmp_path))
    assert not (tmp_path / "train").exists()


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"steps": 0}, r"train\.steps = 0: expected at least 1 step"),
        ({"batch_size": 1}, r"train\.batch_size = 1: expected at least 2"),
        ({"dropout": 1.0}, r"train\.dropout = 1\.0: expected from 0 to below 1"),
        ({"hidden": []}, r"train\.hidden = \[\]: expected one or more widths"),
        ({"target_scaling": "sqrt"}, r"train\.target_scaling = sqrt: expected standardise or log"),
        ({"input_frame": "world"}, r"train\.input_frame = world: expected subgoal or robot"),
        ({"learning_rate": -1.0}, r"train\.learning_rate = -1\.0: expected between 0 and 1"),
        ({"learningrate": 0.1}, r"unknown key train\.learningrate.*learning_rate"),
        ({"steps": "many"}, r"train\.steps = 'many': expected a whole number"),
    ],
)
def test_a_bad_key_is_named(tmp_path: Path, keys: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        train(configuration(tmp_path, **keys))


def test_the_shipped_defaults_are_the_papers() -> None:
    shipped = OmegaConf.load(Path(__file__).parents[2] / "conf" / "train" / "default.yaml")
    config = typed(TrainConfig, OmegaConf.create({"train": shipped}), "train")
    assert config == TrainConfig()
    assert (config.steps, config.batch_size, config.hidden) == (100_000, 256, [256, 128, 48, 16])
