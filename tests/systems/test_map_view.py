"""What the whole map shows of a subgoal, on worlds a reader can see."""

import numpy as np
import pytest

from pipeline.datums import MAP_VIEW as STORED
from pipeline.grids.occupancy import Cell
from pipeline.grids.partial_map import BLOCKED, CLEAR, UNSEEN, map_of
from pipeline.planning.seen import Pose, Seen
from pipeline.planning.subgoals import Surroundings
from pipeline.systems.subgoals.map_inputs import (
    DIRECTIONS,
    FARTHEST_M,
    MAP_INPUTS,
    MAP_VIEW,
    NUMBERS,
    SIGHT_M,
    map_inputs,
)
from pipeline.systems.subgoals.map_view import MapViews
from tests.worlds import cells_from

# The robot R has seen the corridor; it ends in two frontiers, west and east. The goal lies to the east.
CORRIDOR = (
    "#######################",
    "#?????????????????????#",
    "#???###########???????#",
    "#???...........???????#",
    "#???...........???????#",
    "#???...........???????#",
    "#???###########???????#",
    "#?????????????????????#",
    "#######################",
)
ROBOT, GOAL = Cell(4, 8), Cell(4, 20)


def seen_from(lines, robot=ROBOT, goal=GOAL, resolution=0.5):
    known = cells_from(*lines)
    status = np.choose(known, [CLEAR, BLOCKED, UNSEEN]).astype(np.uint8)
    ranges = np.zeros(256, dtype=np.float32)
    return Seen(map_of(known, status), Pose(robot.row, robot.col, 0.0), goal, ranges, resolution, 0)


def views_of(seen):
    around = Surroundings(seen)
    return around, MapViews(seen, around).views(seen, around.subgoals)


def numbers(seen):
    """The named numbers of each subgoal, by the column of its point."""
    around, views = views_of(seen)
    cols = seen.map.known.shape[1]
    return {
        each.point % cols: dict(zip(NUMBERS, view, strict=False))
        for each, view in zip(around.subgoals, views, strict=True)
    }


def test_the_datum_table_stores_as_much_as_a_view_holds():
    assert STORED == MAP_VIEW


def test_two_ends_of_a_corridor():
    found = numbers(seen_from(CORRIDOR))
    west, east = found[4], found[14]
    assert (east["reach_m"], east["onward_m"], east["straight_m"], east["detour_m"]) == (3.0, 3.0, 3.0, 0.0)
    assert (east["behind_m"], east["nearer"], east["rivals"], east["cells"], east["extent"]) == (0, 0, 2, 3, 3)
    assert (east["facing"], east["aside"]) == pytest.approx((1, 0))
    assert (west["facing"], west["aside"]) == pytest.approx((-1, 0), abs=1e-6)
    assert west["behind_m"] == -east["lead_m"] == west["lead_m"] > 0
    assert west["nearer"] == 1


def test_the_way_through_unseen_space_does_not_turn_back_through_the_corridor():
    west = numbers(seen_from(CORRIDOR))[4]
    assert west["onward_m"] == 8.0  # back through the corridor and out of the other end
    assert west["beyond_0.0_m"] > 9.0  # around it
    assert west["rival_beyond_0.0_m"] == 3.0


def test_a_slit_is_no_way_on_for_one_who_keeps_clear():
    slit = tuple(line[:17] + "#" + line[18:] if 0 < k < 8 and k != 4 else line for k, line in enumerate(CORRIDOR))
    east = numbers(seen_from(slit))[14]
    assert east["beyond_0.0_m"] < 9.0
    assert east["beyond_0.9_m"] == FARTHEST_M


def turned(lines, how):
    drawn = np.array([list(line) for line in lines])
    return tuple("".join(line) for line in how(drawn))


@pytest.mark.parametrize("how", [np.fliplr, np.flipud, np.rot90, np.transpose])
def test_a_turned_or_mirrored_building_gives_the_same_view(how):
    marks = np.zeros((9, 23), dtype=int)
    marks[8 - ROBOT.row, ROBOT.col], marks[8 - 2, 19] = 1, 2  # the drawing's first line is the highest row
    plain = seen_from(CORRIDOR, goal=Cell(2, 19))
    marks = how(marks)
    (robot,), (goal,) = ([Cell(int(len(marks) - 1 - r), int(c)) for r, c in np.argwhere(marks == m)] for m in (1, 2))
    other = seen_from(turned(CORRIDOR, how), robot, goal)
    views = []
    for seen in (plain, other):
        _, found = views_of(seen)
        views.append(found[np.argsort(found[:, 4])])
    assert views[0].shape == (2, MAP_VIEW)
    np.testing.assert_allclose(views[0][:, : len(NUMBERS)], views[1][:, : len(NUMBERS)], atol=1e-4)
    rays = [each[:, len(NUMBERS) :].reshape(2, 3, DIRECTIONS) for each in views]
    # A line along the edge of two cells may take either side.
    assert np.isclose(rays[0], rays[1], atol=1e-3).mean() > 0.9


def test_inputs_are_finite_and_keep_angles_as_they_are():
    seen = seen_from(CORRIDOR)
    _, views = views_of(seen)
    inputs = map_inputs(views)
    assert inputs.shape == (2, MAP_INPUTS)
    assert np.isfinite(inputs).all()
    assert (views[:, len(NUMBERS) :] <= SIGHT_M + 1e-6).all()
    assert np.array_equal(inputs[:, NUMBERS.index("facing")], views[:, NUMBERS.index("facing")])
    assert inputs[0, 0] == pytest.approx(np.log1p(views[0, 0]))


def test_asking_for_one_subgoal_gives_its_view_among_all():
    seen = seen_from(CORRIDOR)
    around, both = views_of(seen)
    assert np.array_equal(MapViews(seen, around).views(seen, around.subgoals[1:]), both[1:])
