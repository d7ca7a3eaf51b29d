"""The harvest in units of work: a shard of datums for each block of start-goal pairs."""

from collections.abc import Sequence
from pathlib import Path

from pipeline.datums import Datum, digest, stack, summarise, write_shard
from pipeline.grids.blocks import PairBlock, pairs_in_blocks
from pipeline.randomness import stream
from pipeline.settings import RobotConfig, SensorConfig
from pipeline.simulation.ground import Ground
from pipeline.simulation.robots import make_robot
from pipeline.systems.subgoals.harvest import Origin, harvest_trial
from pipeline.systems.subgoals.settings import HarvestConfig
from pipeline.systems.system import Harvest, Harvested, Job


def units(source: Path, job: Job) -> Sequence[PairBlock]:
    """Return the blocks of pairs to explore, split after split."""
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
    """Explore the pairs of ``block`` and write their datums as one shard."""
    config, robot = job.section("harvest", HarvestConfig), job.section("robot", RobotConfig)
    sensor = job.section("sensor", SensorConfig)
    equipped = make_robot(sensor, robot)
    worlds = {name: Ground(packed.unpack()).world for name, packed in block.worlds.items()}
    datums: list[Datum] = []
    for pair in block.pairs:
        _, found = harvest_trial(
            worlds[pair.plan_id],
            pair.start,
            pair.goal,
            Origin(pair.pair_id, pair.plan_id, pair.building, pair.environment, pair.split, job.seed),
            robot=equipped,
            weight_floor_m=config.weight_floor_m,
            rng=stream(job.seed, "harvest", pair.pair_id),
            max_steps=config.max_steps,
            map_views=config.map_views,
        )
        datums += found
    write_shard(scratch, stack(datums, beams=sensor.input_beams))


def summarise_shards(shards: Path, job: Job) -> Harvested:
    """Return the counts, the digest and a sentence on all shards."""
    found, whole = summarise(shards), digest(shards)
    return Harvested(found._asdict(), whole, f"{found.datums} datums")


HARVEST = Harvest(folder="datums", units=units, make=make, summarise=summarise_shards)
