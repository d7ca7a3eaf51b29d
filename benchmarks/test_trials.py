"""Whole trials per second on one core, by environment and by who drives.

The figures of the method's public reference implementation (RAIL-group-software 1.0, one core of a Xeon with two) are
for guided mazes and MIT floors of the same number of cells, range, beams and step, with mazes and a network of its own.
They are constants here, as that code is no package.
"""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from benchmarks.networks import train_for
from benchmarks.worlds import MIT, SETTINGS, Setting, Trial
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.protocols import Planner
from pipeline.simulation.trial import Ending, Episode, run_trial
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.harvest import Origin, harvest_trial
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner

REFERENCE_TRIALS_PER_S = {
    ("maze", "optimistic"): 0.25,
    ("maze", "learned"): 0.039,
    ("fine floors", "optimistic"): 0.031,
}
TRIALS = {"maze": 24, "office": 12, "campus": 12, "floors": 12, "fine floors": 8}
DRIVERS = ("optimistic", "learned", "perfect", "harvest")


@pytest.fixture(scope="module", params=sorted(SETTINGS))
def prepared(request, tmp_path_factory) -> tuple[str, Setting, list[Trial], LearnedEstimator]:
    name = request.param
    if "floors" in name and not MIT.is_dir():
        pytest.skip(f"no real floors in {MIT}: set HINTERLAND_DATA to the folder that holds mit_campus_grids")
    setting = SETTINGS[name]
    folder: Path = tmp_path_factory.mktemp(name.replace(" ", "_"))
    drives = 8 if name == "fine floors" else 24
    return (
        name,
        setting,
        [setting.draw(index) for index in range(TRIALS[name])],
        train_for(setting, folder, drives=drives),
    )


def driver(who: str, setting: Setting, learned: LearnedEstimator) -> Callable[[Trial], Episode]:
    """Return what lets ``who`` drive one trial."""
    common = {"robot": setting.robot}

    def planner(trial: Trial) -> Planner:
        if who == "optimistic":
            return OptimisticPlanner()
        estimator = learned if who == "learned" else PerfectEstimator(trial.world)
        return SubgoalPlanner(estimator=estimator, max_subgoals=setting.max_subgoals, optimism=setting.optimism)

    def drive(trial: Trial) -> Episode:
        if who == "harvest":
            origin = Origin("a/0", "a", "a", "bench", "train", 0)
            given = common | {"weight_floor_m": 1.0, "map_views": setting.map_views, "rng": np.random.default_rng(0)}
            return harvest_trial(*trial, origin, **given)[0]
        return run_trial(*trial, planner(trial), rng=np.random.default_rng(0), **common)

    return drive


@pytest.mark.parametrize("who", DRIVERS)
def test_trials_per_second(benchmark, prepared, who: str) -> None:
    name, setting, trials, learned = prepared
    benchmark.group = f"trials: {name}"
    drive = driver(who, setting, learned)
    episodes: list[Episode] = []

    def run_all(all_of: Sequence[Trial]) -> None:
        episodes[:] = [drive(trial) for trial in all_of]

    benchmark.pedantic(run_all, args=(trials,), rounds=3, warmup_rounds=1)
    assert all(episode.ending is Ending.REACHED for episode in episodes)
    seconds = benchmark.stats.stats.median
    reference = REFERENCE_TRIALS_PER_S.get((name, who))
    benchmark.extra_info |= {
        "setting": setting.about,
        "trials_per_s": len(trials) / seconds,
        "decisions_per_trial": sum(episode.decisions for episode in episodes) / len(trials),
        "ms_per_decision": 1e3 * seconds / sum(episode.decisions for episode in episodes),
        "cells": float(np.mean([trial.world.blocked.size for trial in trials])),
    }
    if reference is not None:
        benchmark.extra_info["over_reference"] = len(trials) / seconds / reference
