"""Sensors, mappers and motions that lie are refused by the loop, each in a sentence of its own; nothing is recorded."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from pipeline.errors import RobotError
from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN
from pipeline.grids.partial_map import BLOCKED, CLEAR, PartialMap
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.seen import CELLS, OCCUPANCY, Observation, Pose
from pipeline.simulation.car import Car
from pipeline.simulation.mapper import PartialBelief, PartialMapper
from pipeline.simulation.motion import Walk
from pipeline.simulation.protocols import Motion, Move, Sensor
from pipeline.simulation.trial import Ending, Episode, Robot, run_trial
from pipeline.simulation.world import World, make_world
from tests.worlds import draw, small_lidar

# The way from S leads down through the gap in the wall and up again to G; T-shaped, so that no mirror image fits.
WALLED = (
    "################",
    "#......#.......#",
    "#.S....#...G...#",
    "#......#.......#",
    "#......#..###..#",
    "#..............#",
    "#......#.......#",
    "################",
)


def drive(**parts: Any) -> Episode:
    drawn = draw(*WALLED)
    robot = Robot(**({"sensor": small_lidar(5.2), "step_m": 1.0} | parts))
    world = make_world("walled", drawn.grid, 0.0)
    return run_trial(world, drawn.start, drawn.goal, OptimisticPlanner(), robot=robot, rng=np.random.default_rng(0))


class LyingSensor:
    """Looks as a lidar does, then tells something else."""

    field_of_view = 2.0 * np.pi

    def __init__(self, lie: Callable[[Observation], dict[str, Any]], reach_m: float = 5.2) -> None:
        self._lie, self.reach_m = lie, reach_m

    def observe(self, world: World, pose: Pose, rng: np.random.Generator) -> Observation:
        seen = small_lidar(5.2).observe(world, pose, rng)
        return seen._replace(channels=dict(seen.channels) | self._lie(seen))


def _with_cell(cell: int, occupancy: int = OCCUPIED) -> Callable[[Observation], dict[str, Any]]:
    return lambda seen: {
        CELLS: np.append(seen.channels[CELLS], np.int32(cell)),
        OCCUPANCY: np.append(seen.channels[OCCUPANCY], np.uint8(occupancy)),
    }


SENSORS: dict[str, tuple[LyingSensor, str]] = {
    "too far": (
        LyingSensor(_with_cell(5 * 16 + 15)),
        r"it reports row 5, col 15, 13\.0 m from the robot at row 5\.00, col 2\.00, and says that it reaches 5\.2 m",
    ),
    "farther than it says": (LyingSensor(lambda seen: {}, reach_m=2.0), r"and says that it reaches 2 m"),
    "out of the grid": (LyingSensor(_with_cell(16 * 8)), "the flat cell 128, outside the 8 x 16 grid"),
    "before the grid": (LyingSensor(_with_cell(-3)), "the flat cell -3, outside the 8 x 16 grid"),
    "a ghost": (LyingSensor(_with_cell(4 * 16 + 4)), "reports row 4, col 4 as an obstacle, which it is not"),
    "through walls": (LyingSensor(_with_cell(5 * 16 + 7, FREE)), "reports row 5, col 7 as free, which it is not"),
    "no cells": (LyingSensor(lambda seen: {CELLS: None}), "channels cells and occupancy are NoneType and uint8"),
    "other numbers": (
        LyingSensor(lambda seen: {CELLS: seen.channels[CELLS].astype(np.int64)}),
        r"channels cells and occupancy are int64 \(\d+,\) and uint8 \(\d+,\), expected int32 \[k\] and uint8 \[k\]",
    ),
    "too few": (LyingSensor(lambda seen: {OCCUPANCY: seen.channels[OCCUPANCY][1:]}), "expected int32"),
}


@pytest.mark.parametrize("name", SENSORS)
def test_a_sensor_that_lies_is_refused(name: str) -> None:
    sensor, message = SENSORS[name]
    with pytest.raises(RobotError, match=rf"^LyingSensor on walled: .*{message}.*mend the sensor\.$"):
        drive(sensor=sensor)


class LyingMapper:
    """Maps as the loop's own does, then spoils it."""

    def __init__(self, lie: Callable[[PartialMap], PartialMap | None], *shape: Any) -> None:
        self._lie, self._mapper = lie, PartialMapper(*shape)

    def update(self, observation: Observation) -> PartialBelief:
        belief = self._mapper.update(observation)
        return belief._replace(map=self._lie(belief.map) or belief.map)


def _set(name: str, row: int, col: int, value: int) -> Callable[[PartialMap], None]:
    def lie(map_: PartialMap) -> None:
        getattr(map_, name)[row, col] = value

    return lie


