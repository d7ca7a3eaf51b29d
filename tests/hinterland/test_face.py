"""The library face: light, whole, and equal to what the stages do."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely

import hinterland as hl
from pipeline.evaluation.driving import drive_to_goal, rules_of
from pipeline.grids.occupancy import cell_at
from pipeline.grids.store import GridRecord, Pair
from pipeline.planning.seen import Seen
from pipeline.simulation.ground import Ground
from pipeline.simulation.world import known_map_distance
from pipeline.systems.subgoals.planner import Estimated, SubgoalPlanner
from tests.floorplans.samples import floor_plan
from tests.hinterland.networks import write_network

HEAVY = ("torch", "lightning", "hydra", "mlflow", "matplotlib", "pandas")

# Two rooms of 6 x 6 m beside a hallway of 14 x 2 m, with doors of 1.2 m.
ROOMS = shapely.union_all(
    [
        shapely.box(0, 0, 14, 2),
        shapely.box(0.5, 2.4, 6.5, 8.4),
        shapely.box(7.5, 2.4, 13.5, 8.4),
        shapely.box(3, 2, 4.2, 2.4),
        shapely.box(12, 2, 13.2, 2.4),
    ]
)
ROBOT = hl.RobotConfig(radius_m=0.3, step_m=0.54)


@pytest.fixture(scope="module")
def world() -> hl.World:
    return hl.make_world(floor_plan(ROOMS, plan_id="rooms"), resolution_m=0.3, robot=ROBOT)


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    return write_network(tmp_path / "network.safetensors")


def run_alone(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_the_import_is_light_and_soon_done() -> None:
    code = (
        "import sys, time; began = time.perf_counter(); import hinterland; took = time.perf_counter() - began; "
        f"print(took < 1.0, [name for name in {(*HEAVY, 'numpy', 'numba')} if name in sys.modules])"
    )
    assert run_alone(code) == "True []"


def test_no_name_of_the_face_brings_what_trains_tracks_or_draws() -> None:
    code = (
        "import sys, hinterland; [getattr(hinterland, name) for name in hinterland.__all__]; "
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    assert run_alone(code) == "[]"


def test_every_name_is_there_with_a_docstring() -> None:
    assert sorted(hl.__all__) == dir(hl)
    for name in hl.__all__:
        found = getattr(hl, name)
        if callable(found):
            assert found.__doc__, name
    with pytest.raises(AttributeError, match="has no attribute 'fly'"):
        _ = hl.fly


def test_a_drive_is_the_one_that_the_stages_drive(world: hl.World) -> None:
    start, goal, sensor = (0.9, 1.0), (12.5, 8.0), hl.SensorConfig(max_range_m=5.0)
    drive = hl.drive(world, "optimistic", start=start, goal=goal, robot=ROBOT, sensor=sensor)
    ends = [cell_at(world.grid, hl.Point(*end)) for end in (start, goal)]
    ground = Ground(GridRecord("rooms", "rooms", "rooms", "test", world.grid, 0.3))
    shortest = known_map_distance(world, *ends)
    pair = Pair("rooms/0", "rooms", "rooms", "rooms", "test", *ends, shortest)
    from pipeline.planning.optimistic import OptimisticPlanner

    episode = drive_to_goal(OptimisticPlanner(), ground, pair, rules_of(sensor, ROBOT, None), np.random.default_rng(0))
    assert (drive.travelled_m, drive.steps, drive.decisions) == (episode.travelled, episode.steps, episode.decisions)
    assert drive.reached
    assert drive.known_map_m == shortest
    np.testing.assert_array_equal(drive.map.cells, episode.known)
    lengths = np.linalg.norm(np.diff(drive.path, axis=0), axis=1)
    assert lengths.sum() == pytest.approx(drive.travelled_m)
    np.testing.assert_allclose(drive.path[0], start, atol=0.15)
    np.testing.assert_allclose(drive.path[-1], goal, atol=0.15)


def test_estimates_on_the_robots_own_map_are_those_of_the_drive(world: hl.World, weights: Path) -> None:
    """What the planner was told on its first look, the library says of the map saved then: equal bits."""
    network = hl.load_network(weights)
    told: list[Estimated] = []
    kept: list[tuple[np.ndarray, Seen]] = []

    def note(estimated: Estimated) -> None:
        told.append(estimated)
        kept.append((estimated.seen.map.known.copy(), estimated.seen))

    sensor = hl.SensorConfig(max_range_m=9.0)
    planner = SubgoalPlanner(estimator=network, on_estimate=note)
    hl.drive(world, planner, start=(6.0, 1.0), goal=(12.5, 8.0), robot=ROBOT, sensor=sensor, max_steps=1)
    known, seen = kept[0]
    pose = (world.grid.origin.x + (seen.pose.col + 0.5) * 0.3, world.grid.origin.y + (seen.pose.row + 0.5) * 0.3, 0.0)
    grid = hl.OccupancyGrid(known, 0.3, world.grid.origin)
    found = hl.estimate(network, grid, pose, (12.5, 8.0), robot=ROBOT)
    expected = sorted(tuple(properties) for properties in told[0].properties)
    assert len(expected) >= 2
    assert sorted((each.p_success, each.delta_success_m, each.exploration_m) for each in found.subgoals) == expected
    assert not found.remarks


def test_the_first_of_the_ranked_is_the_one_of_least_expected_cost(world: hl.World, weights: Path) -> None:
    network = hl.load_network(weights)
    cut_off = hl.drive(world, "optimistic", start=(6.0, 1.0), goal=(12.5, 8.0), robot=ROBOT, max_steps=1)
    found = hl.estimate(network, cut_off.map, (6.0, 1.0, 0.0), (12.5, 8.0), robot=ROBOT)
    assert len(found.subgoals) >= 2
    assert found.expected_cost_m > 0
    alone = hl.estimate(network, cut_off.map, (6.0, 1.0, 0.0), (12.5, 8.0), robot=ROBOT, max_subgoals=2)
    assert {each[:2] for each in alone.subgoals} == {each[:2] for each in found.subgoals}
    assert alone.expected_cost_m >= 0


def test_a_goal_outside_of_the_map_is_beyond_its_rim(weights: Path) -> None:
    """A corridor whose map ends in the open: 20 x 5 cells, walls along it, nothing at its right end."""
    cells = np.full((5, 20), hl.FREE, dtype=np.uint8)
    cells[0], cells[-1], cells[:, 0] = hl.OCCUPIED, hl.OCCUPIED, hl.OCCUPIED
    grid = hl.OccupancyGrid(cells, 0.3, hl.Point(10.0, -2.0))
    point = hl.RobotConfig(radius_m=0.2, step_m=0.54)
    found = hl.estimate(hl.load_network(weights), grid, (11.0, -1.3, 0.0), (20.0, -1.3), robot=point)
    (subgoal,) = found.subgoals
    assert subgoal.cells == 3
    assert (subgoal.x, subgoal.y) == pytest.approx((15.85, -1.25))  # the last column, its middle row
    assert subgoal.way_m == pytest.approx(9.0)  # from column 3 to column 33, straight ahead
    assert any("robot.radius_m = 0.3" in remark for remark in found.remarks)
    reached = hl.estimate(hl.load_network(weights), grid, (11.0, -1.3, 0.0), (14.0, -1.3), robot=point)
    assert reached.subgoals == []
    assert reached.expected_cost_m == pytest.approx(3.0)


def test_a_map_survives_its_file_and_is_made_coarser_carefully(tmp_path: Path) -> None:
    cells = np.array([[0, 0, 0, 2], [0, 2, 2, 2], [0, 1, 2, 2], [0, 0, 2, 2]], dtype=np.uint8)
    grid = hl.OccupancyGrid(cells, 0.05, hl.Point(-1.0, 2.0))
    hl.write_map(grid, tmp_path / "map.yaml")
    back = hl.read_map(tmp_path / "map.yaml")
    assert (back.resolution, back.origin) == (0.05, (-1.0, 2.0))
    np.testing.assert_array_equal(back.cells, cells)
    coarse = hl.read_map(tmp_path / "map.yaml", resolution_m=0.1)
    assert coarse.resolution == pytest.approx(0.1)
    np.testing.assert_array_equal(coarse.cells, [[hl.FREE, hl.UNKNOWN], [hl.OCCUPIED, hl.UNKNOWN]])
    with pytest.raises(hl.HinterlandError, match=r"resolution_m = 0\.12: the map has cells of 0\.05 m"):
        hl.read_map(tmp_path / "map.yaml", resolution_m=0.12)


REFUSED = [
    ({"planner": "optimystic"}, "planner = optimystic: no part of that name. Did you mean optimistic?"),
    ({"planner": 3}, "planner = 3: expected an object with a method plan, a network, optimistic"),
    ({"start": (0.1, 1.0)}, "lies in a wall or within the robot's radius"),
    ({"goal": (99.0, 1.0)}, "lies outside of"),
    ({"robot": hl.RobotConfig(radius_m=0.7, step_m=0.5)}, "was made for a robot of another radius"),
]


@pytest.mark.parametrize(("change", "expected"), REFUSED)
def test_a_drive_that_cannot_be_is_one_sentence(world: hl.World, change: dict[str, object], expected: str) -> None:
    asked = {"planner": "optimistic", "start": (0.9, 1.0), "goal": (12.5, 8.0), "robot": ROBOT} | change
    with pytest.raises(hl.HinterlandError) as refusal:
        hl.drive(world, **asked)  # type: ignore[arg-type]
    assert expected in str(refusal.value)


def test_a_planner_that_fails_is_named(world: hl.World) -> None:
    class Lost:
        def plan(self, seen: hl.Seen) -> None:
            raise KeyError("door")

    with pytest.raises(hl.HinterlandError, match=r"^Lost failed: KeyError: 'door' \(test_face\.py, line \d+\)"):
        hl.drive(world, Lost(), start=(0.9, 1.0), goal=(12.5, 8.0), robot=ROBOT)


@pytest.mark.parametrize(
    ("pose", "goal", "expected"),
    [
        ((10.1, -1.3, 0.0), (20.0, -1.3), "stands where its map is an obstacle"),
        ((30.0, -1.3, 0.0), (20.0, -1.3), "stands where its map is not seen"),
        ((11.0, -1.6, 0.0), (20.0, -1.3), "within the robot's radius of an obstacle"),
        ((11.0, -1.3, 0.0), (12.0, -1.9), "the goal at (11.95, -1.85) m lies in an obstacle"),
        ((11.0, -1.3, 0.0), (9e6, -1.3), "expected both in the frame of the map"),
    ],
)
def test_a_pose_that_cannot_be_is_one_sentence(
    pose: tuple[float, float, float], goal: tuple[float, float], expected: str, weights: Path
) -> None:
    cells = np.full((5, 20), hl.FREE, dtype=np.uint8)
    cells[0], cells[-1], cells[:, 0] = hl.OCCUPIED, hl.OCCUPIED, hl.OCCUPIED
    grid = hl.OccupancyGrid(cells, 0.3, hl.Point(10.0, -2.0))
    with pytest.raises(hl.HinterlandError) as refusal:
        hl.estimate(hl.load_network(weights), grid, pose, goal, robot=hl.RobotConfig(radius_m=0.35, step_m=0.5))
    assert expected in str(refusal.value)


def test_one_plan_is_one_plan(tmp_path: Path) -> None:
    plan = floor_plan(ROOMS, plan_id="rooms")
    grid = hl.rasterize(plan, 0.5)
    hl.write_map(grid, tmp_path / "a.yaml")
    found = hl.read_plan(tmp_path / "a.yaml")
    assert hl.read_plan(tmp_path / "a.yaml", plan_id=found.plan_id).plan_id == found.plan_id
    with pytest.raises(hl.HinterlandError, match=r"expected a plan 'b', it holds 1: .*Name one by plan_id"):
        hl.read_plan(tmp_path / "a.yaml", plan_id="b")
    with pytest.raises(hl.HinterlandError, match=r"expected a name that ends in \.yaml"):
        hl.write_map(grid, tmp_path / "a.pgm")
