from math import hypot, pi

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import GeometryCollection, LineString, MultiPolygon, Point, Polygon, box

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Door
from pipeline.floorplans.walls import (
    DEEPEST_DOORWAY_M,
    as_area,
    check_crossings,
    door_of,
    free_from_walls,
    inside_of_walls,
    openings_as_area,
    repaired,
    walls_as_area,
    without_cavities,
)

HOUSE = [(0, 0), (10, 0), (10, 6), (0, 6), (0, 0)]
BOW_TIE = Polygon([(0, 0), (4, 4), (4, 0), (0, 4)])


def hollow(x: float, low: float, high: float, thick: float) -> list[LineString]:
    """The two faces of a wall along y, closed at its ends."""
    left, right = x - thick / 2, x + thick / 2
    return [LineString([(left, low), (left, high), (right, high), (right, low), (left, low)])]


def parts(free) -> list[float]:
    return sorted(round(area, 2) for area in shapely.area(shapely.get_parts(free)))


def test_lines_are_walls_of_the_given_thickness():
    free = free_from_walls([LineString(HOUSE)], None, wall_m=0.2)
    assert shapely.symmetric_difference(free, box(0.1, 0.1, 9.9, 5.9)).area < 1e-9


def test_areas_are_walls_as_they_are():
    ring = box(0, 0, 10, 6).difference(box(0.3, 0.3, 9.7, 5.7))
    assert parts(free_from_walls([ring], None, wall_m=5.0)) == [round(9.4 * 5.4, 2)]


@pytest.mark.parametrize("thick", [0.1, 0.2, 0.3, 0.4])
def test_a_wall_drawn_by_both_faces_is_filled(thick):
    free = free_from_walls([LineString(HOUSE), *hollow(5, 0, 6, thick)], None, wall_m=0.05)
    assert len(parts(free)) == 2
    assert not shapely.contains_xy(free, 5, 3)


@pytest.mark.parametrize("thick", [0.1, 0.3, 0.4])
@pytest.mark.parametrize("door", [LineString([(5, 2), (5, 3)]), box(4.7, 2, 5.3, 3)], ids=["line", "area"])
def test_a_door_in_a_hollow_wall_joins_the_rooms_and_not_the_cavity(thick, door):
    free = free_from_walls([LineString(HOUSE), *hollow(5, 0, 6, thick)], None, [door], wall_m=0.05)
    assert len(parts(free)) == 1
    assert shapely.contains_xy(free, 5, 2.5)
    assert not shapely.contains_xy(free, 5, [1.0, 1.9, 3.1, 5.0]).any()


def test_a_door_drawn_as_a_line_goes_through_a_thick_wall_square_to_it():
    wall = box(5 - DEEPEST_DOORWAY_M / 2, 0, 5 + DEEPEST_DOORWAY_M / 2, 6)
    free = free_from_walls([LineString(HOUSE), wall], None, [LineString([(5, 2), (5, 3)])], wall_m=0.1)
    assert len(parts(free)) == 1
    assert shapely.contains_xy(free, 5, [2.01, 2.99]).all()
    assert not shapely.contains_xy(free, 5, [1.99, 3.01]).any()


def test_a_drawn_opening_leaves_no_film_of_wall():
    free = free_from_walls([LineString(HOUSE), box(4.9, 0, 5.1, 6)], None, [box(4.9 + 1e-7, 2, 5.1, 3)], wall_m=0.1)
    assert len(parts(free)) == 1


def test_a_front_door_does_not_let_the_outside_in():
    free = free_from_walls([LineString(HOUSE)], None, [LineString([(4, 0), (5, 0)])], wall_m=0.2)
    assert free.within(box(-0.1, -0.1, 10.1, 6.1).buffer(1e-9))
    assert free.area < 10.2 * 6.2


@pytest.mark.parametrize("gap", [0.01, 1.0, 4.8])
def test_gaps_of_a_facade_are_closed_by_a_dent_of_half_a_disc_at_most(gap):
    free = free_from_walls([LineString([(3 + gap, 0), *HOUSE[1:], (3, 0)])], None, wall_m=0.1)
    assert free.within(box(0, -0.05, 10, 6))
    assert free.area > 9.9 * 5.9 - pi * gap**2 / 8


def test_a_hall_with_a_wider_open_side_is_enclosed_as_a_whole():
    hall = [(0, 0), (20, 0), (20, 20), (13.5, 20)], [(6.5, 20), (0, 20), (0, 0)]
    free = free_from_walls([LineString(line) for line in hall], None, wall_m=0.1)
    assert shapely.contains_xy(free, 10, 10)
    assert free.within(box(0, 0, 20, 20.05))
    assert free.area > 19.9**2 - pi * 7**2 / 8


def test_a_wide_court_stays_outside():
    court = [(0, 0), (30, 0), (30, 20), (24, 20), (24, 6), (6, 6), (6, 20), (0, 20), (0, 0)]
    free = free_from_walls([LineString(court)], None, wall_m=0.1)
    assert shapely.contains_xy(free, [3, 15, 27], [15, 3, 15]).all()
    assert not shapely.contains_xy(free, 15, 15)
    assert free.area == pytest.approx(Polygon(court).area, rel=0.02)


