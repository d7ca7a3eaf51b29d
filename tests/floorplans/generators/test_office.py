import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import ConfigError
from pipeline.floorplans.generators.office import OfficeShape, draw_office
from pipeline.randomness import stream

seeds = st.integers(0, 100_000)
shapes = st.builds(
    OfficeShape,
    hallways=st.sampled_from([1, 2, 3, 5]),
    length_m=st.sampled_from([60.0, 75.0]),
    breadth_m=st.sampled_from([60.0, 70.0]),
    door_m=st.sampled_from([0.9, 1.2]),
    min_distance_m=st.just(15.0),
)


def draw(seed=0, **changes):
    return draw_office(OfficeShape(**changes), np.random.default_rng(seed), plan_id="o")


def offices_of(plan):
    return [room.outline for room in plan.rooms if room.label == "office"]


@settings(max_examples=8, deadline=None)
@given(shapes, seeds)
def test_a_robot_narrower_than_door_and_aisle_reaches_everything(shape, seed):
    plan = draw_office(shape, np.random.default_rng(seed), plan_id="o")
    for width in (0.2, 0.6, 0.99 * shape.door_m):
        core = plan.free.buffer(-width / 2)
        assert shapely.get_num_geometries(core) == 1
    assert all(core.intersection(office).area > 0 for office in offices_of(plan))
    assert all(core.contains(shapely.Point(end)) for end in plan.endpoints)


@settings(max_examples=8, deadline=None)
@given(shapes, seeds)
def test_rooms_do_not_overlap_and_each_office_has_one_door(shape, seed):
    plan = draw_office(shape, np.random.default_rng(seed), plan_id="o")
    offices = offices_of(plan)
    hallways = shapely.union_all([room.outline for room in plan.rooms if room.label == "hallway"])
    assert shapely.union_all(offices).area == pytest.approx(sum(office.area for office in offices))
    assert hallways.intersection(shapely.union_all(offices)).area < 1e-9
    doors = shapely.points([(door.x, door.y) for door in plan.doors])
    assert len(doors) == len(offices)
    near = shapely.STRtree(offices).query(doors, predicate="dwithin", distance=shape.wall_m / 2 + 1e-6)
    assert sorted(near[1].tolist()) == list(range(len(offices)))
    assert {door.width for door in plan.doors} == {shape.door_m}


@settings(max_examples=4, deadline=None)
@given(seeds, st.sampled_from([1, 3]))
def test_a_desk_hides_part_of_each_office_from_its_door(seed, hallways):
    plan = draw(seed, hallways=hallways)
    seen_through = plan.free.buffer(1e-6)
    shapely.prepare(seen_through)
    for office, door in zip(offices_of(plan), plan.doors, strict=True):
        floor = plan.free.intersection(office)
        assert office.area - floor.area >= 0.99 * 1.5 * 0.9  # the desk
        rng = np.random.default_rng(0)
        low_x, low_y, high_x, high_y = office.bounds
        spots = rng.uniform((low_x, low_y), (high_x, high_y), size=(100, 2))
        spots = spots[shapely.contains_xy(floor, *spots.T)]
        rays = shapely.linestrings([[(door.x, door.y), spot] for spot in spots.tolist()])
        hidden = ~shapely.covers(seen_through, rays)
        assert 0 < hidden.mean() < 0.9


@settings(max_examples=10, deadline=None)
@given(seeds)
def test_the_goal_lies_in_an_office_far_from_the_start(seed):
    plan = draw(seed)
    start, goal = (shapely.Point(end) for end in plan.endpoints)
    assert start.distance(goal) >= 35.0
    assert any(office.contains(goal) for office in offices_of(plan))
    assert plan.free.boundary.distance(start) >= 0.74
    assert plan.free.boundary.distance(goal) >= 0.74


def test_crossing_hallways_close_loops_and_a_long_one_does_not():
    one, five = (
        shapely.union_all([room.outline for room in draw(hallways=count).rooms if room.label == "hallway"])
        for count in (1, 5)
    )
    assert len(one.interiors) == 0
    assert len(five.interiors) == 2  # 3 along x, 2 along y


def test_the_same_stream_draws_the_same_floor_and_names_draw_others():
    first, again = (draw_office(OfficeShape(), stream(0, "plans", "a"), plan_id="a") for _ in range(2))
    other = draw_office(OfficeShape(), stream(0, "plans", "b"), plan_id="b")
    assert first == again
    assert not first.free.equals(other.free)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"hallways": 0}, "plans.office.hallways = 0: expected from 1 to 20"),
        ({"aisle_m": 1.0}, "plans.office.aisle_m = 1.0: expected at least 1.5 m"),
        ({"min_room_m": 3.0}, "plans.office.min_room_m = 3.0: expected at least 3.9 m, or a desk blocks it"),
        ({"min_depth_m": 3.0}, "plans.office.min_depth_m = 3.0"),
        ({"max_desk_m": 1.0}, "plans.office.max_desk_m = 1.0: expected at least min_desk_m = 1.5 m"),
        ({"hallways": 6, "breadth_m": 20.0}, "plans.office.breadth_m = 20.0"),
        ({"min_distance_m": 59.0}, "plans.office.min_distance_m = 59.0"),
        ({"wall_m": float("nan")}, "plans.office.wall_m = nan"),
    ],
)
def test_impossible_floors_are_refused_by_key(changes, message):
    with pytest.raises(ConfigError) as refusal:
        OfficeShape(**changes)
    assert message in str(refusal.value)