MAPPERS: dict[str, tuple[Callable[[PartialMap], PartialMap | None], str]] = {
    "forgets": (_set("known", 5, 3, UNKNOWN), "its map forgot row 5, col 3: it says not seen, observed was free"),
    "walls over free space": (
        _set("known", 5, 3, OCCUPIED),
        "its map changed row 5, col 3: it says an obstacle, observed was free",
    ),
    "invents": (_set("known", 5, 12, FREE), "its map invented row 5, col 12: it says free, observed was not seen"),
    "closes ways": (_set("status", 5, 3, BLOCKED), "its map has status 2 at row 5, col 3, expected 0"),
    "opens walls": (_set("status", 5, 7, CLEAR), "its map has status 0 at row 5, col 7, expected 2"),
    "another size": (
        lambda map_: map_._replace(known=map_.known[1:]),
        r"its map has known uint8 \(7, 16\), expected uint8 \(8, 16\)",
    ),
    "a list": (lambda map_: map_._replace(known=map_.known.tolist()), "its map has known list"),
}


@pytest.mark.parametrize("name", MAPPERS)
def test_a_mapper_that_lies_is_refused(name: str) -> None:
    lie, message = MAPPERS[name]
    with pytest.raises(RobotError, match=rf"^LyingMapper on walled: .*{message}.*mend the mapper\.$"):
        drive(make_mapper=lambda rows, cols, disk: LyingMapper(lie, rows, cols, disk))


class LyingMotion(Walk):
    """Walks, then tells something else."""

    lie: Callable[[Move], Move]

    def follow(self, *given: Any) -> Move:
        return type(self).lie(super().follow(*given))


def _tells(lie: Callable[[Move], Move]) -> Motion:
    kind = type("LyingMotion", (LyingMotion,), {"lie": staticmethod(lie)})
    motion: Motion = kind()
    return motion


def _to(row: int, col: int) -> Callable[[Move], Move]:
    cell = np.array([row * 16 + col], dtype=np.int32)
    return lambda move: move._replace(pose=Pose(row, col, 0.0), cells=cell, rest=cell, length=9.0)


def _through_the_wall(move: Move) -> Move:
    cells = np.arange(5 * 16 + 3, 5 * 16 + 12, dtype=np.int32)
    return move._replace(pose=Pose(5, 11, 0.0), cells=cells, rest=cells[-1:], length=9.0)


MOTIONS: dict[str, tuple[Callable[[Move], Move], str]] = {
    "jumps": (_to(2, 5), r"it jumps 4\.2 cells from row 5\.00, col 2\.00 to row 2\.00, col 5\.00"),
    "through the wall": (_through_the_wall, "it drives through row 5, col 7, where a wall keeps the robot away"),
    "a shorter cost": (
        lambda move: move._replace(length=0.9 * move.length),
        r"it says that a way of 1\.\d+ m cost \d\.\d+ m",
    ),
    "no cost": (lambda move: move._replace(length=float("nan")), "cost nan m"),
    "is elsewhere": (
        lambda move: move._replace(pose=move.pose._replace(row=3)),
        r"its way leads from row 5\.00, col 2\.00 to row \d\.00, col 3\.00, the robot stood at row 5\.00, col 2\.00 "
        r"and is said to be at row 3\.00, col 3\.00 now",
    ),
    "another path": (
        lambda move: move._replace(rest=np.append(np.int32(17), move.rest)),
        "the path it leaves starts at row 1, col 1, the robot is at row",
    ),
    "a shortcut on the way": (
        lambda move: move._replace(way=np.array([[5.0, 2.0], [move.pose.row, move.pose.col]])[[0, 0, 1]] * [1, 1.0001]),
        "its way leads from",
    ),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_a_motion_that_lies_is_refused(name: str) -> None:
    lie, message = MOTIONS[name]
    with pytest.raises(RobotError, match=rf"^LyingMotion on walled: .*{message}.*mend the motion\.$"):
        drive(motion=_tells(lie))


class _HonestSensor:
    """One that the loop does not know."""

    def __init__(self) -> None:
        self._lidar = small_lidar(5.2)
        self.reach_m, self.field_of_view = self._lidar.reach_m, self._lidar.field_of_view

    def observe(self, *given: Any) -> Observation:
        return self._lidar.observe(*given)


class _HonestMapper(PartialMapper):
    pass


class _HonestWalk(Walk):
    pass


class _HonestCar(Car):
    pass


def test_honest_parts_of_others_drive_as_our_own() -> None:
    sensor: Sensor = _HonestSensor()
    assert isinstance(sensor, Sensor)
    ours, theirs = drive(), drive(sensor=sensor, make_mapper=_HonestMapper, motion=_HonestWalk())
    assert np.array_equal(ours.path, theirs.path) and ours.travelled == theirs.travelled
    assert ours.decisions == theirs.decisions and np.array_equal(ours.known, theirs.known)
    car = [drive(motion=motion) for motion in (Car(0.8), _HonestCar(0.8))]
    assert car[0].ending is Ending.REACHED and car[0].travelled == car[1].travelled
