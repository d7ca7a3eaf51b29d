"""Labels equal a slow reading of their definition, and a reader can check two of them by hand."""

import numpy as np
import pytest
from hypothesis import given, settings

from pipeline.grids.partial_map import UNSEEN
from pipeline.grids.zones import REACHED
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Surroundings
from pipeline.simulation.trial import run_trial
from pipeline.simulation.world import World, make_world
from pipeline.systems.subgoals.beyond import Beyond
from pipeline.systems.subgoals.labels import Label, LabelBook, label_subgoals, misclassification_costs
from tests.twins import slow_field
from tests.worlds import Drawing, cluttered_worlds, draw, small_lidar


class Recorder:
    """Drives optimistically and keeps a copy of everything seen."""

    def __init__(self) -> None:
        self.seen: list[Seen] = []
        self._optimist = OptimisticPlanner()

    def plan(self, seen: Seen) -> np.ndarray | None:
        map_ = seen.map._replace(known=seen.map.known.copy(), status=seen.map.status.copy())
        self.seen.append(seen._replace(map=map_))
        return self._optimist.plan(seen)


def explore(drawn: Drawing, reach: float = 3.0) -> tuple[World, list[Seen]]:
    world = make_world("drawn", drawn.grid, 0.0)
    recorder = Recorder()
    run_trial(world, drawn.start, drawn.goal, recorder, lidar=small_lidar(reach), step_m=1.0,
              rng=np.random.default_rng(0))  # fmt: skip
    return world, recorder.seen


def octile(drow: int, dcol: int) -> float:
    return max(abs(drow), abs(dcol)) + (np.sqrt(2.0) - 1.0) * min(abs(drow), abs(dcol))


def slow_label(world: World, seen: Seen, reached: np.ndarray, cells: np.ndarray, point: int) -> Label:
    cols = reached.shape[1]
    frontier = np.zeros_like(reached)
    frontier.ravel()[cells] = True
    beyond = (world.blocked == 0) & ~reached
    row, col = divmod(point, cols)
    along = [(octile(r - row, c - col), r, c) for r, c in (divmod(int(cell), cols) for cell in cells)]
    dist = slow_field(beyond | frontier, row, col, along)
    metres = seen.resolution
    if np.isfinite(dist[seen.goal]):
        optimistic = slow_field(seen.map.status <= UNSEEN, *divmod(point, cols))[seen.goal]
        return Label(True, dist[seen.goal] * metres, max(0.0, dist[seen.goal] - optimistic) * metres, 0.0)
    inside = dist[beyond & np.isfinite(dist)]
    return Label(False, np.inf, np.inf, 2.0 * (np.ptp(inside) if inside.size else 0.0) * metres)


@settings(deadline=None, max_examples=80)
@given(cluttered_worlds(14))
def test_labels_equal_the_slow_definition(drawn: Drawing) -> None:
    world, steps = explore(drawn, reach=2.5)
    for seen in steps:
        around = Surroundings(seen)
        found = label_subgoals(Beyond(world, seen, around), seen, around, around.subgoals)
        reached = (around.zones == REACHED).reshape(world.blocked.shape)
        for subgoal, label in zip(around.subgoals, found, strict=True):
            expected = slow_label(world, seen, reached, subgoal.cells, subgoal.point)
            assert label == pytest.approx(expected, abs=1e-6)


@settings(deadline=None, max_examples=80)
@given(cluttered_worlds(14))
def test_as_long_as_the_goal_is_not_in_reach_some_subgoal_leads_there_exactly_if_any_way_does(drawn: Drawing) -> None:
    world, steps = explore(drawn)
    reachable = np.isfinite(slow_field(world.blocked == 0, *drawn.start)[drawn.goal])
    for seen in steps:
        around = Surroundings(seen)
        labels = label_subgoals(Beyond(world, seen, around), seen, around, around.subgoals)
        if not around.goal_in_reach:
            assert any(label.leads for label in labels) == reachable


def test_a_dead_end_and_a_way_through_by_hand() -> None:
    drawn = draw(
        "###############",
        "#.............#",
        "#.###########.#",
        "#.#...........#",
        "#S#.###########",
        "#......#.....G#",
        "######...######",
        "###############",
    )
    world, steps = explore(drawn, reach=2.2)
    around = Surroundings(steps[0])
    labels = label_subgoals(Beyond(world, steps[0], around), steps[0], around, around.subgoals)
    assert all(label.leads for label in labels), "both ways lead round to the goal"
    assert all(label.delta_success >= 0.0 for label in labels)


def test_the_cost_of_a_mistake() -> None:
    labels = [Label(True, 9.0, 1.0, 0.0), Label(False, np.inf, np.inf, 30.0), Label(False, np.inf, np.inf, 0.2)]
    assert misclassification_costs(labels, 1.0).tolist() == [30.0, 30.0, 1.0]
    assert misclassification_costs(labels[:1], 1.0).tolist() == [1.0], "with no other way there is nothing to mistake"


def test_the_book_marks_each_frontier_once() -> None:
    drawn = draw("##########", "#S.......#", "#######..#", "#G.......#", "##########")
    world, steps = explore(drawn)
    book = LabelBook(world, floor_m=1.0)
    first = book.mark_changed(steps[0], Surroundings(steps[0]))
    assert first and not book.mark_changed(steps[0], Surroundings(steps[0]))
