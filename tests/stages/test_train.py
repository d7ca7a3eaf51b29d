"""The train stage on datums made here, through its own entry."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import torch
from omegaconf import DictConfig, OmegaConf

from pipeline.datums import read_blocks, shard_path, stack, write_shard
from pipeline.errors import ConfigError, TableError
from pipeline.files import sum_path, write_json
from pipeline.learning.weights import load_weights
from pipeline.simulation.trial import Ending, Robot, run_trial
from pipeline.simulation.world import make_world
from pipeline.stages.door import typed
from pipeline.stages.train import train
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.network_header import SUBGOAL_NETWORK
from pipeline.systems.subgoals.planner import Estimated, SubgoalPlanner
from pipeline.systems.subgoals.settings import TrainConfig
from pipeline.systems.subgoals.training import network_inputs, read_examples
from tests.datums.rows import make_datums
from tests.worlds import TWO_ROOMS, draw, small_lidar

ROOT = Path(__file__).resolve().parents[2]
FILES = ("network.safetensors", "last.ckpt", "best.ckpt", "curves.parquet", "train.json")
NAMES = {name + ending for name in FILES for ending in ("", ".sha256")}
QUICK: dict[str, Any] = {"steps": 20, "validate_every": 10, "batch_size": 16, "hidden": [16, 8]}


def configuration(artifacts: Path, **train_keys: Any) -> DictConfig:
    return OmegaConf.create(
        {
            "seed": 3,
            "artifacts": str(artifacts),
            "experiment_name": "test",
            "system": "subgoals",
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
    assert {path.name for path in folder.iterdir()} == NAMES
    assert {path.name for path in tmp_path.iterdir()} == {"harvest", "train"}, "scratch was left behind"
    summary = json.loads((folder / "train.json").read_text())
    assert summary["validation"]["rows"] == 60
    assert summary["validation"]["base_rate"] == pytest.approx(1 / 3)
    assert not any("calibration_error" in name for name in result.metrics), "validation chose the calibration"
    assert result.metrics["validation.accuracy"] == summary["validation"]["accuracy"]
    assert pq.read_table(folder / "curves.parquet").column_names == ["step", "split", "name", "value"]
    estimates = LearnedEstimator.load(folder / "network.safetensors").estimate_scan(np.ones(256), (3, 0), [(1, 0)])
    assert 0 < estimates.p_success[0] < 1
    assert result.model is not None
    assert result.model.outputs.shape == (16, 3)


def test_weights_say_what_their_datums_were_made_with(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    made_with = {"sensor.max_range_m": 7.5, "robot.merge_m": 0.4, "rasterize.resolution_m": [0.1, 0.2]}
    for artifacts in (tmp_path / "told", tmp_path / "untold"):
        write_datums(artifacts)
    write_json(tmp_path / "told" / "harvest" / "harvest.json", {"datums": 120, "made_with": made_with})
    found = []
    for artifacts in (tmp_path / "told", tmp_path / "untold"):
        train(configuration(artifacts))
        found.append(load_weights(artifacts / "train" / "network.safetensors", SUBGOAL_NETWORK)[0].made_with)
    assert found == [made_with | {"train.seed": 3}, {"train.seed": 3}]
    assert caplog.text.count("the weights will not say what sensor and robot they were made with") == 1


def test_a_harvest_summary_that_is_none_is_named(tmp_path: Path) -> None:
    write_datums(tmp_path)
    (tmp_path / "harvest" / "harvest.json").write_text("{", encoding="utf-8")
    with pytest.raises(TableError, match=r"harvest\.json: not the summary of a harvest"):
        train(configuration(tmp_path))


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
    episode = run_trial(
        world, drawn.start, drawn.goal, planner, robot=Robot(lidar, step_m=0.5), rng=np.random.default_rng(0)
    )
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


def test_the_seed_of_the_training_is_its_own(tmp_path: Path) -> None:
    """Seed 3 draws the data: train.seed=3 is what null means, another gives other weights from equal datums."""
    weights, examples = {}, {}
    for key in (None, 3, 4):
        artifacts = tmp_path / str(key)
        write_datums(artifacts)
        train(configuration(artifacts, seed=key))
        path = artifacts / "train" / "network.safetensors"
        weights[key] = path.read_bytes()
        config = TrainConfig(**QUICK, seed=key)
        examples[key] = read_examples(artifacts / "harvest" / "datums", "train", config, tmp_path).fingerprint()
        assert load_weights(path, SUBGOAL_NETWORK)[0].made_with["train.seed"] == (3 if key is None else key)
    assert weights[None] == weights[3] != weights[4]
    assert len(set(examples.values())) == 1


@pytest.mark.parametrize("frame", ["subgoal", "robot", "map"])
def test_how_datums_are_cut_into_shards_and_blocks_does_not_matter(tmp_path: Path, frame: str) -> None:
    datums, config = make_datums(60, map_view=True), TrainConfig(input_frame=frame)
    for size in (60, 23):
        for index, first in enumerate(range(0, 60, size)):
            write_shard(shard_path(tmp_path / str(size), index), stack(datums[first : first + size]))
    whole, cut = (read_examples(tmp_path / str(size), "train", config, tmp_path) for size in (60, 23))
    assert whole.fingerprint() == cut.fingerprint()
    blocks = list(read_blocks(tmp_path / "60", ["train"], rows_at_once=7))
    assert [len(block.pair_id) for block in blocks] == [7] * 8 + [4]
    inputs = np.concatenate([network_inputs(block, config, tmp_path) for block in blocks])
    assert np.array_equal(whole["inputs"].numpy(), inputs)


@pytest.mark.parametrize("splits", [("train",), ("validation",)])
def test_a_missing_split_says_where_it_comes_from(tmp_path: Path, splits: tuple[str, ...]) -> None:
    write_datums(tmp_path, splits=splits)
    with pytest.raises(TableError, match=r"no datums of the split .* Put both in harvest\.splits"):
        train(configuration(tmp_path))
    assert not (tmp_path / "train").exists()


def test_an_error_in_the_middle_leaves_no_scratch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise OSError("the disk is gone")

    write_datums(tmp_path)
    monkeypatch.setattr("pipeline.learning.looks.write_curves", broken)
    with pytest.raises(OSError, match="the disk is gone"):
        train(configuration(tmp_path))
    assert {path.name for path in tmp_path.iterdir()} == {"harvest", "train"}
    assert {path.name for path in (tmp_path / "train").iterdir()} <= NAMES


AS_A_PROCESS = """
import sys
from pathlib import Path
from tests.stages.test_train import configuration
from pipeline.stages.train import train

