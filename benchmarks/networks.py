"""A network for each setting, trained for a minute on a few drives: good enough to drive as learned planners do."""

from pathlib import Path

import numpy as np

from benchmarks.worlds import Setting
from pipeline.datums import shard_path, stack, write_shard
from pipeline.stages.composing import composed
from pipeline.stages.train import train
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.harvest import Origin, harvest_trial

FIRST = 1000  # number of the first trial to learn from; those that are timed come before


def train_for(setting: Setting, folder: Path, *, drives: int = 24, steps: int = 1500) -> LearnedEstimator:
    """Return a network trained on ``drives`` optimistic drives in ``setting``; all is written to ``folder``."""
    for index in range(drives):
        split = "validation" if index % 6 == 5 else "train"
        trial = setting.draw(FIRST + index)
        _, datums = harvest_trial(
            *trial,
            Origin(f"{index}", f"{index}", f"{index}", "bench", split, 0),
            robot=setting.robot,
            weight_floor_m=1.0,
            rng=np.random.default_rng(index),
            map_views=setting.map_views,
        )
        write_shard(shard_path(folder / "harvest" / "datums", index), stack(datums))
    overrides = ["experiment=tiny", f"artifacts={folder}", "tracking=off", "execution.progress=false"]
    overrides += [f"train.steps={steps}", "train.batch_size=256", "train.hidden=[256,128,48,16]"]
    overrides += ["train.validate_every=250"]
    if setting.map_views:
        overrides += ["train.input_frame=map", "train.dropout=0.1"]
        overrides += ["train.cost_weighted=false", "train.class_balanced=false"]
    train(composed(overrides))
    return LearnedEstimator.load(folder / "train" / "network.safetensors")
