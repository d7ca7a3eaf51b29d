import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import TrialError
from pipeline.grids.distances import travel_field
from pipeline.grids.occupancy import FREE, Point, center_of
from pipeline.grids.sampling import ends_between, largest_component, sample_ends, traversable_cells
from tests.worlds import SEALED_GOAL, TWO_ROOMS, cluttered_worlds, draw

GIVEN = {"plan_id": "two rooms", "robot_radius": 0.0}


@settings(max_examples=60, deadline=None)
@given(cluttered_worlds(), st.floats(0.5, 6.0), st.sampled_from([0.0, 0.5, 0.75]), st.integers(0, 99))
def test_sampled_ends_are_connected_and_far_enough(world, distance, radius, seed):
    try:
        ends = sample_ends(world.grid, plan_id="w", count=3, min_distance=distance, robot_radius=radius, seed=seed)
    except TrialError:
        return
    room = traversable_cells(world.grid, radius)
    for start, goal, known_map_m in ends:
        assert room[start]
        assert room[goal]
        assert largest_component(room)[start]
        assert known_map_m >= distance
        assert known_map_m == pytest.approx(travel_field(room, *goal)[start] * world.grid.resolution)


def test_pairs_depend_on_seed_and_plan_alone_and_more_keep_the_first():
    world = draw(*TWO_ROOMS)

    def sample(count, seed=0, plan_id="a"):
        return sample_ends(world.grid, plan_id=plan_id, count=count, min_distance=4.0, robot_radius=0.0, seed=seed)

    assert sample(3) == sample(8)[:3]
    assert sample(8) != sample(8, seed=1)
    assert sample(8) != sample(8, plan_id="b")
    assert sample(0) == []


def test_the_largest_room_is_taken():
    world = draw(*SEALED_GOAL)
    for start, goal, _ in sample_ends(world.grid, plan_id="a", count=20, min_distance=2.0, robot_radius=0.0, seed=0):
        assert start.col < 6
        assert goal.col < 6


def test_cells_that_only_touch_at_a_corner_are_not_connected():
    world = draw("######", "#..###", "###..#", "######")
    assert largest_component(world.grid.cells == FREE).sum() == 2


def test_given_ends_become_cells():
    world = draw(*TWO_ROOMS, resolution=0.5)
    ends = ends_between(world.grid, center_of(world.grid, world.start), center_of(world.grid, world.goal), **GIVEN)
    assert (ends.start, ends.goal) == (world.start, world.goal)
    assert ends.known_map_m == pytest.approx(0.5 * (2 + 6 * np.sqrt(2)))


@pytest.mark.parametrize(
    ("lines", "start", "radius", "message"),
    [
        (TWO_ROOMS, Point(0.5, 0.5), 0.0, "plan two rooms: the start in cell (row 0, col 0) is in a wall"),
        (TWO_ROOMS, Point(1.5, 1.5), 1.0, "the start in cell (row 1, col 1) is closer to a wall than the robot's 1 m"),
        (TWO_ROOMS, Point(99, 1), 0.0, "the start in cell (row 1, col 99) is outside the map of 7 x 13 cells"),
        (SEALED_GOAL, Point(2.5, 2.5), 0.0, "cannot be reached from the start in cell (2, 2)"),
    ],
)
def test_a_start_that_cannot_be_used_is_named(lines, start, radius, message):
    world = draw(*lines)
    with pytest.raises(TrialError) as refusal:
        ends_between(world.grid, start, center_of(world.grid, world.goal), plan_id="two rooms", robot_radius=radius)
    assert message in str(refusal.value)


@pytest.mark.parametrize(
    ("distance", "radius", "message"),
    [
        (500.0, 0.0, "no start and goal 500 m apart found in 50 tries, the farthest were"),
        (4.0, 9.0, "a robot of radius 9 m fits nowhere at 1 m per cell"),
    ],
)
def test_a_floor_too_small_for_a_trial_is_named(distance, radius, message):
    with pytest.raises(TrialError) as refusal:
        sample_ends(draw(*TWO_ROOMS).grid, plan_id="a", count=1, min_distance=distance, robot_radius=radius, seed=0)
    assert message in str(refusal.value)
