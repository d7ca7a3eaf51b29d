"""Datums of how a map grows: whenever an explorer chooses, what each frontier looks like and what it would show."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from pipeline.grids.blocks import PairBlock, pairs_in_blocks
from pipeline.grids.occupancy import Cell, OccupancyGrid, center_of
from pipeline.grids.store import Pair
from pipeline.planning.seen import Seen
from pipeline.randomness import stream
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.simulation.ground import Ground
from pipeline.simulation.robots import make_robot
from pipeline.simulation.trial import Robot, run_trial
from pipeline.systems.exploration.explorers import Nearest, Target
from pipeline.systems.exploration.frontiers import Frontiers
from pipeline.systems.exploration.gain import SECTORS, Lookout
from pipeline.systems.exploration.growth import Survey
from pipeline.systems.exploration.settings import HarvestConfig, PlannerConfig
from pipeline.systems.system import Harvest, Harvested, Job
from pipeline.tables import Table, column, digest_of

BEARINGS = 12
"""The unseen space around a frontier is counted by so many bearings, 30 degrees each, from +x on."""


class GrowthDatum(NamedTuple):
    """One frontier when an explorer chose: cheap numbers of it, and what it would truly show.

    x_m, y_m: its middle, world frame. frontier_cells: its size. span_m: diagonal of the box around it.
    distance_m: way there through known free space. frontiers: how many there were. seen_m2: area seen so far.
    unseen_m2: unseen area in the best view from the middle, were nothing in the way but obstacles already seen.
    bearing_m2: [BEARINGS] the same all around, by bearing. shown_m2: what that view truly shows of free space.
    """

    pair_id: str
    plan_id: str
    building: str
    environment: str
    split: str
    step: int
    x_m: float
    y_m: float
    frontier_cells: int
    span_m: float
    distance_m: float
    frontiers: int
    seen_m2: float
    unseen_m2: float
    bearing_m2: Sequence[float]
    shown_m2: float


_real = pa.float32()
MAP_GROWTH = Table(
    "map_growth",
    1,
    [
        *(column(name, pa.string()) for name in ("pair_id", "plan_id", "building", "environment", "split")),
        column("step", pa.int32()),
        column("x_m", _real, unit="m", frame="world"),
        column("y_m", _real, unit="m", frame="world"),
        column("frontier_cells", pa.int32()),
        column("span_m", _real, unit="m"),
        column("distance_m", _real, unit="m"),
        column("frontiers", pa.int32()),
        column("seen_m2", _real, unit="m2"),
        column("unseen_m2", _real, unit="m2"),
        column("bearing_m2", pa.list_(_real, BEARINGS), unit="m2", frame="world"),
        column("shown_m2", _real, unit="m2"),
    ],
    stage="harvest",
)


class _Collector(Nearest):
    """Explores as the nearest-frontier planner does and keeps a datum of every frontier it chooses from."""

    def __init__(self, robot: Robot, pair: Pair, grid: OccupancyGrid, survey: Survey) -> None:
        self._settings = PlannerConfig()
        super().__init__(robot, self._settings)
        self._pair, self._grid, self._survey = pair, grid, survey
        self._looks: tuple[Lookout, Lookout] | None = None
        self.datums: list[GrowthDatum] = []

    def choose(self, seen: Seen, frontiers: Frontiers) -> Target:
        known, beams = seen.map.known, self._settings.gain_beams
        if self._looks is None:
            hopeful, true = (
                Lookout(self._sensor, beams, known, opaque, seen.resolution) for opaque in (known, self._grid.cells)
            )
            self._looks = hopeful, true
        distances = frontiers.reach.distance_to(frontiers.middles) * seen.resolution
        for k, middle in enumerate(frontiers.middles.tolist()):
            cells = frontiers.cells[frontiers.starts[k] : frontiers.starts[k + 1]]
            self.datums.append(self._datum(seen, middle, cells, float(distances[k]), frontiers.middles.size))
        return super().choose(seen, frontiers)

    def _datum(self, seen: Seen, middle: int, cells: np.ndarray, distance_m: float, frontiers: int) -> GrowthDatum:
        assert self._looks is not None
        hopeful, true = self._looks
        area, cols = seen.resolution**2, seen.map.status.shape[1]
        counts = hopeful.sectors(middle)
        view = hopeful.best(counts)
        at = center_of(self._grid, Cell(*divmod(middle, cols)))
        box = np.ptp(np.stack(np.divmod(cells, cols)), axis=1)
        pair = self._pair
        return GrowthDatum(
            pair.pair_id, pair.plan_id, pair.building, pair.environment, pair.split,
            step=seen.step,
            x_m=at.x,
            y_m=at.y,
            frontier_cells=int(cells.size),
            span_m=float(np.hypot(*box)) * seen.resolution,
            distance_m=distance_m,
            frontiers=frontiers,
            seen_m2=self._survey.seen * area,
            unseen_m2=view.unseen * area,
            bearing_m2=(counts.reshape(BEARINGS, SECTORS // BEARINGS).sum(axis=1) * area).tolist(),
            shown_m2=true.seen_from(middle, view.heading) * area,
        )  # fmt: skip


def harvest_trial(
    ground: Ground, pair: Pair, robot: Robot, rng: np.random.Generator, max_steps: int | None
) -> list[GrowthDatum]:
    """Return the datums of exploring ``ground`` from the start of ``pair``, in order of step and frontier."""
    survey = Survey(ground.world, pair.start)
    collector = _Collector(robot, pair, ground.record.grid, survey)
    run_trial(ground.world, pair.start, survey, collector, robot=robot, rng=rng, max_steps=max_steps)
    return collector.datums


def units(source: Path, job: Job) -> Sequence[PairBlock]:
    """Return the blocks of starts to explore from, split after split."""
    config, robot = job.section("harvest", HarvestConfig), job.section("robot", RobotConfig)
    return [
        block
        for split in config.splits
        for block in pairs_in_blocks(
            source,
            split,
            config.pairs_per_shard,
            robot_radius_m=robot.radius_m,
            otherwise="take it out of harvest.splits",
        )
    ]


def make(scratch: Path, block: PairBlock, job: Job) -> None:
    """Explore from the starts of ``block`` and write the datums as one shard."""
    robot = make_robot(job.section("sensor", SensorConfig), job.section("robot", RobotConfig))
    grounds = {name: Ground(packed.unpack()) for name, packed in block.worlds.items()}
    most = job.section("harvest", HarvestConfig).max_steps
    datums: list[GrowthDatum] = []
    for pair in block.pairs:
        datums += harvest_trial(
            grounds[pair.plan_id], pair, robot, stream(job.seed, "harvest", pair.pair_id), most
        )  # fmt: skip
    MAP_GROWTH.write(scratch, MAP_GROWTH.stack(datums))


def summarise(shards: Path, job: Job) -> Harvested:
    """Return counts, means, the digest and a sentence on all shards."""
    table = pa.concat_tables(list(MAP_GROWTH.blocks(shards)))
    means = {name: float(np.mean(table.column(name).to_numpy())) for name in ("unseen_m2", "shown_m2")}
    trials = len(set(table.column("pair_id").to_pylist()))
    numbers = {"datums": table.num_rows, "trials": trials} | {f"mean_{name}": value for name, value in means.items()}
    said = (
        f"{table.num_rows} frontiers on {trials} explorations, which hoped for {means['unseen_m2']:.1f} m2 and showed "
        f"{means['shown_m2']:.1f} m2 in the mean"
    )
    return Harvested(numbers, digest_of(table), said)


HARVEST = Harvest(folder="growth", units=units, make=make, summarise=summarise)
