from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import ConfigError, PlanError
from pipeline.floorplans.generators.campus import CampusShape, draw_campus
from pipeline.floorplans.generators.clutter import (
    ClutterShape,
    add_clutter,
    draw_furniture,
    draw_rectangles,
    free_of,
)
from pipeline.floorplans.generators.office import OfficeShape, draw_office
from pipeline.floorplans.plan import CLUTTER, FREE, OCCUPIED, UNKNOWN, Bounds, Door, FloorPlan, GridPlan, Location

SMALL = CampusShape(length_low_m=28.0, length_high_m=30.0, width_low_m=18.0, width_high_m=20.0)
HAIR_M = 1e-6  # see `pipeline.floorplans.generators.clutter`

seeds = st.integers(0, 100_000)
shapes = st.builds(
    ClutterShape,
    per_m2=st.sampled_from([0.05, 0.3]),
    max_length_m=st.sampled_from([0.8, 3.0]),
    turned_share=st.sampled_from([0.0, 0.5, 1.0]),
    gap_m=st.sampled_from([0.6, 0.8, 1.2]),
)


def hall(width=12.0, height=8.0, **changes):
    free = shapely.box(0.0, 0.0, width, height)
    given = {"plan_id": "h", "building": "h", "floor": "h", "environment": "test", "source": "hand"}
    return FloorPlan(**given | changes, free=free, bounds=Bounds(*free.bounds))


def grid(cells, **changes):
    given = {"plan_id": "g", "building": "g", "floor": "g", "environment": "test", "source": "hand"}
    return GridPlan(**given | changes, cells=cells, resolution=0.1, origin=Location(-3.0, 7.0))


def two_rooms(door_cells=10):
    """Two rooms of 5 x 6 m with a door between them, on cells of 0.1 m."""
    cells = np.full((62, 103), OCCUPIED, dtype=np.uint8)
    cells[1:61, 1:51] = FREE
    cells[1:61, 52:102] = FREE
    cells[30 : 30 + door_cells, 51] = FREE
    return grid(cells, doors=(Door(-3.0 + 5.15, 7.0 + 3.0 + door_cells * 0.05, door_cells * 0.1),))


def count_parts(free, gap):
    parts = shapely.get_parts(free.buffer(-gap / 2 + HAIR_M, quad_segs=16))
    return int((shapely.area(parts) > 1e-9).sum())


@settings(max_examples=10, deadline=None)
@given(shapes, seeds)
def test_a_robot_that_got_everywhere_still_gets_everywhere_it_is_left(shape, seed):
    plan = draw_campus(SMALL, np.random.default_rng(seed), plan_id="c")
    cluttered = add_clutter(plan, shape, np.random.default_rng(seed))
    assert count_parts(cluttered.free, shape.gap_m) == count_parts(plan.free, shape.gap_m)
    assert plan.free.buffer(1e-9).contains(cluttered.free)


@settings(max_examples=15, deadline=None)
@given(shapes, seeds, st.integers(7, 14))
def test_the_same_holds_on_cells_where_passages_are_as_wide_as_the_robot(shape, seed, door_cells):
    plan = two_rooms(door_cells)
    cluttered = add_clutter(plan, shape, np.random.default_rng(seed))
    assert count_parts(free_of(cluttered), shape.gap_m) == count_parts(free_of(plan), shape.gap_m)
    changed = plan.cells != cluttered.cells
    assert (plan.cells[changed] == FREE).all()
    assert (cluttered.cells[changed] == CLUTTER).all()


@settings(max_examples=5, deadline=None)
@given(seeds)
def test_doors_and_ends_stay_clear(seed):
    plan = draw_office(OfficeShape(length_m=30.0, min_distance_m=10.0), np.random.default_rng(seed), plan_id="o")
    shape = ClutterShape(per_m2=0.3)
    pieces = draw_furniture(plan, shape, np.random.default_rng(seed))
    taken = shapely.union_all([piece.outline for piece in pieces])
    assert pieces
    for door in plan.doors:
        assert taken.distance(shapely.Point(door.x, door.y)) >= door.width / 2 + 0.99 * shape.door_clear_m
    for end in plan.endpoints:
        assert taken.distance(shapely.Point(end)) >= shape.gap_m / 2


def test_pieces_have_the_asked_number_sizes_and_angles():
    shape = ClutterShape(per_m2=0.1, min_length_m=1.0, max_length_m=1.5, min_width_m=0.5, max_width_m=0.6)
    plan = hall(40.0, 30.0)
    pieces = draw_furniture(plan, shape, np.random.default_rng(0))
    assert len(pieces) == 120
    assert plan.free.area - add_clutter(plan, shape, np.random.default_rng(0)).free.area == pytest.approx(
        sum(piece.outline.area for piece in pieces)
    )
    corners = np.array([shapely.get_coordinates(piece.outline)[:3] for piece in pieces])
    sides = np.hypot(*np.moveaxis(np.diff(corners, axis=1), 2, 0))
    assert ((sides[:, 0] >= 1.0) & (sides[:, 0] <= 1.5)).all()
    assert ((sides[:, 1] >= 0.5) & (sides[:, 1] <= 0.6)).all()
    along = np.abs(corners[:, 1] - corners[:, 0])
    turned = (along.min(axis=1) > 1e-6).mean()
    assert 0.15 < turned < 0.45
    assert 0.2 < (along[:, 0] < 1e-6).mean() < 0.5  # of those parallel to an axis, half stand along y


