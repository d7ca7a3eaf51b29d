"""Looking and entering in one go equals a sensor that looks and a mapper that enters, look by look."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.grids.inflate import disk_offsets
from pipeline.grids.partial_map import CHANGES, OBSTACLES
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.seen import CELLS, OCCUPANCY, RANGES, Pose, Seen
from pipeline.simulation.lidar import Lidar, make_lidar
from pipeline.simulation.mapper import PartialMapper
from pipeline.simulation.sweep import sweep_with
from pipeline.simulation.trial import Episode, Robot, run_trial
from pipeline.simulation.world import make_world
from tests.worlds import DEAD_END, Drawing, cluttered_worlds, draw, small_lidar


class Apart(Lidar):
    """A lidar that is not known to be ours, so that what it sees is entered by the mapper."""


class Noting(OptimisticPlanner):
    """Keeps what it was told of every look."""

    def __init__(self) -> None:
        super().__init__()
        self.told: list[dict[str, Any]] = []

    def notice(self, seen: Seen) -> None:
        assert seen.observation is not None and seen.belief is not None
        self.told.append(
            {name: np.array(channel) for name, channel in seen.observation.channels.items()}
            | {"pose": seen.observation.pose, "fresh": seen.belief.fresh, "handed": seen.ranges.copy()}
        )


def driven(drawn: Drawing, radius: float, lidar: Lidar) -> tuple[Episode, list[dict[str, Any]]]:
    planner = Noting()
    world = make_world("drawn", drawn.grid, radius)
    robot = Robot(lidar, step_m=1.0)
    return run_trial(world, drawn.start, drawn.goal, planner, robot=robot, rng=np.random.default_rng(0)), planner.told


@settings(max_examples=60, deadline=None)
@given(drawn=cluttered_worlds(), reach=st.sampled_from([1.5, 4.0, 30.0]))
def test_a_drive_is_the_same_either_way(drawn: Drawing, reach: float) -> None:
    lidar = small_lidar(reach)
    (one, told), (apart, told_apart) = (driven(drawn, 0.0, made) for made in (lidar, Apart(*lidar)))
    assert one._replace(seconds=0.0, path=0, known=0) == apart._replace(seconds=0.0, path=0, known=0)
    assert np.array_equal(one.path, apart.path) and np.array_equal(one.known, apart.known)
    assert len(told) == len(told_apart) == one.steps
    for ours, theirs in zip(told, told_apart, strict=True):
        assert ours.keys() == theirs.keys() >= {CELLS, OCCUPANCY, RANGES}
        for name, channel in ours.items():
            assert np.array_equal(channel, theirs[name]), name


@pytest.mark.parametrize("radius", [0.0, 1.3])
def test_one_map_entered_both_ways(radius: float) -> None:
    """From poses all over a drawn world, in an order of its own, the maps stay alike to the last entry."""
    drawn = draw(*DEAD_END)
    world = make_world("drawn", drawn.grid, radius)
    lidar = make_lidar(beams=256, input_beams=64, max_range_m=4.0)
    fast, slow = (PartialMapper(*drawn.grid.cells.shape, disk_offsets(radius)) for _ in range(2))
    sweep = sweep_with(lidar, fast, world)
    assert sweep is not None
    rng = np.random.default_rng(5)
    for row, col in rng.permutation(np.argwhere(world.blocked == 0))[:40]:
        pose = Pose(int(row), int(col), float(rng.integers(8) * np.pi / 4))
        (observation, belief), apart = sweep(pose), lidar.observe(world, pose, rng)
        assert belief.fresh == slow.update(apart).fresh
        assert len(observation.channels) == len(apart.channels) == 3
        for name, channel in apart.channels.items():
            assert np.array_equal(observation.channels[name], channel)
        written = fast.map.written
        for name in ("known", "status", "written"):
            assert np.array_equal(getattr(fast.map, name), getattr(slow.map, name)), name
        for name, end in (("changes", written[CHANGES]), ("obstacles", written[OBSTACLES])):
            assert np.array_equal(getattr(fast.map, name)[:end], getattr(slow.map, name)[:end]), name


@pytest.mark.parametrize(
    "changed", [{"noise_m": 0.1}, {"field_of_view_deg": 90.0}, {"layers": ("rooms",)}], ids=["noise", "view", "layers"]
)
def test_only_looks_that_are_a_function_of_the_place(changed: dict[str, Any]) -> None:
    drawn = draw(*DEAD_END)
    world, mapper = make_world("drawn", drawn.grid, 0.0), PartialMapper(*drawn.grid.cells.shape, disk_offsets(0.0))
    made = make_lidar(**{"beams": 256, "input_beams": 64, "max_range_m": 4.0} | changed)
    assert sweep_with(made, mapper, world) is None
    assert sweep_with(Apart(*small_lidar()), mapper, world) is None
