"""Time per call of each kernel, on guided mazes of 144 x 188 cells. Run by `make bench`."""

import numpy as np
import pytest

from benchmarks.worlds import RESOLUTION, Trial, draw_trial, explored
from pipeline.grids.distances import NO_TARGETS, settle
from pipeline.grids.inflate import disk_offsets
from pipeline.grids.partial_map import UNSEEN
from pipeline.grids.raycast import beam_directions, cast_rays, insert_scan
from pipeline.planning.expected_cost import order_subgoals
from pipeline.planning.seen import Pose, Seen
from pipeline.planning.subgoals import find_subgoals

RANGE_M = 18.0


@pytest.fixture(scope="module")
def trial() -> Trial:
    return draw_trial(0)


@pytest.mark.parametrize("beams", [256, 1024])
def test_cast(benchmark, trial: Trial, beams: int) -> None:
    cells, directions = trial.world.grid.cells, beam_directions(beams)
    benchmark(cast_rays, cells, *trial.start, directions, RANGE_M / RESOLUTION)


@pytest.mark.parametrize("beams", [256, 1024])
def test_insert(benchmark, trial: Trial, beams: int) -> None:
    map_, directions = explored(trial, RANGE_M, scans=0), beam_directions(beams)
    reach = RANGE_M / RESOLUTION
    scan = cast_rays(trial.world.grid.cells, *trial.start, directions, reach)
    disk = disk_offsets(1.0)
    benchmark(insert_scan, map_.known, map_.status, *trial.start, directions, scan, disk)


def test_optimistic_field(benchmark, trial: Trial) -> None:
    map_ = explored(trial, RANGE_M)
    goal = trial.goal.row * map_.status.shape[1] + trial.goal.col
    benchmark(settle, map_.status, UNSEEN, goal, NO_TARGETS)


def test_subgoals(benchmark, trial: Trial) -> None:
    seen = Seen(explored(trial, RANGE_M), Pose(*trial.start, 0.0), trial.goal, np.zeros(256, np.float32), RESOLUTION, 0)
    benchmark(find_subgoals, seen)


@pytest.mark.parametrize("count", [8, 12, 15])
def test_expected_cost(benchmark, count: int) -> None:
    # P in 0.02..0.2 is the worst case of a branch and bound; a subset programme does not mind.
    rng = np.random.default_rng(0)
    points = rng.uniform(0, 50, (count, 2))
    pairs = np.linalg.norm(points[:, None] - points[None], axis=2)
    p, success, exploration = rng.uniform(0.02, 0.2, count), rng.uniform(10, 90, count), rng.uniform(1, 60, count)
    benchmark(order_subgoals, pairs[0] + 1.0, pairs, p, success, exploration)