train(configuration(Path(sys.argv[1]), steps=int(sys.argv[2])))
"""


@pytest.mark.slow
def test_a_killed_training_leaves_no_scratch_and_ends_with_the_same_weights(tmp_path: Path) -> None:
    killed, alone = tmp_path / "killed", tmp_path / "alone"
    for artifacts in (killed, alone):
        write_datums(artifacts)
    command = [sys.executable, "-c", AS_A_PROCESS, str(killed), "100000"]
    with subprocess.Popen(command, env=os.environ | {"PYTHONPATH": str(ROOT)}, cwd=ROOT) as process:
        try:
            limit = time.monotonic() + 240
            while _looked_at(killed / "train" / "curves.parquet") < 30 and process.poll() is None:
                assert time.monotonic() < limit
                time.sleep(0.01)
        finally:
            process.kill()
    assert process.returncode == -signal.SIGKILL
    assert {path.name for path in killed.iterdir()} == {"harvest", "train"}
    done = torch.load(killed / "train" / "last.ckpt", weights_only=True)["hinterland"]["step"]
    assert done >= 20
    for artifacts in (killed, alone):
        train(configuration(artifacts, steps=done + 20))
    files = [artifacts / "train" / "network.safetensors" for artifacts in (killed, alone)]
    assert files[0].read_bytes() == files[1].read_bytes()
    assert {path.name for path in (killed / "train").iterdir()} == NAMES


def _looked_at(curves: Path) -> int:
    """Return the latest step at which validation was looked at."""
    return max(pq.read_table(curves)["step"].to_pylist()) if curves.is_file() else -1


PEAKS = """
import sys, threading, time
from pathlib import Path
from tests.stages.test_train import configuration
from pipeline.stages.train import train

def anonymous_mib():
    (line,) = (line for line in open("/proc/self/status") if line.startswith("RssAnon"))
    return int(line.split()[1]) / 1024

def watch():
    while True:
        peak[0] = max(peak[0], anonymous_mib())
        time.sleep(0.002)

peak = [0.0]
threading.Thread(target=watch, daemon=True).start()
for folder in sys.argv[1:]:
    peak[0] = 0.0
    train(configuration(Path(folder)))
    print("peak", peak[0])
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="reads the memory of a process as Linux tells it")
def test_memory_does_not_grow_with_the_table(tmp_path: Path) -> None:
    """60,000 rows instead of 9,000: 51 MiB more of inputs, less than 10 MiB more memory."""
    shard = tmp_path / "shard.parquet"
    write_shard(shard, stack(make_datums(500)))
    folders = [tmp_path / "small", tmp_path / "large"]
    for artifacts, shards in zip(folders, (18, 120), strict=True):
        write_datums(artifacts)
        for index in range(shards):
            link = shard_path(artifacts / "harvest" / "datums", 2 + index)
            link.symlink_to(shard)
            sum_path(link).write_text(sum_path(shard).read_text().replace(shard.name, link.name))
    command = [sys.executable, "-c", PEAKS, *map(str, folders)]
    done = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": str(ROOT)}, cwd=ROOT, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    rows = [json.loads((artifacts / "train" / "train.json").read_text())["train"]["rows"] for artifacts in folders]
    assert rows == [9060, 60_060]
    small, large = (float(line.split()[1]) for line in done.stdout.splitlines() if line.startswith("peak"))
    assert large - small < 10.0, f"{small:.0f} MiB of a small table, {large:.0f} MiB of a large one"


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"seed": -1}, r"train\.seed = -1: expected null or at least 0"),
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
    shipped = OmegaConf.load(Path(__file__).parents[2] / "conf" / "train" / "subgoals.yaml")
    config = typed(TrainConfig, OmegaConf.create({"train": shipped}), "train")
    assert config == TrainConfig()
    assert (config.steps, config.batch_size, config.hidden) == (100_000, 256, [256, 128, 48, 16])
