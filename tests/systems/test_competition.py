"""One trial, every planner: what is recorded, and whose time is counted."""

import subprocess
import sys
from functools import partial
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

import numpy as np
import pytest

from pipeline.planning.protocols import Estimator
from pipeline.simulation.trial import Ending, run_trial
from pipeline.simulation.world import known_map_distance, make_world
from pipeline.systems.subgoals import competition
from pipeline.systems.subgoals.competition import PLANNERS, Drive, Rules, drive
from pipeline.systems.subgoals.labels import LabelBook
from pipeline.systems.subgoals.planner import Estimated, SubgoalPlanner
from pipeline.systems.subgoals.practice import practice_world
from tests.systems.networks import untrained
from tests.worlds import DEAD_END, draw, small_lidar

RULES = Rules(
    lidar=small_lidar(3.0),
    step_m=1.0,
    merge_m=0.0,
    weight_floor_m=1.0,
    max_steps=None,
    plan_over=partial(lambda estimator: SubgoalPlanner(estimator=estimator)),
)


def driven(planner: str, learned: Estimator | None = None) -> Drive:
    drawn = draw(*DEAD_END)
    return drive(planner, make_world("dead end", drawn.grid, 0.0), drawn.start, drawn.goal, RULES, trial_id="a/1",
                 learned=learned, rng=np.random.default_rng(0))  # fmt: skip


@pytest.mark.parametrize("frame", ["subgoal", "map"])
def test_an_estimate_is_recorded_beside_the_truth_of_that_moment(frame: str) -> None:
    drawn = draw(*DEAD_END)
    world = make_world("dead end", drawn.grid, 0.0)
    book, expected = LabelBook(world, floor_m=1.0), []

    def label_at_once(estimated: Estimated) -> None:
        marks = {mark.subgoal.key: mark for mark in book.mark_changed(estimated.seen, estimated.around)}
        for subgoal, said in zip(estimated.subgoals, estimated.properties, strict=True):
            label = marks[subgoal.key].label
            truth = (label.delta_success, None) if label.leads else (None, label.exploration)
            expected.append(("a/1", estimated.seen.step, *said, label.leads, *truth, marks[subgoal.key].cost))

    planner = SubgoalPlanner(estimator=untrained(frame), on_estimate=label_at_once)
    run_trial(world, drawn.start, drawn.goal, planner, lidar=RULES.lidar, step_m=1.0, rng=np.random.default_rng(0))
    found = driven("learned", untrained(frame))
    assert len(expected) > 5 and [tuple(row) for row in found.estimates] == expected
    assert {row.leads_to_goal for row in found.estimates} == {True, False}


def test_the_clock_stands_while_labels_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    driven("learned", untrained("subgoal"))
    mark, calls = LabelBook.mark_changed, []

    def slowly(*args: Any) -> Any:
        calls.append(1)
        sleep(0.02)
        return mark(*args)

    monkeypatch.setattr(LabelBook, "mark_changed", slowly)
    began = perf_counter()
    found = driven("learned", untrained("subgoal"))
    whole = perf_counter() - began
    assert len(calls) >= 5
    assert found.episode.seconds <= whole - 0.02 * len(calls)


def test_a_first_drive_in_another_world_is_timed_by_nobody(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(competition, "_WARM", set())
    names: list[str] = []
    run = competition.run_trial
    monkeypatch.setattr(
        competition, "run_trial", lambda world, *a, **k: names.append(world.name) or run(world, *a, **k)
    )
    assert [driven("perfect").episode.travelled for _ in range(2)] == [driven("perfect").episode.travelled] * 2
    assert names == ["practice", "dead end", "dead end", "dead end"]


def test_practice_ends_at_its_goal() -> None:
    world, start, goal = practice_world(0.5)
    assert np.isfinite(known_map_distance(world, start, goal))
    for planner in PLANNERS:
        found = drive(planner, world, start, goal, RULES, trial_id="", learned=untrained("map"),
                      rng=np.random.default_rng(0))  # fmt: skip
        assert found.episode.ending is Ending.REACHED


AFTER_PRACTICE = """
import sys
import numpy as np
from numba.core.dispatcher import Dispatcher
from pipeline.systems.subgoals.competition import PLANNERS, drive, warm_up
from tests.systems.networks import untrained
from tests.systems.test_competition import RULES
from tests.worlds import Cell, OccupancyGrid, Point, scattered
from pipeline.simulation.world import make_world

def compiled():
    modules = [module for name, module in sys.modules.items() if name.startswith("pipeline")]
    kernels = [value for module in modules for value in vars(module).values()]
    return {v.py_func.__qualname__: len(v.overloads) for v in kernels if isinstance(v, Dispatcher)}

cells = scattered(np.random.default_rng(5), 60, 70, 0.2)
cells[1:4, 1:4], cells[-4:-1, -4:-1] = 0, 0
world = make_world("large", OccupancyGrid(cells, 0.3, Point(0.0, 0.0)), 0.0)
learned = [untrained("subgoal"), untrained("map")]
for planner in PLANNERS:
    for network in learned if planner == "learned" else [None]:
        warm_up(planner, RULES, network)
        before = compiled()
        found = drive(planner, world, Cell(2, 2), Cell(57, 67), RULES, trial_id="", learned=network,
                      rng=np.random.default_rng(0))
        assert found.episode.decisions > 20, found.episode
        print(planner, {name: count for name, count in compiled().items() if count != before.get(name)})
"""


def test_nothing_is_compiled_on_the_clock() -> None:
    done = subprocess.run(
        [sys.executable, "-c", AFTER_PRACTICE], cwd=Path(__file__).parents[2], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n")[:-1] == ["optimistic {}", "learned {}", "learned {}", "perfect {}"]
