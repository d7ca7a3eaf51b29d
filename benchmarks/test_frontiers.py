"""Frontiers after each scan of a drive: kept up to date, found anew, and by labelling with public packages."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, generate_binary_structure, label

from benchmarks.worlds import across, draw_maze, rooms
from pipeline.grids.partial_map import BLOCKED, CHANGES, CLEAR, unseen_map
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Surroundings
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import Robot, run_trial

CROSS, SQUARE = generate_binary_structure(2, 1), np.ones((3, 3), dtype=bool)


class Recorder(OptimisticPlanner):
    """Drives, and keeps what was seen at each decision: the pose, and which cells changed and to what."""

    def __init__(self) -> None:
        super().__init__()
        self.scans: list[tuple[Seen, NDArray[np.int32], NDArray[np.uint8]]] = []
        self._read = 0

    def plan(self, seen: Seen) -> NDArray[np.int32] | None:
        changed = seen.map.changes[self._read : seen.map.written[CHANGES]].copy()
        self._read = int(seen.map.written[CHANGES])
        self.scans.append((seen, changed, seen.map.status.ravel()[changed].copy()))
        return super().plan(seen)


def replay(recorder: Recorder):
    """Yield the map, from its beginning, after each scan."""
    first = recorder.scans[0][0]
    map_ = unseen_map(*first.map.status.shape)
    for seen, changed, values in recorder.scans:
        map_.status.ravel()[changed] = values
        written = int(map_.written[CHANGES])
        map_.changes[written : written + changed.size] = changed
        map_.written[CHANGES] += changed.size
        yield seen._replace(map=map_)


def kept(recorder: Recorder) -> int:
    around, count = None, 0
    for seen in replay(recorder):
        if around is None:
            around = Surroundings(seen)
        else:
            around.update(seen)
        count += len(around.subgoals)
    return count


def anew(recorder: Recorder) -> int:
    return sum(len(Surroundings(seen).subgoals) for seen in replay(recorder))


def labelled(recorder: Recorder, components) -> int:
    """The same frontiers by three labellings and a dilation of the whole image."""
    count = 0
    for seen in replay(recorder):
        status, goal = seen.map.status, seen.goal
        reached = component(status == CLEAR, components, (seen.pose.row, seen.pose.col))
        beyond = component((status != BLOCKED) & ~reached, components, goal)
        border = reached & binary_dilation(beyond, CROSS)
        count += int(components(border, 8).max())
    return count


def component(mask: NDArray[np.bool_], components, at: tuple[int, int]) -> NDArray[np.bool_]:
    parts = components(mask, 4)
    return parts == parts[at] if mask[at] else np.zeros_like(mask)


def by_scipy(mask: NDArray[np.bool_], connectivity: int) -> NDArray[np.int32]:
    return label(mask, CROSS if connectivity == 4 else SQUARE)[0]


def by_cc3d(mask: NDArray[np.bool_], connectivity: int) -> NDArray[np.uint32]:
    import cc3d

    return cc3d.connected_components(mask, connectivity=connectivity)


WAYS = {
    "kept": kept,
    "anew": anew,
    "scipy label": lambda recorder: labelled(recorder, by_scipy),
    "connected-components-3d": lambda recorder: labelled(recorder, by_cc3d),
}


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", ["maze 188 x 144", "rooms 300 x 500"])
def test_frontiers_after_each_scan(benchmark, name: str, way: str) -> None:
    if way == "connected-components-3d":
        pytest.importorskip("cc3d", reason="pip install -e '.[bench]'")
    benchmark.group = f"frontiers after a scan: {name}"
    trial = draw_maze(0) if name.startswith("maze") else across(rooms(300, 500))
    recorder, lidar = Recorder(), make_lidar(beams=256, input_beams=256, max_range_m=18.0)
    run_trial(*trial, recorder, robot=Robot(lidar, step_m=0.54), rng=np.random.default_rng(0))
    found = benchmark.pedantic(WAYS[way], args=(recorder,), rounds=3, warmup_rounds=1)
    assert found == kept(recorder) > 0
    benchmark.extra_info |= {
        "scans": len(recorder.scans),
        "ms_per_scan": 1e3 * benchmark.stats.stats.median / len(recorder.scans),
        "frontiers_per_scan": found / len(recorder.scans),
    }
