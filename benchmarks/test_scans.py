"""Scans, and their way into the map: from all places of a drive, one after the other."""

from collections.abc import Callable

import numpy as np
import pytest

from benchmarks.worlds import Trial, World, across, draw_maze, hall, rooms
from pipeline.grids.beams import beam_tree
from pipeline.grids.partial_map import enter, unseen_map
from pipeline.grids.raycast import scan
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import Robot, run_trial

TRIALS: dict[str, Callable[[], Trial]] = {
    "maze 188 x 144": lambda: draw_maze(0),
    "rooms 300 x 500": lambda: across(rooms(300, 500)),
    "hall 300 x 500": lambda: across(hall(300, 500)),
}
RANGE = 60.0  # cells


def places(trial: Trial) -> list[tuple[int, int]]:
    """Return where a robot scans on the optimistic way through the world."""
    lidar = make_lidar(beams=256, input_beams=256, max_range_m=18.0)
    episode = run_trial(*trial, OptimisticPlanner(), robot=Robot(lidar, step_m=0.54), rng=np.random.default_rng(0))
    return [divmod(int(cell), trial.world.blocked.shape[1]) for cell in episode.path[::2]]


def scan_all(world: World, stands: list[tuple[int, int]], beams: int) -> int:
    map_, tree = unseen_map(*world.blocked.shape), beam_tree(beams, RANGE, world.blocked.shape[1])
    fresh = 0
    for row, col in stands:
        _, seen, occupancy = scan(world.grid.cells, row, col, tree, 0, beams)
        fresh += enter(map_, seen, occupancy, world.disk)
    return fresh


@pytest.mark.parametrize("beams", [256, 1024])
@pytest.mark.parametrize("name", TRIALS)
def test_scan_and_insert(benchmark, name: str, beams: int) -> None:
    benchmark.group = f"scan and insert: {name}"
    trial = TRIALS[name]()
    stands = places(trial)
    fresh = benchmark(scan_all, trial.world, stands, beams)
    assert fresh > 0
    benchmark.extra_info |= {
        "scans": len(stands),
        "us_per_scan": 1e6 * benchmark.stats.stats.median / len(stands),
        "cells_seen_per_scan": fresh / len(stands),
    }
