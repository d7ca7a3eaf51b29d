import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import ConfigError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.generators.campus import CampusShape, draw_campus
from pipeline.floorplans.generators.campus_layout import LAYOUTS, Box, Hall, Row, find_caps, lay_rows
from pipeline.randomness import stream

RADIUS_M = 0.3

seeds = st.integers(0, 100_000)
layouts = st.sampled_from(LAYOUTS)
odd_shapes = st.builds(
    CampusShape,
    layout=layouts,
    length_low_m=st.sampled_from([31.0, 40.0]),
    length_high_m=st.sampled_from([40.0, 80.0]),
    width_low_m=st.sampled_from([21.0, 30.0]),
    width_high_m=st.sampled_from([30.0, 50.0]),
    corridor_low_m=st.sampled_from([1.2, 2.0]),
    corridor_high_m=st.sampled_from([2.0, 4.5]),
    depth_low_m=st.sampled_from([3.0, 6.0]),
    depth_high_m=st.sampled_from([6.0, 20.0]),
    wall_low_m=st.sampled_from([0.05, 0.3]),
    wall_high_m=st.sampled_from([0.3, 0.6]),
    door_low_m=st.sampled_from([0.7, 0.9]),
    door_high_m=st.sampled_from([0.9, 1.4]),
    link_share=st.sampled_from([0.0, 1.0]),
    back_share=st.sampled_from([0.0, 1.0]),
)


def draw(seed=0, **changes):
    return draw_campus(CampusShape(**changes), np.random.default_rng(seed), plan_id="c")


def check_floor(plan):
    """A robot reaches every room from every other one, and no room lies over another."""
    core = plan.free.buffer(-RADIUS_M)
    assert shapely.get_num_geometries(core) == 1
    outlines = [room.outline for room in plan.rooms]
    assert all(outline.intersection(core).area > 0 for outline in outlines)
    first, second = shapely.STRtree(outlines).query(outlines)
    pairs = first < second
    shared = shapely.intersection(np.array(outlines)[first[pairs]], np.array(outlines)[second[pairs]])
    assert shapely.area(shared).max(initial=0.0) < 1e-9


@settings(max_examples=15, deadline=None)
@given(layouts, seeds)
def test_a_robot_reaches_every_room_and_no_rooms_overlap(layout, seed):
    check_floor(draw(seed, layout=layout))


@settings(max_examples=15, deadline=None)
@given(odd_shapes, seeds)
def test_shapes_far_from_the_defaults_hold_together_too(shape, seed):
    check_floor(draw_campus(shape, np.random.default_rng(seed), plan_id="c"))


@settings(max_examples=6, deadline=None)
@given(seeds)
def test_doors_are_as_wide_as_asked_and_lie_in_walls(seed):
    plan = draw(seed, door_low_m=0.9, door_high_m=1.0, double_low_m=1.5, double_high_m=1.6)
    rooms = shapely.union_all([room.outline for room in plan.rooms]).buffer(1e-6, join_style="mitre")
    for door in plan.doors:
        middle = shapely.Point(door.x, door.y)
        assert plan.free.contains(middle)
        assert not rooms.covers(middle)
        if door.leaf:
            assert 0.9 <= door.width <= 1.0 or 1.5 <= door.width <= 1.6
            # The floor of the opening is what lies beyond the outlines: as wide as the door, one wall deep.
            cut = middle.buffer(door.width, cap_style="square").intersection(plan.free).difference(rooms)
            opening = next(part for part in shapely.get_parts(cut) if part.covers(middle))
            low_x, low_y, high_x, high_y = opening.bounds
            assert max(high_x - low_x, high_y - low_y) == pytest.approx(door.width, abs=1e-4)


def test_the_same_stream_draws_the_same_floor_and_names_draw_others():
    first, again = (draw_campus(CampusShape(), stream(0, "plans", "a"), plan_id="a") for _ in range(2))
    other = draw_campus(CampusShape(), stream(0, "plans", "b"), plan_id="b")
    assert first == again
    assert not first.free.equals(other.free)


def test_a_floor_is_a_building_of_its_own_without_warnings():
    plan = draw_campus(CampusShape(), np.random.default_rng(3), plan_id="c-3", split="train")
    assert (plan.building, plan.floor, plan.split, plan.environment) == ("c-3", "c-3", "train", "campus")
    assert inspect(plan).warnings == ()
    assert shapely.box(*plan.bounds).contains(plan.free)
    assert plan.rooms[0].label == "CORRIDOR"


@pytest.mark.parametrize(("layout", "holes"), [("slab", 0), ("ring", 1)])
def test_corridors_of_a_ring_go_round_and_those_of_a_slab_do_not(layout, holes):
    corridors = [draw(seed, layout=layout).rooms[0].outline for seed in range(10)]
    assert all((len(corridor.interiors) >= 1) == bool(holes) for corridor in corridors)


def test_more_links_make_more_doors_between_rooms():
    few, many = (sum(len(draw(k, link_share=share).doors) for k in range(5)) for share in (0.0, 1.0))
    assert many > 1.2 * few


def test_corridor_widths_lie_in_the_range():
    for seed in range(5):
        corridor = draw(seed, layout="slab", corridor_low_m=2.0, corridor_high_m=2.5).rooms[0].outline
        low_x, low_y, high_x, high_y = corridor.bounds
        assert 2.0 <= high_y - low_y <= 2.5
        assert 36.0 - 0.3 <= high_x - low_x <= 76.0


def test_rows_stop_at_a_crossing_corridor_and_the_dead_end_is_found():
    spine = Hall(0, 0.0, 20.0, 0.0, 2.0, below=5.0, above=5.0, before=3.0, after=0.0)
    wing = Hall(1, 0.0, 12.0, 8.0, 10.0, below=4.0, above=4.0, before=0.0, after=0.0)
    rows = lay_rows([spine, wing], [])
    assert rows[0] == Row(0, 0, -3.0, 20.0, 0.0, 20.0, near=0.0, far=-5.0)
    assert [(row.start, row.stop) for row in rows[1:3]] == [(-3.0, 8.0), (10.0, 20.0)]
    assert [row.box for row in rows[3:]] == [Box(4.0, 7.0, 8.0, 12.0), Box(10.0, 7.0, 14.0, 12.0)]
    assert find_caps([spine, wing]) == [(0, Box(-3.0, 0.0, 0.0, 2.0))]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"layout": "star"}, "plans.campus.layout = star: expected one of slab, ell, u, ring, comb, aitch, any"),
        ({"corridor_low_m": 0.5}, "plans.campus.corridor_low_m = 0.5: expected from 1.2 to 5 m"),
        ({"corridor_high_m": 1.0}, "plans.campus.corridor_high_m = 1.0: expected from corridor_low_m = 2"),
        ({"door_low_m": 0.5}, "plans.campus.door_low_m = 0.5"),
        ({"depth_low_m": float("nan")}, "plans.campus.depth_low_m = nan"),
        ({"width_low_m": 5.0}, "plans.campus.width_low_m = 5.0: expected from 18 to 500 m"),
        ({"length_high_m": 9000.0}, "plans.campus.length_high_m = 9000.0"),
        ({"link_share": 1.5}, "plans.campus.link_share = 1.5: expected a share from 0 to 1"),
    ],
)
def test_impossible_floors_are_refused_by_key(changes, message):
    with pytest.raises(ConfigError) as refusal:
        CampusShape(**changes)
    assert message in str(refusal.value)
