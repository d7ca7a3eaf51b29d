import numpy as np
import pytest
import shapely

from pipeline.floorplans.plan import Door
from pipeline.grids.lost_area import MUCH_LOST, LostArea, lost_area, say_lost
from pipeline.grids.rasterize import rasterize
from tests.floorplans.samples import cells_of, floor_plan, grid_plan

# Rooms of 6 x 4 and 3 x 4 m; the way between them is 0.5 m wide and over no whole cell of 0.3 m.
DOOR = Door(6.05, 1.8, 0.5)
ROOMS = shapely.union_all([shapely.box(0, 0, 6, 4), shapely.box(6.1, 0, 9.1, 4), shapely.box(5.9, 1.55, 6.2, 2.05)])


def test_a_room_behind_a_door_that_closed_is_lost_and_named_by_its_place():
    plan = floor_plan(ROOMS)
    lost = lost_area(plan, rasterize(plan, 0.3), 0.15)
    # The middle of a disc of 0.15 m: 5.7 x 3.7 and 2.7 x 3.7 m, and a strip of 0.2 x 0.4 m through the door.
    assert lost.reachable_m2 == pytest.approx(21.09 + 9.99 + 0.08, rel=0.03)
    assert lost.lost_m2 == pytest.approx(9.99, rel=0.04)
    assert lost.share == pytest.approx(9.99 / 31.16, rel=0.05)
    assert 6.25 < lost.place.x < 8.95
    assert 0.15 < lost.place.y < 3.85
    assert lost.share > MUCH_LOST


def test_nothing_is_lost_where_the_door_is_marked_and_kept_open():
    plan = floor_plan(ROOMS, doors=(DOOR,))
    assert lost_area(plan, rasterize(plan, 0.3), 0.15).lost_m2 > 9
    assert lost_area(plan, rasterize(plan, 0.3, doors_from_m=0.3), 0.15) == LostArea(
        lost_area(plan, rasterize(plan, 0.3), 0.15).reachable_m2, 0.0, None
    )


def test_what_the_robot_cannot_reach_on_the_plan_is_not_lost():
    plan = floor_plan(ROOMS)
    lost = lost_area(plan, rasterize(plan, 0.3), 0.3)
    assert lost.lost_m2 == 0
    assert lost.reachable_m2 == pytest.approx(5.4 * 3.4, rel=0.03)


@pytest.mark.parametrize("angle", [0, 17, 45, 71])
@pytest.mark.parametrize("shift", [0.0, 0.13, 0.29])
def test_the_margin_along_walls_is_no_loss(angle, shift):
    room = shapely.box(0, 0, 11, 7).difference(shapely.box(4, 3, 4.6, 3.5))
    plan = floor_plan(shapely.affinity.translate(shapely.affinity.rotate(room, angle, origin=(0, 0)), shift, -shift))
    assert lost_area(plan, rasterize(plan, 0.3), 0.15).lost_m2 == 0


def test_of_two_flats_the_larger_one_is_looked_for_on_the_grid_although_it_is_the_smaller_one_there():
    flats = shapely.union_all([shapely.box(0, 0, 6, 4), shapely.box(7.05, 0, 13.1, 4)])
    plan = floor_plan(flats)
    lost = lost_area(plan, rasterize(plan, 0.3), 0.15)
    assert lost.reachable_m2 == pytest.approx(5.75 * 3.7, rel=0.03)
    assert lost.lost_m2 == 0


def test_a_dead_end_narrower_than_a_cell_is_lost():
    plan = floor_plan(shapely.union_all([shapely.box(0, 0, 6, 4), shapely.box(5.9, 1.6, 11, 2.05)]))
    lost = lost_area(plan, rasterize(plan, 0.3), 0.15)
    assert lost.lost_m2 == pytest.approx(0.15 * 4.9, rel=0.4)  # the strip for the middle of the robot
    assert lost.place.x > 7


def test_cells_taken_together_lose_what_lies_behind_a_gap_of_one():
    walls, rooms = "#" * 19, "#........#........#"
    lines = (walls, *[rooms] * 4, rooms.replace(".#.", "..."), *[rooms] * 4, walls)
    plan = grid_plan(lines, cells=cells_of(lines), resolution=0.2)
    assert lost_area(plan, rasterize(plan, 0.2), 0.1).lost_m2 == 0
    lost = lost_area(plan, rasterize(plan, 0.4), 0.1)
    assert lost.reachable_m2 == pytest.approx((72 + 1 + 72) * 0.04)
    assert 0.3 * lost.reachable_m2 < lost.lost_m2 < 0.6 * lost.reachable_m2


def test_the_warning_names_the_plan_the_area_and_the_place():
    plan = floor_plan(ROOMS)
    lost = lost_area(plan, rasterize(plan, 0.3), 0.15)
    said = say_lost("hall", 0.3, lost)
    assert said.startswith(
        f"plan hall loses {lost.lost_m2:.1f} m2 ({lost.share:.1%}) of its reachable floor on cells of 0.3 m"
    )
    assert f"around ({lost.place.x:.1f}, {lost.place.y:.1f}) m" in said


def test_a_plan_without_reachable_floor_loses_nothing():
    plan = floor_plan(shapely.box(0, 0, 3, 3))
    assert lost_area(plan, rasterize(plan, 0.3), 2.0) == LostArea(0.0, 0.0, None)
    assert np.isclose(LostArea(0.0, 0.0, None).share, 0.0)
