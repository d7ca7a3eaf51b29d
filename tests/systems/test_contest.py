"""One trial, every competitor: what is recorded, and whose time is counted."""

import subprocess
import sys
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

import numpy as np
import pytest

from pipeline.evaluation import driving
from pipeline.evaluation.competitors import Outcome
from pipeline.simulation.practice import practice_ground
from pipeline.simulation.trial import Robot, run_trial
from pipeline.systems.subgoals.labels import LabelBook
from pipeline.systems.subgoals.planner import Estimated, SubgoalPlanner
from tests.systems.contestants import NAMES, contestant, ground_of
from tests.systems.networks import untrained
from tests.worlds import DEAD_END, draw, small_lidar


def driven(name: str, frame: str = "subgoal") -> Outcome:
    return contestant(name, frame=frame).drive(*ground_of(draw(*DEAD_END)), np.random.default_rng(0))


@pytest.mark.parametrize("frame", ["subgoal", "map"])
def test_an_estimate_is_recorded_beside_the_truth_of_that_moment(frame: str) -> None:
    ground, pair = ground_of(draw(*DEAD_END))
    book, expected = LabelBook(ground.world, floor_m=1.0), []

    def label_at_once(estimated: Estimated) -> None:
        marks = {mark.subgoal.key: mark for mark in book.mark_changed(estimated.seen, estimated.around)}
        for subgoal, said in zip(estimated.subgoals, estimated.properties, strict=True):
            label = marks[subgoal.key].label
            truth = (label.delta_success, None) if label.leads else (None, label.exploration)
            row = ("a/1", "learned", estimated.seen.step, *said, label.leads, *truth, marks[subgoal.key].cost)
            expected.append(row)

    planner = SubgoalPlanner(estimator=untrained(frame), on_estimate=label_at_once)
    run_trial(ground.world, pair.start, pair.goal, planner, robot=Robot(small_lidar(3.0), step_m=1.0),
              rng=np.random.default_rng(0))  # fmt: skip
    found = driven("learned", frame).side["estimates"]
    assert len(expected) > 5 and [tuple(row) for row in found] == expected
    assert {row.leads_to_goal for row in found} == {True, False}


def test_only_who_estimates_without_the_truth_leaves_estimates_and_who_estimates_leaves_marks() -> None:
    for name in NAMES:
        found = driven(name)
        assert bool(found.side.get("estimates")) == (name == "learned")
        assert bool(found.replay.marks) == (name != "optimistic")


def test_the_clock_stands_while_labels_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    entrant, place = contestant("learned"), ground_of(draw(*DEAD_END))
    mark, calls = LabelBook.mark_changed, []

    def slowly(*args: Any) -> Any:
        calls.append(1)
        sleep(0.02)
        return mark(*args)

    monkeypatch.setattr(LabelBook, "mark_changed", slowly)
    began = perf_counter()
    found = entrant.drive(*place, np.random.default_rng(0))
    whole = perf_counter() - began
    assert len(calls) >= 5
    assert found.seconds <= whole - 0.02 * len(calls)


def test_a_first_drive_in_another_world_is_timed_by_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(driving, "_WARM", set())
    names: list[str] = []
    run = driving.run_trial
    monkeypatch.setattr(driving, "run_trial", lambda world, *a, **k: names.append(world.name) or run(world, *a, **k))
    assert driven("perfect").cost_m == driven("perfect").cost_m
    assert names == ["practice", "a", "a"]


@pytest.mark.parametrize("name", NAMES)
def test_practice_ends_at_its_goal(name: str) -> None:
    ground, pair = practice_ground(0.5)
    assert np.isfinite(pair.known_map_m)
    assert contestant(name, frame="map").drive(ground, pair, np.random.default_rng(0)).ending == "reached"


AFTER_PRACTICE = """
import sys
import numpy as np
from numba.core.dispatcher import Dispatcher
from tests.systems.contestants import NAMES, contestant, ground_of
from tests.worlds import Cell, Drawing, OccupancyGrid, Point, scattered

def compiled():
    modules = [module for name, module in sys.modules.items() if name.startswith("pipeline")]
    kernels = [value for module in modules for value in vars(module).values()]
    return {v.py_func.__qualname__: len(v.overloads) for v in kernels if isinstance(v, Dispatcher)}

cells = scattered(np.random.default_rng(5), 60, 70, 0.2)
cells[1:4, 1:4], cells[-4:-1, -4:-1] = 0, 0
place = ground_of(Drawing(OccupancyGrid(cells, 0.3, Point(0.0, 0.0)), Cell(2, 2), Cell(57, 67)))
for name in NAMES:
    for frame in ("subgoal", "map") if name == "learned" else ("subgoal",):
        entrant = contestant(name, frame=frame)
        before = compiled()
        found = entrant.drive(*place, np.random.default_rng(0))
        assert found.decisions > 20, found
        print(name, {name: count for name, count in compiled().items() if count != before.get(name)})
"""


def test_nothing_is_compiled_on_the_clock() -> None:
    done = subprocess.run(
        [sys.executable, "-c", AFTER_PRACTICE], cwd=Path(__file__).parents[2], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n")[:-1] == ["optimistic {}", "learned {}", "learned {}", "perfect {}"]
