"""The loop: one for every planner, endings as values, and nothing a robot could not know."""

import numpy as np
import pytest

from pipeline.errors import ConfigError, TrialError
from pipeline.grids.occupancy import Cell
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.seen import RANGES, Pose, Seen
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import Ending, Episode, Robot, require_possible, run_trial
from pipeline.simulation.world import known_map_distance, make_world
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner
from tests.worlds import DEAD_END, SEALED_GOAL, TWO_ROOMS, draw, small_lidar


def optimistic(lines: tuple[str, ...], **changes: object) -> Episode:
    drawn = draw(*lines)
    options = {"robot": Robot(small_lidar(), step_m=1.0), "rng": np.random.default_rng(0)} | changes
    return run_trial(make_world("drawn", drawn.grid, 0.0), drawn.start, drawn.goal, OptimisticPlanner(), **options)


def test_the_optimist_walks_into_the_dead_end_and_the_perfect_estimator_does_not() -> None:
    drawn = draw(*DEAD_END)
    world = make_world("dead end", drawn.grid, 0.0)
    common = {"robot": Robot(small_lidar(3.0), step_m=1.0), "rng": np.random.default_rng(0)}
    fooled = run_trial(world, drawn.start, drawn.goal, OptimisticPlanner(), **common)
    knowing = run_trial(world, drawn.start, drawn.goal, SubgoalPlanner(estimator=PerfectEstimator(world)), **common)
    shortest = known_map_distance(world, drawn.start, drawn.goal)
    assert fooled.ending is knowing.ending is Ending.REACHED
    assert shortest <= knowing.travelled < fooled.travelled
    assert knowing.travelled <= 1.15 * shortest
    assert fooled.travelled >= 1.4 * shortest


def test_a_sealed_goal_ends_with_a_sentence() -> None:
    episode = optimistic(SEALED_GOAL)
    assert episode.ending is Ending.UNREACHABLE
    assert str(episode.ending) == "no frontier is left that could lead to the goal: it cannot be reached"


def test_a_step_limit_is_a_lower_bound_and_says_so() -> None:
    episode = optimistic(TWO_ROOMS, max_steps=3)
    assert episode.ending is Ending.CUT_OFF and episode.steps == 3
    assert "lower bound" in episode.ending


def test_starting_at_the_goal_costs_nothing() -> None:
    drawn = draw(*TWO_ROOMS)
    world = make_world("drawn", drawn.grid, 0.0)
    episode = run_trial(world, drawn.goal, drawn.goal, OptimisticPlanner(), robot=Robot(small_lidar(), step_m=1.0),
                        rng=np.random.default_rng(0))  # fmt: skip
    assert episode.ending is Ending.REACHED and episode.travelled == 0.0 and episode.decisions == 0


@pytest.mark.parametrize(
    ("start", "message"),
    [
        (Cell(0, 0), r"house: the start at row 0, col 0 lies in a wall or within the robot's radius of one"),
        (Cell(3, 99), r"house: the start is at row 3, col 99, outside the 7 x 13 grid"),
    ],
)
def test_a_start_where_no_robot_can_stand(start: Cell, message: str) -> None:
    drawn = draw(*TWO_ROOMS)
    with pytest.raises(TrialError, match=message):
        run_trial(make_world("house", drawn.grid, 0.0), start, drawn.goal, OptimisticPlanner(),
                  robot=Robot(small_lidar(), step_m=1.0), rng=np.random.default_rng(0))  # fmt: skip


def test_a_goal_outside_the_grid() -> None:
    drawn = draw(*TWO_ROOMS)
    with pytest.raises(TrialError, match=r"house: the goal is at row 7, col 2, outside the 7 x 13 grid"):
        run_trial(make_world("house", drawn.grid, 0.0), drawn.start, Cell(7, 2), OptimisticPlanner(),
                  robot=Robot(small_lidar(), step_m=1.0), rng=np.random.default_rng(0))  # fmt: skip


def test_no_drive_is_shorter_than_the_shortest_way() -> None:
    episode = optimistic(TWO_ROOMS)
    # Three diagonal moves down to the door, two straight ones through it, whose corners are not cut, three up to G.
    require_possible(episode, 6 * np.sqrt(2.0) + 2.0, "optimistic")
    message = r"optimistic on a/1: reached the goal after .* m, less than the shortest way in the true map, 99.000 m"
    with pytest.raises(TrialError, match=message):
        require_possible(episode, 99.0, "optimistic on a/1")
    require_possible(optimistic(TWO_ROOMS, max_steps=3), 99.0, "what was cut off is a lower bound")


def test_a_world_needs_a_closed_ring() -> None:
    drawn = draw("#####", "#...#", "#.#.#")
    with pytest.raises(TrialError, match="outermost ring must be occupied"):
        make_world("open house", drawn.grid, 0.0)


def test_ranges_turn_with_the_robot() -> None:
    drawn = draw("#########", "#.......#", "#.......#", "#S......#", "#########")
    world, lidar = make_world("hall", drawn.grid, 0.0), small_lidar()
    for heading, ahead, left in ((0.0, 5.5, 2.5), (np.pi / 2, 2.5, 1.5)):
        pose = Pose(1, 2, heading)
        ranges = lidar.observe(world, pose, np.random.default_rng(0)).channels[RANGES]
        assert ranges.dtype == np.float32 and ranges.size == 256
        assert ranges[0] == pytest.approx(ahead)
        assert ranges[64] == pytest.approx(left)


def test_noise_is_seeded_and_stays_within_range() -> None:
    drawn = draw(*TWO_ROOMS)
    world, lidar = make_world("drawn", drawn.grid, 0.0), small_lidar(5.0, noise_m=0.3)
    pose = Pose(drawn.start.row, drawn.start.col, 0.0)
    exact = small_lidar(5.0).observe(world, pose, np.random.default_rng(7)).channels[RANGES]
    one, two = (lidar.observe(world, pose, np.random.default_rng(7)).channels[RANGES] for _ in range(2))
    assert np.array_equal(one, two) and not np.allclose(one, exact)
    assert one.min() >= 0.0 and one.max() <= 5.0


def test_beams_that_do_not_divide_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"sensor.beams = 1000, sensor.input_beams = 256"):
        make_lidar(beams=1000, input_beams=256, max_range_m=5.0)


def test_a_planner_receives_no_floor_plan() -> None:
    assert Seen._fields == (
        "map", "pose", "goal", "ranges", "resolution", "step", "widen", "travelled", "observation", "belief",
    )  # fmt: skip