def test_no_piece_stands_over_another():
    pieces = draw_furniture(hall(), ClutterShape(per_m2=1.0), np.random.default_rng(1))
    outlines = [piece.outline for piece in pieces]
    assert shapely.union_all(outlines).area == pytest.approx(sum(outline.area for outline in outlines))


def test_a_narrow_corridor_stays_open():
    rooms = [shapely.box(0.0, 0.0, 6.0, 6.0), shapely.box(16.0, 0.0, 22.0, 6.0)]
    corridor = shapely.box(6.0, 2.0, 16.0, 3.6)
    plan = replace(hall(), free=shapely.union_all([*rooms, corridor]))
    shape = ClutterShape(per_m2=1.0, gap_m=0.8, min_width_m=0.9, max_width_m=1.2, max_length_m=1.2, min_length_m=0.9)
    taken = shapely.union_all([piece.outline for piece in draw_furniture(plan, shape, np.random.default_rng(0))])
    assert all(taken.intersects(room) for room in rooms)
    assert taken.intersection(shapely.box(7.5, 2.0, 14.5, 3.6)).is_empty


def test_the_seed_of_the_furniture_is_its_own():
    plan = draw_campus(SMALL, np.random.default_rng(0), plan_id="c")
    first, again, other = (add_clutter(plan, ClutterShape(), np.random.default_rng(k)) for k in (1, 1, 2))
    assert first == again
    assert not first.free.equals(other.free)
    assert (first.floor, first.rooms, first.doors) == (plan.floor, plan.rooms, plan.doors)


def test_a_grid_keeps_its_other_cells_and_its_plan():
    cells = two_rooms().cells.copy()
    cells[5:10, 5:10], cells[40:45, 80:90] = UNKNOWN, CLUTTER
    plan = replace(two_rooms(), cells=cells)
    cluttered = add_clutter(plan, ClutterShape(per_m2=0.3), np.random.default_rng(0))
    kept = cells != FREE
    assert (cluttered.cells[kept] == cells[kept]).all()
    assert (cluttered.cells == CLUTTER).sum() > (cells == CLUTTER).sum() + 50
    assert plan.cells is cells
    assert replace(cluttered, cells=cells) == plan


def test_free_cells_become_the_same_floor():
    free = free_of(grid(np.array([[FREE, FREE, OCCUPIED], [OCCUPIED, FREE, UNKNOWN]], dtype=np.uint8)))
    assert free.equals(shapely.union_all([shapely.box(-3.0, 7.0, -2.8, 7.1), shapely.box(-2.9, 7.1, -2.8, 7.2)]))
    assert free_of(grid(np.full((3, 3), OCCUPIED, dtype=np.uint8))).is_empty


def test_nothing_is_put_on_a_plan_without_floor_or_with_a_density_of_zero():
    closed = grid(np.full((30, 30), OCCUPIED, dtype=np.uint8))
    assert (add_clutter(closed, ClutterShape(), np.random.default_rng(0)).cells == OCCUPIED).all()
    assert add_clutter(hall(), ClutterShape(per_m2=0.0), np.random.default_rng(0)).free.equals(hall().free)


def test_rectangles_lie_anywhere_within_the_bounds():
    drawn = draw_rectangles((0.0, 10.0, 100.0, 30.0), ClutterShape(), 2000, np.random.default_rng(0))
    middles = shapely.get_coordinates(shapely.centroid(drawn))
    assert middles.mean(axis=0) == pytest.approx([50.0, 20.0], abs=2.0)
    assert (middles >= (0.0, 10.0)).all() and (middles <= (100.0, 30.0)).all()


def test_a_floor_for_too_many_pieces_is_refused():
    with pytest.raises(PlanError, match=r"plan h: 80,000 pieces of furniture for 1,000,000 m2.*plans.clutter.per_m2"):
        add_clutter(hall(1000.0, 1000.0), ClutterShape(), np.random.default_rng(0))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"per_m2": -0.1}, "plans.clutter.per_m2 = -0.1: expected from 0 to 2"),
        ({"gap_m": 0.0}, "plans.clutter.gap_m = 0.0: expected from 0.05 to 5 m"),
        ({"max_length_m": 0.5}, "plans.clutter.max_length_m = 0.5: expected from min_length_m = 0.6 to 20 m"),
        ({"min_width_m": 0.0}, "plans.clutter.min_width_m = 0.0"),
        ({"turned_share": 2.0}, "plans.clutter.turned_share = 2.0"),
        ({"door_clear_m": float("inf")}, "plans.clutter.door_clear_m = inf"),
    ],
)
def test_impossible_furniture_is_refused_by_key(changes, message):
    with pytest.raises(ConfigError) as refusal:
        ClutterShape(**changes)
    assert message in str(refusal.value)
