"""Distance fields: from one source to all cells, beside public packages, and repaired after each scan of a drive."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from benchmarks.worlds import World, across, draw_maze, hall, rooms
from pipeline.grids.distances import DIAGONAL, NOWHERE, SHUT, open_field, settle, workspace_for
from pipeline.grids.fields import LiveField
from pipeline.grids.partial_map import CHANGES, UNSEEN
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.seen import Seen
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import Robot, run_trial

Solver = Callable[[World, int], NDArray[np.float64]]
WORLDS = {
    "maze 188 x 144": lambda: draw_maze(0).world,
    "rooms 300 x 500": lambda: rooms(300, 500),
    "hall 300 x 500": lambda: hall(300, 500),
}


def graph_of(blocked: NDArray[np.uint8], *, cut_corners: bool) -> csr_array:
    """Return the graph of the free cells; a diagonal move needs both cells beside it, unless corners may be cut."""
    cols, size = blocked.shape[1], blocked.size
    free = np.pad(blocked == 0, 1).ravel()
    wide = cols + 2
    cells = np.flatnonzero(free)
    edges = []
    for drow, dcol in ((0, 1), (1, 0), (1, 1), (1, -1)):
        there = cells + drow * wide + dcol
        ways = free[there]
        if drow and dcol and not cut_corners:
            ways &= free[cells + drow * wide] & free[cells + dcol]
        edges.append((cells[ways], there[ways], np.full(ways.sum(), DIAGONAL if drow and dcol else 1.0)))
    tails, heads, lengths = (np.concatenate(part) for part in zip(*edges, strict=True))
    places = (np.stack([tails, heads]) // wide - 1) * cols + np.stack([tails, heads]) % wide - 1
    return csr_array((lengths, (places[0], places[1])), shape=(size, size))


def by_hinterland(world: World, source: int) -> NDArray[np.float64]:
    field = open_field(world.blocked, 0)
    settle(field, world.blocked.shape[1], source, NOWHERE, workspace_for(field.size))
    return field


def by_scipy(world: World, source: int) -> NDArray[np.float64]:
    """Dijkstra on the graph above, made beforehand: the time to make it is not counted."""
    found: NDArray[np.float64] = dijkstra(GRAPHS[world.name], directed=False, indices=source)
    return found


def by_scikit_image(world: World, source: int) -> NDArray[np.float64]:
    from skimage.graph import MCP_Geometric

    costs = np.where(world.blocked == 0, 1.0, -1.0)
    found: NDArray[np.float64] = MCP_Geometric(costs).find_costs([divmod(source, costs.shape[1])])[0].ravel()
    return found


def by_dijkstra3d(world: World, source: int) -> NDArray[np.float64]:
    import dijkstra3d

    free = np.asfortranarray((world.blocked == 0).astype(np.uint8)[:, :, None])
    found = dijkstra3d.euclidean_distance_field(free, (*divmod(source, world.blocked.shape[1]), 0))
    return np.asarray(found[:, :, 0], dtype=np.float64).ravel()


def by_scikit_fmm(world: World, source: int) -> NDArray[np.float64]:
    import skfmm

    phi = np.ma.MaskedArray(np.ones(world.blocked.shape), world.blocked != 0)
    phi[divmod(source, world.blocked.shape[1])] = 0.0
    found = skfmm.travel_time(phi, np.ones(world.blocked.shape))
    return np.asarray(np.ma.filled(found, np.inf), dtype=np.float64).ravel()


SOLVERS: dict[str, Solver] = {
    "hinterland": by_hinterland,
    "scipy csgraph": by_scipy,
    "scikit-image MCP": by_scikit_image,
    "dijkstra3d": by_dijkstra3d,
    "scikit-fmm": by_scikit_fmm,
}
PACKAGES = {"scikit-image MCP": "skimage", "dijkstra3d": "dijkstra3d", "scikit-fmm": "skfmm"}
GRAPHS: dict[str, csr_array] = {}


def check(solver: str, world: World, source: int, found: NDArray[np.float64]) -> None:
    """Compare with scipy on the graph of the solver's own rule: ours exactly, others as their numbers allow."""
    free = world.blocked.ravel() == 0
    ours = solver in ("hinterland", "scipy csgraph")
    expected = dijkstra(graph_of(world.blocked, cut_corners=not ours), directed=False, indices=source)
    if ours:
        assert np.array_equal(np.where(found == SHUT, np.inf, found), expected)
    elif solver == "scikit-fmm":  # not the length of grid paths but of the wave front: up to 8 % less
        ratio = found[free & (expected > 20)] / expected[free & (expected > 20)]
        assert 0.9 < np.median(ratio) <= 1.01
    else:
        np.testing.assert_allclose(found[free], expected[free], rtol=1e-3, atol=1e-2)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("name", WORLDS)
