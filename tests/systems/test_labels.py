"""Labels equal a slow reading of their definition, and a reader can check two of them by hand."""

import numpy as np
import pytest
from hypothesis import given, settings

from pipeline.grids.partial_map import CLEAR, UNSEEN
from pipeline.grids.zones import REACHED
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Surroundings
from pipeline.simulation.trial import Robot, run_trial
from pipeline.simulation.world import World, make_world
from pipeline.systems.subgoals.beyond import Beyond
from pipeline.systems.subgoals.labels import Label, LabelBook, label_subgoals, misclassification_costs
from tests.planning.test_subgoals import seen_of
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
    run_trial(world, drawn.start, drawn.goal, recorder, robot=Robot(small_lidar(reach), step_m=1.0),
              rng=np.random.default_rng(0))  # fmt: skip
    return world, recorder.seen


def octile(drow: int, dcol: int) -> float:
    return max(abs(drow), abs(dcol)) + (np.sqrt(2.0) - 1.0) * min(abs(drow), abs(dcol))


def slow_gate(seen: Seen, cells: np.ndarray) -> int:
    """The first cell of the frontier on a shortest way robot -> frontier -> goal, each way one plain search."""
    reach = slow_field(seen.map.status == CLEAR, *seen.pose[:2]).ravel()
    onward = slow_field(seen.map.status <= UNSEEN, *seen.goal).ravel()
    ways = [reach[cell] + onward[cell] for cell in cells]
    return next(int(cell) for cell, way in zip(cells, ways, strict=True) if way <= min(ways) + 1e-9)


def slow_label(world: World, seen: Seen, reached: np.ndarray, cells: np.ndarray) -> Label:
    cols, point = reached.shape[1], slow_gate(seen, cells)
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
            expected = slow_label(world, seen, reached, subgoal.cells)
            assert tuple(label) == pytest.approx(expected, abs=1e-6)


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


def labels_of(known: tuple[str, ...], truth: tuple[str, ...]) -> list[Label]:
    """Labels on cells of 0.5 m for a robot at S that knows ``known`` of ``truth``."""
    drawn = draw(*known)
    seen = seen_of(drawn.grid.cells, drawn.start, drawn.goal)._replace(resolution=0.5)
    world = make_world("drawn", draw(*truth, resolution=0.5).grid, 0.0)
    around = Surroundings(seen)
    return label_subgoals(Beyond(world, seen, around), seen, around, around.subgoals)


# The frontier is the column right of S, five cells high. The optimistic way crosses it in the lowest row: that is its
# gate. Its middle lies two rows above.
HALF_A_ROOM = (
    "##########",
    "#...?????#",
    "#...?????#",
    "#...?????#",
    "#...?????#",
    "#S..???G?#",
    "##########",
)


def test_a_way_through_by_hand_is_measured_from_the_gate() -> None:
    truth = (
        "##########",
        "#........#",
        "#....#...#",
        "#....#...#",
        "#....#...#",
        "#S...#.G.#",
        "##########",
    )
    (label,) = labels_of(HALF_A_ROOM, truth)
    # From the gate up beside the wall, sqrt(2) + 3; two cells over its end; down to G, sqrt(2) + 3. Optimistic: 4.
    # (From the middle of the frontier it would be 4 + 2 sqrt(2) cells, and the difference 4 instead of 6.8.)
    way = 2.0 * (np.sqrt(2.0) + 3.0) + 2.0
    assert tuple(label) == pytest.approx((True, 0.5 * way, 0.5 * (way - 4.0), 0.0))


def test_a_dead_end_by_hand_is_explored_from_the_gate() -> None:
    truth = (
        "##########",
        "#......#.#",
        "#......#.#",
        "#......#.#",
        "#......#.#",
        "#S.....#G#",
        "##########",
    )
    (label,) = labels_of((*HALF_A_ROOM[:5], "#S..????G#", HALF_A_ROOM[6]), truth)
    # Beyond lie columns 4 to 6. Nearest to the gate is the cell beside it, 1; farthest the upper right one, three
    # diagonal moves and one straight. There and back: 2 x 3 sqrt(2) cells. (From the middle: 2 x 2 sqrt(2).)
    assert tuple(label) == (False, np.inf, np.inf, pytest.approx(0.5 * 6.0 * np.sqrt(2.0)))


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
