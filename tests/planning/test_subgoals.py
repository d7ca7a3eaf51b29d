"""Frontiers and subgoals equal their definitions, and pockets that cannot hold the goal get none."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN, Cell, Cells
from pipeline.grids.partial_map import BLOCKED, CLEAR, UNSEEN, map_of
from pipeline.planning.seen import Pose, Seen
from pipeline.planning.subgoals import Surroundings
from tests.twins import MOVES, slow_components, slow_field
from tests.worlds import draw

CROSS = [(1, 0), (-1, 0), (0, 1), (0, -1)]


def seen_of(known: Cells, robot: Cell, goal: Cell) -> Seen:
    status = np.select([known == FREE, known == UNKNOWN], [CLEAR, UNSEEN], BLOCKED).astype(np.uint8)
    status[0], status[-1], status[:, 0], status[:, -1] = BLOCKED, BLOCKED, BLOCKED, BLOCKED
    return Seen(map_of(known, status), Pose(*robot, 0.0), goal, np.zeros(8, np.float32), 1.0, 0)


def cells_of(seen: Seen) -> list[set[tuple[int, int]]]:
    cols = seen.map.known.shape[1]
    return [set(map(tuple, np.stack(np.divmod(s.cells, cols), 1).tolist())) for s in Surroundings(seen).subgoals]


def test_two_ways_on_make_two_subgoals() -> None:
    drawn = draw(
        "#########",
        "#???#???#",
        "#?#####?#",
        "#?..S..?#",
        "#?#####?#",
        "#???G???#",
        "#########",
    )
    assert cells_of(seen_of(drawn.grid.cells, drawn.start, drawn.goal)) == [{(3, 2)}, {(3, 6)}]


def test_a_pocket_that_the_map_proves_closed_gets_no_subgoal() -> None:
    drawn = draw(
        "##########",
        "#??#######",
        "#..S..???#",
        "#######?G#",
        "##########",
    )
    assert cells_of(seen_of(drawn.grid.cells, drawn.start, drawn.goal)) == [{(2, 5)}]


def test_a_goal_that_was_seen_but_is_cut_off_still_has_subgoals() -> None:
    drawn = draw(
        "#########",
        "#S.#?...#",
        "#..?....#",
        "#..?..G.#",
        "#########",
    )
    assert cells_of(seen_of(drawn.grid.cells, drawn.start, drawn.goal)) == [{(1, 2), (2, 2)}]


def test_the_point_is_the_middle_of_the_frontier() -> None:
    drawn = draw("#######", "#S....#", "#.....#", "#?????#", "#??G??#", "#######")
    (subgoal,) = Surroundings(seen_of(drawn.grid.cells, drawn.start, drawn.goal)).subgoals
    assert divmod(subgoal.point, 7) == (3, 3)


@settings(deadline=None, max_examples=120)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 0.5), st.floats(0.1, 0.8))
def test_subgoals_equal_the_slow_definition(seed: int, walls: float, unknown: float) -> None:
    rng = np.random.default_rng(seed)
    known = np.where(rng.random((14, 15)) < walls, OCCUPIED, FREE).astype(np.uint8)
    known[rng.random(known.shape) < unknown] = UNKNOWN
    robot, goal = Cell(*rng.integers(1, 13, 2)), Cell(*rng.integers(1, 13, 2))
    known[robot] = FREE
    known[goal] = UNKNOWN if robot != goal else FREE
    seen = seen_of(known, robot, goal)
    status = seen.map.status
    reached = np.isfinite(slow_field(status == CLEAR, *robot))
    beyond = [(r, c) for r, c in np.argwhere((status <= UNSEEN) & ~reached).tolist()]
    holding_goal = next((part for part in slow_components(beyond, CROSS) if tuple(goal) in part), set())
    border = {
        (r, c) for r, c in np.argwhere(reached).tolist() if any((r + dr, c + dc) in holding_goal for dr, dc in CROSS)
    }
    expected = sorted(map(sorted, slow_components(border, MOVES)))
    assert sorted(map(sorted, cells_of(seen))) == expected