def test_full_field(benchmark, name: str, solver: str) -> None:
    if solver in PACKAGES:
        pytest.importorskip(PACKAGES[solver], reason="pip install -e '.[bench]'")
    benchmark.group = f"full field: {name}"
    world = WORLDS[name]()
    GRAPHS.setdefault(world.name, graph_of(world.blocked, cut_corners=False))
    free = np.flatnonzero(world.blocked.ravel() == 0)
    source = int(free[len(free) // 3])
    found = benchmark(SOLVERS[solver], world, source)
    check(solver, world, source, found)


class Recorder(OptimisticPlanner):
    """Drives, and keeps of each scan which cells changed and to what."""

    def __init__(self) -> None:
        super().__init__()
        self.scans: list[tuple[NDArray[np.int32], NDArray[np.uint8]]] = []
        self._seen = 0

    def plan(self, seen: Seen) -> NDArray[np.int32] | None:
        changed = seen.map.changes[self._seen : seen.map.written[CHANGES]].copy()
        self._seen = int(seen.map.written[CHANGES])
        self.scans.append((changed, seen.map.status.ravel()[changed].copy()))
        self.goal = seen.goal.row * seen.map.status.shape[1] + seen.goal.col
        return super().plan(seen)


@pytest.mark.parametrize("how", ["repaired", "computed anew"])
@pytest.mark.parametrize("name", ["maze 188 x 144", "rooms 300 x 500"])
def test_field_after_each_scan(benchmark, name: str, how: str) -> None:
    """Time for one scan: mean over a whole drive, in which a few scans bring much and most bring little."""
    benchmark.group = f"field after a scan: {name}"
    trial = draw_maze(0) if name.startswith("maze") else across(rooms(300, 500))
    recorder = Recorder()
    lidar = make_lidar(beams=256, input_beams=256, max_range_m=18.0)
    run_trial(*trial, recorder, robot=Robot(lidar, step_m=0.54), rng=np.random.default_rng(0))
    shape, work = trial.world.blocked.shape, workspace_for(trial.world.blocked.size)
    fields: list[NDArray[np.float64]] = []

    def replay() -> None:
        status = np.full(shape, UNSEEN, dtype=np.uint8)
        status[0], status[-1], status[:, 0], status[:, -1] = 2, 2, 2, 2
        live = LiveField(status, UNSEEN, recorder.goal, work)
        for changed, values in recorder.scans:
            status.ravel()[changed] = values
            if how == "repaired":
                live.update(changed)
                field = live.values
            else:
                field = open_field(status, UNSEEN)
                settle(field, shape[1], recorder.goal, NOWHERE, work)
        fields.append(field)

    benchmark.pedantic(replay, rounds=5, warmup_rounds=1)
    expected = open_field(np.ascontiguousarray(final_status(shape, recorder)), UNSEEN)
    settle(expected, shape[1], recorder.goal, NOWHERE, work)
    assert np.array_equal(fields[-1], expected)
    benchmark.extra_info |= {
        "scans": len(recorder.scans),
        "ms_per_scan": 1e3 * benchmark.stats.stats.median / len(recorder.scans),
        "cells_changed_per_scan": float(np.mean([changed.size for changed, _ in recorder.scans])),
    }


def final_status(shape: tuple[int, int], recorder: Recorder) -> NDArray[np.uint8]:
    """Return the status at the end of a drive."""
    status = np.full(shape, UNSEEN, dtype=np.uint8)
    status[0], status[-1], status[:, 0], status[:, -1] = 2, 2, 2, 2
    for changed, values in recorder.scans:
        status.ravel()[changed] = values
    return status
