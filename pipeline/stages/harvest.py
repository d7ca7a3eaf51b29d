"""Harvest: the optimistic planner explores each training plan; every new or changed subgoal gives one datum."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path

from omegaconf import DictConfig

from pipeline.datums import Datum, digest, shard_path, stack, summarise, write_shard
from pipeline.errors import TableError
from pipeline.files import digest_file, write_json
from pipeline.grids.store import PackedWorld, Pair, read_packed_worlds, read_pairs
from pipeline.randomness import stream
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.world import make_world
from pipeline.stages.door import StageResult, launch, typed, workspace
from pipeline.stages.settings import RobotConfig, SensorConfig, require
from pipeline.stages.units import digest_code, run_units
from pipeline.systems.subgoals.harvest import Origin, harvest_trial

CODE = ("stages/harvest.py", "grids", "planning", "simulation", "datums", "randomness.py", "systems/subgoals")


@dataclass(frozen=True, kw_only=True)
class HarvestConfig:
    """How training plans are explored (conf/harvest/)."""

    splits: list[str] = field(default_factory=lambda: ["train", "validation"])
    """Splits to explore; test plans stay unseen."""
    pairs_per_shard: int = 16
    """Start-goal pairs in one shard: what a killed run loses at most, per worker."""
    weight_floor_m: float = 1.0
    """Least misclassification cost of a subgoal [m]."""
    map_views: bool = False
    """Store with each datum how the robot's whole map shows its subgoal, for train.input_frame=map."""
    max_steps: int | None = None
    """Scans after which an exploration is cut off; null means a bound that no planner meets."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        allowed = ("train", "validation")
        require(
            bool(self.splits) and all(split in allowed for split in self.splits),
            "harvest.splits",
            self.splits,
            "one or both of train, validation",
        )
        require(1 <= self.pairs_per_shard <= 100_000, "harvest.pairs_per_shard", self.pairs_per_shard, "at least 1")
        require(self.weight_floor_m > 0, "harvest.weight_floor_m", self.weight_floor_m, "above 0 m")
        require(self.max_steps is None or self.max_steps > 0, "harvest.max_steps", self.max_steps, "null or above 0")


@dataclass(frozen=True)
class _Task:
    """One shard's work: pairs and the plans they lie in."""

    pairs: Sequence[Pair]
    worlds: dict[str, PackedWorld]


def harvest(raw: DictConfig) -> StageResult:
    """Write the datum table of the training and validation plans to ``artifacts/harvest``."""
    config = typed(HarvestConfig, raw, "harvest")
    sensor, robot = typed(SensorConfig, raw, "sensor"), typed(RobotConfig, raw, "robot")
    work = workspace(raw)
    source, target = work.folder("rasterize"), work.folder("harvest")
    tasks = [task for split in config.splits for task in _tasks(source, split, config, robot)]
    fingerprint = {
        "code": digest_code(*CODE),
        "grids": digest_file(source / "grids.parquet"),
        "pairs": digest_file(source / "pairs.parquet"),
        "seed": work.seed,
        "harvest": asdict(config),
        "sensor": asdict(sensor),
        "robot": asdict(robot),
    }
    shards = target / "datums"
    resumed = run_units(
        [(shard_path(shards, index), task) for index, task in enumerate(tasks)],
        partial(_write_shard, config=config, sensor=sensor, robot=robot, seed=work.seed),
        shards,
        fingerprint,
        workers=work.workers,
        label="harvest",
        progress=work.progress,
    )
    return _summarise(target, shards, len(tasks), resumed, _made_with(tasks, config, sensor, robot))


def _made_with(
    tasks: Sequence[_Task], config: HarvestConfig, sensor: SensorConfig, robot: RobotConfig
) -> dict[str, object]:
    """Return the settings that a network of these datums is bound to, by their whole names."""
    resolutions = sorted({world.row["resolution_m"] for task in tasks for world in task.worlds.values()})
    sections = {"sensor": asdict(sensor), "robot": asdict(robot), "harvest": asdict(config)}
    flat = {f"{name}.{key}": value for name, section in sections.items() for key, value in section.items()}
    return flat | {"rasterize.resolution_m": resolutions[0] if len(resolutions) == 1 else resolutions}


def _tasks(source: Path, split: str, config: HarvestConfig, robot: RobotConfig) -> list[_Task]:
    size = config.pairs_per_shard
    pairs = read_pairs(source, split)
    if not pairs:
        raise TableError(
            f"{source / 'pairs.parquet'}: no start-goal pairs in the split {split!r}, expected at least one. "
            f"Raise the share or count of {split} plans in conf/rasterize or conf/plans, or take it out of "
            "harvest.splits."
        )
    worlds = {world.plan_id: world for world in read_packed_worlds(source, split, robot_radius_m=robot.radius_m)}
    blocks = [pairs[first : first + size] for first in range(0, len(pairs), size)]
    return [_Task(block, {pair.plan_id: worlds[pair.plan_id] for pair in block}) for block in blocks]


def _write_shard(
    scratch: Path, task: _Task, *, config: HarvestConfig, sensor: SensorConfig, robot: RobotConfig, seed: int
) -> None:
    lidar = make_lidar(**asdict(sensor))
    worlds = {name: make_world(name, packed.unpack().grid, robot.radius_m) for name, packed in task.worlds.items()}
    datums: list[Datum] = []
    for pair in task.pairs:
        _, found = harvest_trial(
            worlds[pair.plan_id],
            pair.start,
            pair.goal,
            Origin(pair.pair_id, pair.plan_id, pair.building, pair.environment, pair.split, seed),
            lidar=lidar,
            step_m=robot.step_m,
            weight_floor_m=config.weight_floor_m,
            rng=stream(seed, "harvest", pair.pair_id),
            merge_m=robot.merge_m,
            max_steps=config.max_steps,
            map_views=config.map_views,
        )
        datums += found
    write_shard(scratch, stack(datums, beams=lidar.input_beams))


def _summarise(target: Path, shards: Path, count: int, resumed: int, made_with: dict[str, object]) -> StageResult:
    found, whole = summarise(shards), digest(shards)
    counts = found._asdict() | {"shards": count, "digest": whole}
    write_json(target / "harvest.json", counts | {"made_with": made_with})
    print(f"harvest: {found.datums} datums in {count} shards ({resumed} were there already), digest {whole[:12]}")
    return StageResult(
        metrics={"datums": float(found.datums), "leading_share": found.leading_share},
        files=[target / "harvest.json"],
        datasets={"datums": (shards, whole)},
    )


if __name__ == "__main__":
    launch("harvest", harvest)
