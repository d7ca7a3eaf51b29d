from itertools import pairwise
from time import process_time

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import affinity
from shapely.geometry import LineString, MultiPolygon, Point, Polygon, box

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Room
from pipeline.floorplans.rooms import (
    JoinedRooms,
    Passage,
    free_from_rooms,
    only_polygons,
    repair_outline,
    say_count,
    say_repaired,
)

WALL = 0.2
LEFT, RIGHT = box(0, 0, 4, 4), box(4, 0, 8, 4)
nine = st.floats(-9, 9)
BOW_TIE = Polygon([(0, 0), (4, 4), (4, 0), (0, 4)])


def join(outlines, passages=(), **options) -> JoinedRooms:
    rooms = [Room(outline, f"room {number}") for number, outline in enumerate(outlines)]
    return free_from_rooms(rooms, passages, **({"wall_m": WALL, "door_width_m": 0.9} | options))


def parts(joined: JoinedRooms) -> int:
    return shapely.get_num_geometries(joined.free)


def passed(joined: JoinedRooms, start: tuple[float, float], end: tuple[float, float]) -> float:
    """Length of the line between two points that is free."""
    return joined.free.intersection(LineString([start, end])).length


def test_rooms_without_doors_are_sealed_by_a_wall_of_the_given_thickness():
    joined = join([LEFT, RIGHT])
    assert joined.free.equals(MultiPolygon([box(0.1, 0.1, 3.9, 3.9), box(4.1, 0.1, 7.9, 3.9)]))
    assert (joined.doors, joined.remarks) == ((), ())


@pytest.mark.parametrize("rooms", [(0, 1), (1, 0), None])
@pytest.mark.parametrize("width", [None, 0.7, 1.5])
def test_a_door_is_cut_to_its_width_or_the_given_one(rooms, width):
    joined = join([LEFT, RIGHT], [Passage(4, 2, rooms, width, leaf=False)])
    (door,) = joined.doors
    assert door == pytest.approx((4, 2, width or 0.9, False))
    assert parts(joined) == 1
    assert passed(joined, (4, 0), (4, 4)) == pytest.approx(width or 0.9)
    assert joined.remarks == ()


@pytest.mark.parametrize("rooms", [(0, 1), None])
def test_a_door_beside_the_wall_is_cut_through_it(rooms):
    joined = join([LEFT, RIGHT], [Passage(4.15, 2, rooms)])
    assert parts(joined) == 1
    assert joined.doors[0] == pytest.approx((4, 2, 0.9, True))


