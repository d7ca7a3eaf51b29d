"""A drive without a goal ends when all in reach was seen, and a planner that says so too early is refused."""

import numpy as np
import pytest

from pipeline.errors import PlannerError, TrialError
from pipeline.grids.distances import NOWHERE, descend, open_field, settle, workspace_for
from pipeline.grids.occupancy import FREE, UNKNOWN, Cell
from pipeline.grids.partial_map import CLEAR
from pipeline.planning.seen import NO_GOAL, Seen
from pipeline.simulation.answers import frontier_cells
from pipeline.simulation.trial import Cover, Ending, Episode, Robot, run_trial
from pipeline.simulation.world import make_world
from tests.worlds import cells_from, draw, small_lidar

# A room with a niche around the corner and, behind a wall without a door, a room that nobody reaches.
NICHE = (
    "############",
    "#......#...#",
    "#.S....#...#",
    "#......#...#",
    "####.#######",
    "#....#.....#",
    "#.##.#.....#",
    "############",
)


class ToTheFirst:
    """Drives to the first frontier cell in the order of rows, for ``most`` decisions."""

    def __init__(self, most: int = 10_000) -> None:
        self.most, self.goals = most, set()

    def plan(self, seen: Seen) -> np.ndarray | None:
        self.most -= 1
        self.goals.add(seen.goal)
        status, cols = seen.map.status, seen.map.status.shape[1]
        field, home = open_field(status, CLEAR), seen.pose.row * cols + seen.pose.col
        settle(field, cols, home, NOWHERE, workspace_for(field.size))
        left = frontier_cells(field, status)
        return descend(field, cols, int(left[0]), home)[::-1].copy() if left.size and self.most >= 0 else None


def drive(planner: ToTheFirst, reach: float = 2.0, **changes: int) -> Episode:
    drawn = draw(*NICHE)
    return run_trial(make_world("niche", drawn.grid, 0.0), drawn.start, Cover(), planner,
                     robot=Robot(small_lidar(reach), step_m=1.0), rng=np.random.default_rng(0), **changes)  # fmt: skip


def test_a_drive_without_a_goal_ends_when_all_that_can_be_reached_was_seen() -> None:
    planner = ToTheFirst()
    episode = drive(planner)
    reached = cells_from(*(line.replace("S", ".") for line in NICHE)) == FREE
    reached[1:3, 6:11] = reached[4:7, 8:11] = False  # the two rooms without a door
    assert episode.ending is Ending.COVERED and str(episode.ending) == "saw all that can be reached"
    assert (episode.known[reached] == FREE).all() and (episode.known[4:7, 8:11] == UNKNOWN).all()
    assert planner.goals == {NO_GOAL}


def test_who_says_too_early_that_all_was_seen_is_refused() -> None:
    with pytest.raises(PlannerError, match=r"ToTheFirst on niche, scan 1: all was said to be seen, although \d+ cells "
                                           r"in reach border unseen space, the nearest at row \d+, col \d+, [12]\.\d m "
                                           "away"):  # fmt: skip
        drive(ToTheFirst(0))
    with pytest.raises(PlannerError, match="all was said to be seen"):
        drive(ToTheFirst(3))


def test_without_a_goal_the_step_limit_still_holds() -> None:
    assert drive(ToTheFirst(), max_steps=2).ending is Ending.CUT_OFF


def test_frontier_cells_are_reached_and_border_unseen_space_by_a_side() -> None:
    status = np.array(
        [[2, 2, 2, 2, 2, 2], [2, 0, 0, 1, 2, 2], [2, 0, 0, 2, 0, 2], [2, 2, 2, 2, 1, 2], [2] * 6], np.uint8
    )
    field = open_field(status, CLEAR)
    settle(field, 6, 1 * 6 + 1, NOWHERE, workspace_for(field.size))
    # Row 2, col 2 touches the unseen cell by a corner only; row 2, col 4 has one below it, yet nothing leads there.
    assert frontier_cells(field, status).tolist() == [1 * 6 + 2]


def test_a_start_in_a_wall_is_refused_without_a_goal_too() -> None:
    drawn = draw(*NICHE)
    with pytest.raises(TrialError, match="the start at row 0, col 0 lies in a wall"):
        run_trial(make_world("niche", drawn.grid, 0.0), Cell(0, 0), Cover(), ToTheFirst(),
                  robot=Robot(small_lidar(2.0), step_m=1.0), rng=np.random.default_rng(0))  # fmt: skip