def test_a_lone_pillar_in_front_of_the_house_encloses_nothing():
    pillar = Point(20, 3).buffer(0.3)
    assert parts(free_from_walls([LineString(HOUSE), pillar], None, wall_m=0.2)) == [round(9.8 * 5.8, 2)]


def test_the_given_extent_wins_over_the_walls():
    free = free_from_walls([LineString([(5, 0), (5, 6)])], box(0, 0, 8, 6), wall_m=0.2)
    assert parts(free) == [round(2.9 * 6, 2), round(4.9 * 6, 2)]


def test_without_walls_the_extent_is_free_and_nothing_is_enclosed():
    assert parts(free_from_walls([], box(0, 0, 4, 3), wall_m=0.1)) == [12.0]
    assert free_from_walls([], None, wall_m=0.1).is_empty
    assert inside_of_walls(Polygon()).is_empty


def test_a_wall_that_crosses_itself_is_filled_by_the_even_odd_rule():
    solid = walls_as_area([BOW_TIE], wall_m=0.1)
    assert solid.is_valid
    assert solid.area == pytest.approx(8.0)
    assert shapely.contains_xy(solid, [0.5, 3.5], 2.0).all()
    assert not shapely.contains_xy(solid, 2.0, [0.5, 3.5]).any()


def test_shapes_of_the_caller_stay_as_they_were():
    shapes = np.array([BOW_TIE], dtype=object)
    walls_as_area(shapes, wall_m=0.1)
    assert shapes[0] is BOW_TIE


def test_slivers_and_closets_too_small_for_a_robot_are_wall():
    sliver, closet, room = box(0, 0, 20, 0.3), box(0, 1, 1.3, 2.4), box(0, 5, 2, 6.1)
    assert parts(without_cavities(MultiPolygon([sliver, closet, room]))) == [2.2]


@pytest.mark.parametrize("angle", [0, 30, 90, 137])
def test_a_door_is_as_wide_as_the_longer_side_of_its_box(angle):
    drawn = shapely.affinity.rotate(box(0, 0, 0.9, 0.2), angle, origin=(0, 0))
    door = door_of(drawn, leaf=False)
    assert door == Door(pytest.approx(drawn.centroid.x), pytest.approx(drawn.centroid.y), 0.9, False)


def test_a_door_drawn_as_a_line_is_as_wide_as_it_is_long():
    assert door_of(LineString([(1, 1), (4, 5)])) == Door(2.5, 3.0, hypot(3, 4), True)


def test_openings_without_any_are_empty():
    assert openings_as_area([], wall_m=0.1).is_empty
    assert openings_as_area([Polygon()], wall_m=0.1).is_empty


def test_only_the_areas_of_a_collection_are_kept():
    mixed = GeometryCollection([Point(9, 9), LineString([(0, 0), (9, 9)]), box(0, 0, 1, 1), box(2, 0, 3, 1)])
    assert as_area(mixed).equals(MultiPolygon([box(0, 0, 1, 1), box(2, 0, 3, 1)]))
    assert as_area(LineString([(0, 0), (9, 9)])).is_empty


def test_a_valid_outline_is_kept_and_a_bow_tie_becomes_two():
    assert repaired(box(0, 0, 1, 1), "a") == box(0, 0, 1, 1)
    assert parts(repaired(BOW_TIE, "a")) == [4.0, 4.0]


def test_scribbles_are_refused_before_they_take_minutes():
    turns = np.linspace(0, 2 * np.pi * 500 * 1001 / 2003, 2003)
    star = Polygon(np.column_stack([np.cos(turns), np.sin(turns)]))
    with pytest.raises(PlanError, match=r"^home 7: lines meet more than 300,000 times. Simplify the drawing.$"):
        repaired(star, "home 7")
    hatch = shapely.linestrings([[(0, k), (1000, 1000 - k)] for k in range(1100)])
    with pytest.raises(PlanError, match=r"^home 8: lines meet more than 1,000,000 times"):
        free_from_walls(hatch, None, wall_m=0.1, name="home 8")
    check_crossings(hatch[:900], "home 9")


def test_geometry_that_cannot_be_combined_is_one_clear_error():
    with pytest.raises(PlanError, match=r"^home 3: .* Simplify the drawing.$"):
        free_from_walls([box(0, 0, 1, 1)], Polygon([(0, 0), (np.inf, 0), (1, 1)]), wall_m=0.1, name="home 3")


SPOTS = st.integers(0, 40).map(lambda tenth: tenth / 4)
LINES = st.tuples(SPOTS, SPOTS, SPOTS, SPOTS).map(lambda ends: LineString([ends[:2], ends[2:]]))


@settings(max_examples=60, deadline=None)
@given(st.lists(LINES, max_size=8), st.lists(LINES, max_size=3))
def test_whatever_is_drawn_no_free_floor_lies_in_a_wall_or_outside(lines, doors):
    walls = [LineString(HOUSE), *lines]
    free = free_from_walls(walls, None, doors, wall_m=0.1)
    solid = walls_as_area(walls, wall_m=0.1)
    cut = openings_as_area([door for door in doors if door.length > 0], wall_m=0.1)
    assert free.is_valid
    assert shapely.intersection(free, solid).difference(cut.buffer(1e-6)).area < 1e-6
    assert free.within(inside_of_walls(solid).buffer(1e-6))
