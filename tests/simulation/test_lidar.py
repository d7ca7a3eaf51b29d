"""What a lidar observes, by hand: all around or within a field of view, and the layers its beams pass."""

import numpy as np
import pytest

from pipeline.errors import ConfigError, TrialError
from pipeline.grids.beams import beam_directions, plant_beams
from pipeline.grids.occupancy import FREE
from pipeline.grids.raycast import scan
from pipeline.planning.seen import CELLS, OCCUPANCY, RANGES, Labelled, Observation, Pose
from pipeline.settings import SensorConfig
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.mapper import NOT_SEEN, PartialMapper
from pipeline.simulation.world import World, make_world
from tests.worlds import draw, scattered

HALL = (
    "###########",
    "#.........#",
    "#....#....#",
    "#..S......#",
    "#.........#",
    "###########",
)


def world_of(*lines: str, **layers: np.ndarray) -> World:
    return make_world("hall", draw(*lines).grid, 0.0, layers)


def observe(world: World, pose: Pose, **lidar: object) -> Observation:
    given = {"beams": 64, "input_beams": 8, "max_range_m": 20.0} | lidar
    return make_lidar(**given).observe(world, pose, np.random.default_rng(0))  # type: ignore[arg-type]


def seen_in(observation: Observation, cols: int, value: int) -> set[tuple[int, int]]:
    cells, occupancy = observation.channels[CELLS], observation.channels[OCCUPANCY]
    return {divmod(int(cell), cols) for cell in cells[occupancy == value]}


def test_a_fan_of_eighty_degrees_sees_ahead_and_nothing_beside_or_behind() -> None:
    # Facing east from row 2, column 3: nothing may be seen outside the lines at 45 degrees, cell by cell.
    found = observe(world_of(*HALL), Pose(2, 3, 0.0), field_of_view_deg=80.0)
    every = seen_in(found, 11, 0) | seen_in(found, 11, 1)
    assert all(abs(row - 2) <= col - 3 for row, col in every)
    assert {(2, col) for col in range(3, 10)} <= seen_in(found, 11, 0) and (2, 10) in seen_in(found, 11, 1)
    assert (3, 5) in seen_in(found, 11, 1), "the pillar ahead to the left"
    assert (4, 9) not in every, "behind the pillar"


def test_a_fan_turns_with_the_heading() -> None:
    world = world_of(*HALL)
    west = observe(world, Pose(2, 3, np.pi), field_of_view_deg=80.0)
    every = seen_in(west, 11, 0) | seen_in(west, 11, 1)
    assert (2, 0) in every and all(abs(row - 2) <= 3 - col for row, col in every)
    across = observe(world, Pose(2, 3, np.radians(350.0)), field_of_view_deg=40.0)  # from 330 to 370 degrees
    assert {(2, 5), (1, 5)} <= seen_in(across, 11, 0)
    assert all(col >= 3 and row <= 2 + 1 for row, col in seen_in(across, 11, 0) | seen_in(across, 11, 1))


def test_ranges_out_of_view_are_zero_and_ahead_comes_first() -> None:
    # At 45 degrees each: ahead the east wall, to the right the wall below, to the left the corner of the pillar.
    found = observe(world_of(*HALL), Pose(2, 3, 0.0), field_of_view_deg=90.0).channels[RANGES]
    assert found.dtype == np.float32
    assert found[0] == pytest.approx(6.5) and found[7] == pytest.approx(1.5 * np.sqrt(2.0))
    assert found[1] == pytest.approx(1.5 * np.sqrt(2.0))
    assert found[2:7].tolist() == [0.0] * 5
    north = observe(world_of(*HALL), Pose(2, 3, np.pi / 2), field_of_view_deg=90.0).channels[RANGES]
    assert north[0] == pytest.approx(2.5)


@pytest.mark.parametrize("seed", range(20))
def test_a_fan_is_the_rays_inside_it_one_by_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = scattered(rng, 24, 31, share=0.12)
    row, col = int(rng.integers(1, 23)), int(rng.integers(1, 30))
    cells[row, col] = FREE
    heading, view = float(rng.uniform(0, 2 * np.pi)), float(rng.choice([20.0, 90.0, 200.0, 300.0]))
    world = make_world("scattered", draw("###", "#.#", "###").grid._replace(cells=cells), 0.0)
    found = observe(world, Pose(row, col, heading), beams=128, max_range_m=9.0, field_of_view_deg=view)
    alone = {row * 31 + col}
    for direction in beam_directions(128):
        off = abs((np.arctan2(direction[1], direction[0]) - heading + np.pi) % (2 * np.pi) - np.pi)
        if off <= np.radians(view) / 2.0 + 1e-9:
            _, seen, _ = scan(cells, row, col, plant_beams(direction[None], 9.0, 31), 0, 1)
            alone |= set(seen.tolist())
    assert set(found.channels[CELLS].tolist()) == alone
    assert np.array_equal(found.channels[OCCUPANCY] == FREE, cells.ravel()[found.channels[CELLS]] == FREE)


def test_layers_are_read_along_free_rays_and_the_map_keeps_them() -> None:
    rooms = np.arange(6 * 11, dtype=np.int32).reshape(6, 11) % 5
    world = world_of(*HALL, rooms=rooms)
    found = observe(world, Pose(2, 3, 0.0), field_of_view_deg=90.0, layers=["rooms"])
    channel = found.channels["rooms"]
    assert isinstance(channel, Labelled) and np.array_equal(channel.values, rooms.ravel()[channel.cells])
    belief = PartialMapper(6, 11, world.disk).update(found)
    assert belief.layers["rooms"][2, 9] == rooms[2, 9]
    assert belief.layers["rooms"][4, 9] == NOT_SEEN, "hidden by the pillar"
    assert belief.layers["rooms"][2, 1] == NOT_SEEN, "behind the robot"
    assert belief.fresh == len(set(found.channels[CELLS].tolist()))


def test_a_layer_that_the_world_lacks_is_named() -> None:
    with pytest.raises(TrialError, match=r"hall: no layer 'terrain'; it has rooms\."):
        observe(world_of(*HALL, rooms=np.zeros((6, 11), np.int32)), Pose(2, 3, 0.0), layers=["terrain"])


@pytest.mark.parametrize("view", [5.0, 361.0])
def test_an_impossible_field_of_view_is_refused(view: float) -> None:
    with pytest.raises(ConfigError, match=r"sensor\.field_of_view_deg"):
        SensorConfig(max_range_m=5.0, field_of_view_deg=view)
