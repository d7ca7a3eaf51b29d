"""How cost grows: python -m benchmarks.growth FILE.json [--plans 10000] [--trials 1000]

Time for one step against the area of the map, the number of subgoals and the number of beams; time and memory of a
harvest against the number of plans, and of an evaluation, with one worker and with two, by the stages that users run.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.conftest import machine
from benchmarks.worlds import across, draw_generated, draw_maze, rooms
from pipeline.floorplans.generators.guided_maze import MazeShape
from pipeline.grids.beams import beam_tree
from pipeline.grids.partial_map import enter, unseen_map
from pipeline.grids.raycast import scan
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.protocols import Planner
from pipeline.planning.seen import Seen
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import Robot, run_trial
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner

ROOT = Path(__file__).parents[1]
Points = list[dict[str, Any]]


class Timed:
    """Passes every question on, and notes how long the answer took and how many subgoals there were."""

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self.seconds: list[float] = []
        self.subgoals: list[int] = []

    def plan(self, seen: Seen) -> np.ndarray | None:
        began = time.perf_counter()
        path = self._planner.plan(seen)
        self.seconds.append(time.perf_counter() - began)
        around = getattr(self._planner, "_around", None)
        self.subgoals.append(len(around.subgoals) if around is not None else 0)
        return path


def by_area() -> Points:
    """Return ms for a step of a whole trial in mazes of growing area, lidar of 18 m."""
    lidar = make_lidar(beams=1024, input_beams=256, max_range_m=18.0)
    points = []
    for columns, rows in ((3, 4), (6, 8), (9, 12), (12, 16), (18, 24), (24, 32)):
        trials = [draw_maze(index, MazeShape(columns=columns, rows=rows)) for index in range(4)]
        for who in ("optimistic", "subgoals"):
            for place, trial in enumerate(trials[:1] + trials):
                planner = (
                    OptimisticPlanner()
                    if who == "optimistic"
                    else SubgoalPlanner(estimator=PerfectEstimator(trial.world))
                )
                episode = run_trial(*trial, planner, robot=Robot(lidar, step_m=0.54), rng=np.random.default_rng(0))
                if place:  # the first one warms up
                    ms = 1e3 * episode.seconds / episode.steps
                    points.append({"planner": who, "cells": trial.world.blocked.size, "ms": ms})
    return points


def by_subgoals() -> Points:
    """Return ms for a decision by number of subgoals around, where furniture breaks up every frontier."""
    lidar = make_lidar(beams=1024, input_beams=256, max_range_m=12.0)
    found: dict[int, list[float]] = {}
    for index in range(24):
        trial = draw_generated("campus", index, clutter_per_m2=0.12)
        for _ in range(1 if index else 2):  # the first one warms up
            timed = Timed(SubgoalPlanner(estimator=PerfectEstimator(trial.world), max_subgoals=12))
            run_trial(*trial, timed, robot=Robot(lidar, step_m=0.54), rng=np.random.default_rng(0))
        for seconds, subgoals in zip(timed.seconds, timed.subgoals, strict=True):
            found.setdefault(subgoals, []).append(1e3 * seconds)
    return [{"subgoals": count, "ms": median(ms), "decisions": len(ms)} for count, ms in sorted(found.items()) if count]


def by_beams() -> Points:
    """Return us for a scan and its way into the map, from 200 places of a drive through rooms."""
    trial = across(rooms(300, 500))
    lidar = make_lidar(beams=256, input_beams=256, max_range_m=18.0)
    episode = run_trial(*trial, OptimisticPlanner(), robot=Robot(lidar, step_m=0.54), rng=np.random.default_rng(0))
    stands = [divmod(int(cell), trial.world.blocked.shape[1]) for cell in episode.path[::4]][:200]
    points = []
    for beams in (64, 128, 256, 512, 1024, 2048, 4096):
        tree, times = beam_tree(beams, 60.0, trial.world.blocked.shape[1]), []
        for _ in range(7):
            map_, began = unseen_map(*trial.world.blocked.shape), time.perf_counter()
            for row, col in stands:
                _, seen, occupancy = scan(trial.world.grid.cells, row, col, tree, 0, beams)
                enter(map_, seen, occupancy, trial.world.disk)
            times.append(1e6 * (time.perf_counter() - began) / len(stands))
        points.append({"beams": beams, "us": median(times)})
    return points


def by_plans(most: int) -> Points:
    """Return seconds and the memory of the largest process of a harvest of so many mazes, with one and two workers."""
    points: Points = []
    for plans in [count for count in (10, 100, 1000, 10_000, 100_000) if count <= most]:
        with tempfile.TemporaryDirectory() as folder:
            counts = [f"plans.counts.train={plans}", "plans.counts.validation=1", "plans.counts.test=1"]
            given = ["experiment=demo", f"artifacts={folder}", "tracking=off", "execution.progress=false", *counts]
            for stage in ("plans", "rasterize"):
                run_stage(stage, [*given, "execution.workers=2"])
            points += [{"plans": plans, **each} for each in by_workers("harvest", Path(folder), given)]
            print(points[-2:], flush=True)
    return points


def by_trials(most: int) -> Points:
    """Return the same of an evaluation of so many trials, by a network that was trained for a moment."""
    with tempfile.TemporaryDirectory() as folder:
        given = ["experiment=demo", f"artifacts={folder}", "tracking=off", "execution.progress=false"]
        given += ["plans.counts.train=100", f"plans.counts.test={most}", "train.steps=1500", "train.validate_every=250"]
        for stage in ("plans", "rasterize", "harvest", "train"):
            run_stage(stage, [*given, "execution.workers=2"])
        return [{"trials": most, **each} for each in by_workers("evaluate", Path(folder), given)]


def by_workers(stage: str, folder: Path, given: list[str]) -> Points:
    """Return seconds and memory of a stage with one worker and with two, its start and its end included."""
    points: Points = []
    for workers in (1, 2):
        shutil.rmtree(folder / stage, ignore_errors=True)
        began = time.perf_counter()
        memory = run_stage(stage, [*given, f"execution.workers={workers}"])
        points.append({"workers": workers, "seconds": time.perf_counter() - began, "mb": memory})
    return points


def run_stage(stage: str, overrides: list[str]) -> float:
    """Run a stage; return the resident memory of its largest process, shared pages included [MB]."""
    command = [sys.executable, "-m", f"pipeline.stages.{stage}", *overrides]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, env=os.environ | {"OMP_NUM_THREADS": "1"})
    peak, done = [0.0], threading.Event()

    def watch() -> None:
        while not done.wait(0.2):
            peak[0] = max(peak[0], max(map(_resident, _family(process.pid)), default=0.0))

    watcher = threading.Thread(target=watch)
    watcher.start()
    code = process.wait()
    done.set()
    watcher.join()
    assert code == 0, f"{stage} ended with {code}"
    return peak[0]


def _family(pid: int) -> list[int]:
    """Return the process and all that came from it (Linux)."""
    try:
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="utf-8").split()
    except OSError:
        return []
    return [pid, *(each for child in children for each in _family(int(child)))]


def _resident(pid: int) -> float:
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
    except OSError:
        return 0.0
    return max((float(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS")), default=0.0)


def main() -> None:
    """Measure all curves and write them to a file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", type=Path)
    parser.add_argument("--plans", type=int, default=1000, help="largest number of plans to harvest")
    parser.add_argument("--trials", type=int, default=200, help="number of trials to evaluate")
    given = parser.parse_args()
    found: dict[str, Any] = {"machine": machine()}
    for name, measure in (("area", by_area), ("subgoals", by_subgoals), ("beams", by_beams)):
        found[name] = measure()
        print(name, found[name], flush=True)
    found["trials"] = by_trials(given.trials)
    print("trials", found["trials"], flush=True)
    found["plans"] = by_plans(given.plans)
    given.target.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