@pytest.mark.parametrize("gap", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("rooms", [(0, 1), None])
def test_the_cut_is_as_deep_as_the_gap_between_neighbours(gap, rooms):
    joined = join([LEFT, affinity.translate(RIGHT, gap)], [Passage(4, 2, rooms)])
    assert parts(joined) == 1
    assert passed(joined, (4, 0), (4, 4)) == pytest.approx(0.9)


def test_neighbours_that_overlap_by_a_pixel_are_joined():
    joined = join([LEFT, box(3.9, 0, 8, 4)], [Passage(3.95, 2, (0, 1))])
    assert parts(joined) == 1
    assert len(joined.doors) == 1


def test_a_booth_inside_a_hall_keeps_its_floor():
    hall, booth = box(0, 0, 12, 10), box(4, 4, 7, 7)
    joined = join([hall, booth])
    assert parts(joined) == 2
    assert shapely.contains_xy(joined.free, 5, 5)
    assert passed(joined, (5.5, 5.5), (5.5, 9.9)) == pytest.approx(1.4 + 2.8)  # a wall around the booth
    opened = join([hall, booth], [Passage(5.5, 7, (0, 1))])
    assert parts(opened) == 1
    assert passed(opened, (5.5, 5.5), (5.5, 9.9)) == pytest.approx(4.4)


def test_a_door_at_a_corner_slides_until_it_fits():
    joined = join([LEFT, RIGHT], [Passage(4, 0.1, (0, 1))])
    (door,) = joined.doors
    assert door.width == 0.9
    assert 0.55 <= door.y <= 0.65
    assert passed(joined, (4, 0), (4, 4)) == pytest.approx(0.9)


@pytest.mark.parametrize(("shared", "width"), [(1.2, 0.9), (1.0, 0.765), (0.85, 0.63)])
def test_a_door_in_a_short_wall_gets_narrower(shared, width):
    joined = join([LEFT, box(4, 4 - shared, 8, 8 - shared)], [Passage(4, 4 - shared / 2, (0, 1))])
    assert parts(joined) == 1
    assert joined.doors[0].width == pytest.approx(width)
    assert passed(joined, (4, 0), (4, 8)) == pytest.approx(width)


def test_a_door_between_rooms_that_share_no_wall_stays_closed_and_is_said():
    joined = join([LEFT, box(4, 4, 8, 8)], [Passage(4, 4, (0, 1))])
    assert parts(joined) == 2
    assert joined.doors == ()
    assert joined.remarks == ("1 door joins rooms that share no wall there, and stays closed",)


def test_doors_to_nowhere_stay_closed_and_are_said():
    front, lost, far = Passage(0, 2), Passage(100, 100), Passage(4, 9, (0, 1))
    joined = join([LEFT, RIGHT], [front, lost, far])
    assert (parts(joined), joined.doors) == (2, ())
    assert joined.remarks == ("3 doors lead outside or to no outlined room and stay closed",)


def test_a_door_said_by_both_rooms_is_cut_once():
    near = [Passage(4, 2, (0, 1)), Passage(4, 2.3, (1, 0)), Passage(4, 1.2, (0, 1)), Passage(4, 2.01, (0, 1))]
    assert [door.y for door in join([LEFT, RIGHT], near).doors] == pytest.approx([2, 1.2])
    points = [Passage(4, 1), Passage(4.01, 1.01), Passage(4, 3)]
    assert [door.y for door in join([LEFT, RIGHT], points).doors] == pytest.approx([1, 3])


def test_a_door_without_rooms_joins_those_straight_through_the_wall():
    above = box(0, 4, 8, 8)  # a third room close to the door, but not across its wall
    joined = join([LEFT, RIGHT, above], [Passage(4, 3.2)])
    (part,) = (part for part in joined.free.geoms if shapely.contains_xy(part, 1, 1))
    assert shapely.contains_xy(part, 7, 1) and not shapely.contains_xy(part, 4, 6)


def test_a_cut_never_opens_a_third_room():
    below = box(-4, -4, 12, 0)
    for y in np.arange(0.05, 1.0, 0.1):
        joined = join([LEFT, RIGHT, below], [Passage(4, y, (0, 1))])
        assert parts(joined) == 2
        assert joined.free.intersection(box(-4, -0.1, 12, 0.1)).area < 1e-9


def test_rooms_without_walls_are_one_space_where_they_touch():
    hall = box(0, 4, 8, 6)
    joined = join([LEFT, RIGHT, hall], open_rooms=frozenset((1, 2)))
    assert parts(joined) == 2
    assert passed(joined, (6, 1), (6, 5)) == pytest.approx(4)  # no wall at y = 4
    assert passed(joined, (2, 1), (2, 5)) == pytest.approx(3.8)


def test_a_door_between_open_rooms_is_a_wall_with_a_door():
    joined = join([LEFT, RIGHT], [Passage(4, 2, (0, 1))], open_rooms=frozenset((0, 1)))
    assert passed(joined, (4, 0), (4, 4)) == pytest.approx(0.9)


def test_open_rooms_that_touch_in_a_corner_are_not_one_space():
    assert parts(join([LEFT, box(4, 3.8, 8, 8)], open_rooms=frozenset((0, 1)))) == 2
    assert parts(join([LEFT, box(4, 3.5, 8, 8)], open_rooms=frozenset((0, 1)))) == 1


def test_a_door_within_one_open_space_is_kept_as_a_mark():
    middle = box(3, 4, 5, 6)
    joined = join([LEFT, RIGHT, middle], [Passage(4, 2, (0, 0))], open_rooms=frozenset((0, 2, 1)))
    assert parts(joined) == 1
    assert joined.doors == ((4, 2, 0.9, True),)


def test_rooms_that_cross_themselves_are_repaired_and_said():
    joined = join([BOW_TIE, RIGHT])
    assert joined.free.is_valid
    assert joined.remarks == ("1 outline crossed itself and was repaired",)
    assert join([BOW_TIE, BOW_TIE.buffer(0), affinity.translate(BOW_TIE, 9)]).remarks[0] == say_repaired(2)


def test_rooms_without_floor_are_said():
    thin, line = box(20, 0, 20.1, 4), Polygon([(30, 0), (31, 0), (32, 0)])
    joined = join([LEFT, thin, line, LEFT], [Passage(20, 2, (0, 1))])
    assert joined.remarks[-2:] == (
        "3 rooms have no floor of their own: thinner than walls, or under other rooms",
        "1 door leads outside or to no outlined room and stays closed",
    )
    assert parts(joined) == 1


def test_without_rooms_there_is_no_floor():
    with pytest.raises(PlanError, match="there is no room, expected at least one closed outline"):
        join([])


def test_far_too_much_is_refused_before_it_takes_minutes():
    before = process_time()
    scribble = Polygon(np.random.default_rng(0).uniform(0, 50, (5000, 2)))
    with pytest.raises(PlanError, match=r"the outline of a room: lines meet more than 300,000 times"):
        join([scribble])
    with pytest.raises(PlanError, match=r"640,000 pairs of rooms touch or overlap; this is no floor"):
        join([LEFT] * 800)
    with pytest.raises(PlanError, match=r"more than 10,000 doors, at most that many are read"):
        join([LEFT, RIGHT], [Passage(k, 0, (0, 1)) for k in range(10_001)])
    assert process_time() - before < 10


def test_a_large_outline_may_cross_itself_once_and_repeat_its_corners():
    angles = np.repeat(np.linspace(0, 2 * np.pi, 40_000), 3)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    spiked = np.concatenate([10 * ring, [(10, 5), (9, -5)]])
    joined = join([Polygon(spiked)])
    assert joined.remarks == (say_repaired(1),)
    assert joined.free.area == pytest.approx(np.pi * 9.9**2, rel=0.05)


def test_an_outline_that_goes_back_and_forth_is_refused_without_much_memory():
    many = np.tile([(0.0, 0.0), (5.0, 5.0), (0.0, 5.0)], (100_000, 1))
    before = process_time()
    with pytest.raises(PlanError, match="lines meet more than"):
        repair_outline(Polygon(many))
    assert process_time() - before < 10


def test_a_wall_of_many_corners_is_crossed_in_time():
    angles = np.linspace(0, 2 * np.pi, 100_000)
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    around = Polygon(9 * ring, [4 * ring[::-1]])
    before = process_time()
    joined = join([Polygon(4 * ring), around], [Passage(4, 0), Passage(-4, 0), Passage(0, 4)])
    assert process_time() - before < 10
    assert parts(joined) == 1 and len(joined.doors) == 3


def test_repairing_keeps_valid_outlines_and_all_polygons():
    assert repair_outline(LEFT) == (LEFT, False)
    whole, crossed = repair_outline(BOW_TIE)
    assert crossed and whole.is_valid
    assert whole.area == pytest.approx(8)
    assert repair_outline(Polygon([(0, 0), (1, 0), (2, 0)]))[0].is_empty


def test_only_polygons_are_kept_of_a_collection():
    mixed = shapely.GeometryCollection([Point(0, 0), LineString([(0, 0), (1, 1)]), LEFT])
    assert only_polygons(mixed).equals(LEFT)
    nested = shapely.GeometryCollection([MultiPolygon([LEFT, affinity.translate(RIGHT, 1)]), Point(0, 0)])
    assert only_polygons(nested).area == 32
    assert only_polygons(Point(0, 0)).is_empty and only_polygons(Polygon()).is_empty


def test_counts_are_said_in_words():
    assert [say_count(number, "door") for number in (0, 1, 2)] == ["0 doors", "1 door", "2 doors"]
    assert say_repaired(1) == "1 outline crossed itself and was repaired"
    assert say_repaired(2) == "2 outlines crossed themselves and were repaired"


@st.composite
def floors(draw):
    """A grid of rooms of various sizes, doors along a random tree over them, turned by any angle: (rooms, doors)."""
    sides = st.lists(st.floats(1.5, 8), min_size=1, max_size=4)
    xs, ys = (np.cumsum([0.0, *draw(sides)]) for _ in range(2))
    cells = [(col, row) for row in range(len(ys) - 1) for col in range(len(xs) - 1)]
    angle, east, north = draw(st.floats(0, 360)), draw(st.floats(-1e4, 1e4)), draw(st.floats(-1e4, 1e4))

    def placed(shape):
        return affinity.translate(affinity.rotate(shape, angle, origin=(0, 0)), east, north)

    outlines = [placed(box(xs[col], ys[row], xs[col + 1], ys[row + 1])) for col, row in cells]
    doors = []
    for number, (col, row) in enumerate(cells[1:], start=1):
        beside = draw(st.booleans()) if col and row else bool(col)
        other = cells.index((col - 1, row) if beside else (col, row - 1))
        ends = [(xs[col], ys[row]), (xs[col], ys[row + 1]) if beside else (xs[col + 1], ys[row])]
        spot = placed(LineString(ends).interpolate(draw(st.floats(0.0, 1.0)), normalized=True))
        doors.append((spot, (other, number)))
    return outlines, doors


@settings(max_examples=40, deadline=None)
@given(floors(), st.floats(0.02, 0.3), st.booleans())
def test_rooms_joined_along_a_tree_are_one_floor_and_one_door_less_makes_two(floor, wall, told):
    outlines, doors = floor
    passages = [Passage(spot.x, spot.y, pair) for spot, pair in doors]
    joined = join(outlines, passages, wall_m=wall)
    assert joined.free.is_valid
    assert parts(joined) == 1
    assert (len(joined.doors), joined.remarks) == (len(doors), ())
    assert all(0.62 < door.width <= 0.9 for door in joined.doors)
    whole = shapely.union_all(outlines)
    assert joined.free.difference(whole).area < 1e-6  # never outside
    assert all(joined.free.buffer(1e-6).covers(room.buffer(-wall / 2, join_style="mitre")) for room in outlines)
    if passages:
        assert parts(join(outlines, passages[told:][: len(passages) - 1], wall_m=wall)) == 2
    assert parts(join(outlines, wall_m=wall)) == len(outlines)


@settings(max_examples=25, deadline=None)
@given(floors())
def test_a_door_in_the_middle_of_a_wall_needs_no_word_on_its_rooms(floor):
    outlines, doors = floor
    for _, pair in doors[:3]:
        first, second = (outlines[number].buffer(1e-6) for number in pair)
        middle = first.intersection(second).centroid
        told, found = (join(outlines, [Passage(middle.x, middle.y, rooms)]) for rooms in (pair, None))
        assert (len(found.doors), parts(found)) == (1, len(outlines) - 1)
        assert told.free.symmetric_difference(found.free).area < 0.01


@settings(max_examples=30, deadline=None)
@given(
    st.lists(st.lists(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), min_size=3, max_size=8), min_size=1, max_size=5)
)
def test_any_outlines_give_valid_floor_inside_them(rings):
    outlines = [Polygon(ring) for ring in rings]
    spots = [Passage(*ring[0]) for ring in rings] + [
        Passage(*a[1], pair) for pair, (a, _) in zip(pairwise(range(len(rings))), pairwise(rings), strict=True)
    ]
    joined = join(outlines, spots)
    assert joined.free.is_valid
    reach = shapely.union_all([repair_outline(outline)[0] for outline in outlines]).buffer(2.5)
    assert joined.free.is_empty or reach.covers(joined.free)
    assert all(0 < door.width <= 0.9 for door in joined.doors)
