import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import MultiPolygon, Point, Polygon, box

from pipeline.floorplans.doorways import Side, cut_doorway
from tests.floorplans.real_data import plan_files, read_entry

WALL_M = 0.2
NOBODY = Polygon()


def side(outline: Polygon) -> Side:
    return Side(outline, outline.buffer(-WALL_M / 2, join_style="mitre"))


WEST, EAST = side(box(0, 0, 5, 4)), side(box(5, 0, 10, 4))


def cut(x: float, y: float, width: float = 0.9, sides=(WEST, EAST), others=NOBODY):
    return cut_doorway(Point(x, y), width, sides, others, WALL_M)


def joined(doorway, sides=(WEST, EAST)) -> bool:
    free = shapely.union_all([doorway.floor, *(each.floor for each in sides)])
    return free.geom_type == "Polygon"


def test_a_doorway_is_a_rectangle_through_the_wall_of_the_asked_width():
    doorway = cut(5, 2)
    assert doorway.width == 0.9
    assert doorway.floor.bounds == pytest.approx((4.89, 1.55, 5.11, 2.45))
    assert doorway.floor.equals(shapely.envelope(doorway.floor))
    assert joined(doorway)


@pytest.mark.parametrize("x", [4.7, 4.9, 5.1, 5.3])
def test_a_door_drawn_beside_the_wall_is_cut_through_it(x):
    assert cut(x, 2).floor.bounds == pytest.approx((4.89, 1.55, 5.11, 2.45))


@pytest.mark.parametrize(("y", "low"), [(0.0, 0.1), (0.3, 0.1), (3.9, 3.0), (4.0, 3.0)])
def test_a_door_at_a_corner_slides_clear_of_it(y, low):
    doorway = cut(5, y)
    assert doorway.width == 0.9
    assert doorway.floor.bounds[1] == pytest.approx(low, abs=0.05)
    assert doorway.floor.bounds[1] >= 0.1 - 1e-9
    assert doorway.floor.bounds[3] <= 3.9 + 1e-9


@pytest.mark.parametrize(("shared", "width"), [(1.15, 0.9), (1.05, 0.85 * 0.9), (0.9, 0.7 * 0.9)])
def test_a_doorway_gets_narrower_where_the_shared_wall_is_short(shared, width):
    niche = side(box(5, 1, 10, 1 + shared))
    doorway = cut(5, 1 + shared / 2, sides=(WEST, niche))
    assert doorway.width == pytest.approx(width)
    assert joined(doorway, (WEST, niche))


@pytest.mark.parametrize("gap", [0.0, 0.15, 0.4])
def test_the_cut_is_as_deep_as_the_gap_between_two_rooms(gap):
    east = side(box(5 + gap, 0, 10, 4))
    doorway = cut(5 + gap / 2, 2, sides=(WEST, east))
    assert doorway.width == 0.9
    assert joined(doorway, (WEST, east))


@pytest.mark.parametrize("turn", [0, 17, 45, 90, 211])
def test_a_doorway_stands_square_to_a_wall_at_any_angle(turn):
    sides = tuple(Side(*(shapely.affinity.rotate(part, turn, origin=(0, 0)) for part in each)) for each in (WEST, EAST))
    spot = shapely.affinity.rotate(Point(5, 2), turn, origin=(0, 0))
    doorway = cut_doorway(spot, 0.9, sides, NOBODY, WALL_M)
    straight = shapely.affinity.rotate(doorway.floor, -turn, origin=(0, 0))
    assert straight.bounds == pytest.approx((4.89, 1.55, 5.11, 2.45), abs=1e-6)


def test_a_doorway_keeps_a_wall_to_a_third_room():
    third = box(4.95, 2.0, 5.05, 2.1)
    doorway = cut(5, 2, others=third)
    assert doorway.width == 0.9
    assert doorway.floor.distance(third) >= 0.98 * WALL_M
    assert joined(doorway)


def test_rooms_that_share_no_wall_there_are_not_joined():
    assert cut(5.4, 2, sides=(WEST, side(box(5.8, 0, 10, 4)))) is None
    assert cut(5, 2, sides=(WEST, side(box(9, 0, 12, 4))), others=box(5, -10, 9, 10)) is None
    assert cut(5, 4, sides=(WEST, side(box(5, 4, 10, 8)))) is None  # they touch in a corner


def test_a_wall_in_small_steps_is_crossed_by_the_shortest_way():
    """No piece of the outline is long enough to say how the wall runs."""
    steps = np.arange(0, 4.01, 0.08)
    zigzag = np.column_stack([5 + 0.03 * (np.arange(len(steps)) % 2), steps])
    west = side(Polygon([(0, 0), *zigzag, (0, 4)]))
    east = side(Polygon([(10, 0), *zigzag, (10, 4)]))
    doorway = cut(5, 2, sides=(west, east))
    assert 0.9 / 2 * 0.7 < doorway.width <= 0.7 * 0.9 + 1e-9
    assert joined(doorway, (west, east))


SIZES = st.floats(0.5, 6.0)


@settings(max_examples=60, deadline=None)
@given(st.floats(-1.0, 5.0), st.floats(-3.0, 3.0), SIZES, st.floats(0.5, 1.5), st.floats(0.0, 6.0))
def test_wherever_a_door_lies_it_opens_between_its_rooms_and_no_third(y, low, height, width, third):
    east = side(box(5, low, 10, low + height))
    other = box(4.9, third, 5.1, third + 0.2)
    found = cut_doorway(Point(5, y), width, (WEST, east), other, WALL_M)
    if found is None:
        return
    assert isinstance(found.floor, Polygon | MultiPolygon)
    assert found.floor.is_valid
    assert 0.35 * width <= found.width <= width
    assert joined(found, (WEST, east))
    assert not found.floor.intersects(other)
    outlines = shapely.union_all([WEST.outline, east.outline])
    closed = outlines.buffer(0.35 * width).buffer(-0.35 * width)  # a strip may round off a corner between the two
    assert found.floor.difference(closed.buffer(1e-6)).area < 1e-6


@pytest.mark.parametrize("school", ["Vipiteno1", "rockislandgroundfloor"])
def test_a_doorway_through_crooked_walls_opens_in_its_width_and_not_by_a_corner(school):
    with plan_files("luperto_schools_offices") as files:
        (entry,) = [entry for entry in files if school in entry.file.name]
        (plan,) = read_entry(entry)
    areas = np.sort(shapely.area(shapely.get_parts(plan.free.buffer(-0.1))))
    assert areas[:-1].sum() < 1.0
