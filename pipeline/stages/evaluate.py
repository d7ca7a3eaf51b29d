"""Evaluate: paired trials on unseen plans for the optimistic and the learned planner, and the two bounds."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from omegaconf import DictConfig

from pipeline.errors import TableError
from pipeline.evaluation.cost_table import format_cost_table
from pipeline.evaluation.ransac import THRESHOLD_M
from pipeline.evaluation.summary import flat_metrics, summarise
from pipeline.evaluation.trials import (
    EpisodeRow,
    TrialRow,
    write_episodes,
    write_estimates,
    write_trials,
)
from pipeline.files import check_sum, digest_file, write_json, write_table
from pipeline.grids.distances import NOWHERE
from pipeline.grids.occupancy import center_of
from pipeline.grids.store import PackedWorld, Pair, read_packed_worlds, read_pairs
from pipeline.planning.protocols import Estimator
from pipeline.randomness import stream
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import require_possible
from pipeline.simulation.world import World, make_world
from pipeline.stages.door import StageResult, launch, typed, workspace
from pipeline.stages.settings import PlannerConfig, RobotConfig, SensorConfig, require
from pipeline.stages.units import digest_code, run_units
from pipeline.systems.subgoals.competition import PLANNERS, Drive, Rules, drive
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner

CODE = ("grids", "planning", "simulation", "systems/subgoals", "evaluation")
TABLES: dict[str, Callable[[Path, list[Any]], pa.Table]] = {
    "trials": write_trials,
    "estimates": write_estimates,
    "episodes": write_episodes,
}


@dataclass(frozen=True, kw_only=True)
class EvaluateConfig:
    """Which trials are run and by whom (conf/evaluate/)."""

    split: str = "test"
    planners: list[str] = field(default_factory=lambda: list(PLANNERS))
    """Who drives. The optimistic planner always does: costs are compared with its."""
    pairs_per_unit: int = 8
    """Start-goal pairs in one unit of work: what a killed run loses at most, per worker."""
    recorded_trials: int = 24
    """Trials whose paths, maps and frontiers are kept for pictures."""
    weight_floor_m: float = 1.0
    """As harvest.weight_floor_m [m]."""
    ransac_threshold_m: float = THRESHOLD_M
    """Residual threshold of the RANSAC line with an intercept [m]: the authors' 200 cells of 0.1 m."""
    max_steps: int | None = None
    """Scans after which a trial is cut off; null means a bound that no planner meets."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        splits = ("test", "validation", "train")
        require(self.split in splits, "evaluate.split", self.split, "test, validation or train")
        require(
            "optimistic" in self.planners and all(name in PLANNERS for name in self.planners),
            "evaluate.planners",
            self.planners,
            f"optimistic and any others of {', '.join(PLANNERS)}",
        )
        require(self.pairs_per_unit >= 1, "evaluate.pairs_per_unit", self.pairs_per_unit, "at least 1")
        require(self.recorded_trials >= 0, "evaluate.recorded_trials", self.recorded_trials, "at least 0")
        require(self.weight_floor_m > 0, "evaluate.weight_floor_m", self.weight_floor_m, "above 0 m")
        require(self.ransac_threshold_m > 0, "evaluate.ransac_threshold_m", self.ransac_threshold_m, "above 0 m")
        require(self.max_steps is None or self.max_steps > 0, "evaluate.max_steps", self.max_steps, "null or above 0")


@dataclass(frozen=True)
class _Task:
    """One unit's work: pairs, the plans they lie in, and how many of the pairs are recorded."""

    pairs: Sequence[Pair]
    worlds: dict[str, PackedWorld]
    recorded: int


@dataclass(frozen=True, kw_only=True)
class _Settings:
    evaluate: EvaluateConfig
    sensor: SensorConfig
    robot: RobotConfig
    planner: PlannerConfig
    seed: int
    network: Path


def evaluate(raw: DictConfig) -> StageResult:
    """Write trials, estimates, episodes and their summary to ``artifacts/evaluate``."""
    work = workspace(raw)
    settings = _Settings(
        evaluate=typed(EvaluateConfig, raw, "evaluate"),
        sensor=typed(SensorConfig, raw, "sensor"),
        robot=typed(RobotConfig, raw, "robot"),
        planner=typed(PlannerConfig, raw, "planner"),
        seed=work.seed,
        network=work.folder("train") / "network.safetensors",
    )
    source, target = work.folder("rasterize"), work.folder("evaluate")
    if "learned" in settings.evaluate.planners:
        LearnedEstimator.load(settings.network)  # a missing or foreign file ends the stage before any trial
    tasks = _tasks(source, settings.evaluate)
    parts = target / "parts"
    run_units(
        [(parts / f"part-{index:06d}", task) for index, task in enumerate(tasks)],
        partial(_run_unit, settings=settings),
        parts,
        _fingerprint(source, settings),
        workers=work.workers,
        label="evaluate",
        progress=work.progress,
    )
    merged = {name: _merge(parts, name, target / f"{name}.parquet") for name in TABLES}
    summary = summarise(
        merged["trials"], merged["estimates"], work.seed, ransac_threshold_m=settings.evaluate.ransac_threshold_m
    )
    write_json(target / "summary.json", summary)
    print(format_cost_table(summary))
    return StageResult(
        metrics=flat_metrics(summary),
        files=[target / "summary.json"],
        datasets={"trials": (target / "trials.parquet", summary["digest"])},
    )


def _fingerprint(source: Path, settings: _Settings) -> dict[str, Any]:
    sections = {name: asdict(getattr(settings, name)) for name in ("evaluate", "sensor", "robot", "planner")}
    learned = "learned" in settings.evaluate.planners
    return sections | {
        "code": digest_code(*CODE),
        "grids": digest_file(source / "grids.parquet"),
        "pairs": digest_file(source / "pairs.parquet"),
        "network": digest_file(settings.network) if learned else None,
        "seed": settings.seed,
    }


def _tasks(source: Path, config: EvaluateConfig) -> list[_Task]:
    pairs = read_pairs(source, config.split)
    if not pairs:
        raise TableError(
            f"{source / 'pairs.parquet'}: no start-goal pairs in the split {config.split!r}, expected at least one. "
            "Raise the share or count of its plans in conf/rasterize or conf/plans, or change evaluate.split."
        )
    worlds = {world.plan_id: world for world in read_packed_worlds(source, config.split)}
    tasks = []
    for first in range(0, len(pairs), config.pairs_per_unit):
        block = pairs[first : first + config.pairs_per_unit]
        recorded = min(len(block), max(0, config.recorded_trials - first))
        tasks.append(_Task(block, {pair.plan_id: worlds[pair.plan_id] for pair in block}, recorded))
    return tasks


def _run_unit(scratch: Path, task: _Task, *, settings: _Settings) -> None:
    rows: dict[str, list[Any]] = {name: [] for name in TABLES}
    learned = LearnedEstimator.load(settings.network) if "learned" in settings.evaluate.planners else None
    radius = settings.robot.radius_m
    worlds = {name: make_world(name, packed.unpack().grid, radius) for name, packed in task.worlds.items()}
    for index, pair in enumerate(task.pairs):
        world = worlds[pair.plan_id]
        drives = _drive_pair(pair, world, learned, settings)
        rows["trials"] += [_trial_row(pair, world, found) for found in drives] + [_known_map_row(pair, world)]
        rows["estimates"] += [row for found in drives for row in found.estimates]
        rows["episodes"] += [_episode_row(pair, world, found) for found in drives if index < task.recorded]
    for name, write in TABLES.items():
        write(scratch / f"{name}.parquet", rows[name])


def _drive_pair(pair: Pair, world: World, learned: Estimator | None, settings: _Settings) -> list[Drive]:
    rules = Rules(
        lidar=make_lidar(**asdict(settings.sensor)),
        step_m=settings.robot.step_m,
        merge_m=settings.robot.merge_m,
        weight_floor_m=settings.evaluate.weight_floor_m,
        max_steps=settings.evaluate.max_steps,
        plan_over=partial(_plan_over, config=settings.planner),
    )
    return [
        drive(name, world, pair.start, pair.goal, rules, trial_id=pair.pair_id, learned=learned,
              rng=stream(settings.seed, "evaluate", pair.pair_id))
        for name in settings.evaluate.planners
    ]  # fmt: skip


def _plan_over(estimator: Estimator, config: PlannerConfig) -> SubgoalPlanner:
    return SubgoalPlanner(estimator=estimator, **asdict(config))


def _trial_row(pair: Pair, world: World, found: Drive) -> TrialRow:
    episode = found.episode
    require_possible(episode, pair.known_map_m, f"{found.planner} on {pair.pair_id}")
    return _row(pair, world, found.planner, episode.travelled, episode.ending.name.lower(), episode.steps,
                episode.decisions, episode.seconds)  # fmt: skip


def _known_map_row(pair: Pair, world: World) -> TrialRow:
    return _row(pair, world, "known_map", pair.known_map_m, "reached", 0, 0, 0.0)


def _row(
    pair: Pair, world: World, planner: str, cost: float, ending: str, steps: int, decisions: int, seconds: float
) -> TrialRow:
    start, goal = center_of(world.grid, pair.start), center_of(world.grid, pair.goal)
    return TrialRow(pair.pair_id, pair.plan_id, pair.building, pair.environment, pair.split, planner, cost, ending,
                    steps, decisions, seconds, start.x, start.y, goal.x, goal.y)  # fmt: skip


def _episode_row(pair: Pair, world: World, found: Drive) -> EpisodeRow:
    cols = world.grid.cells.shape[1]
    path_row, path_col = np.divmod(found.episode.path, cols)
    sizes = np.array([frontier.cells.size for frontier in found.frontiers], dtype=np.int64)
    cells = np.concatenate([frontier.cells for frontier in found.frontiers]) if sizes.size else NOWHERE
    return EpisodeRow(
        trial_id=pair.pair_id,
        planner=found.planner,
        plan_id=pair.plan_id,
        resolution_m=world.grid.resolution,
        origin_x_m=world.grid.origin.x,
        origin_y_m=world.grid.origin.y,
        truth=world.grid.cells,
        known=found.episode.known,
        path_row=path_row,
        path_col=path_col,
        frontier_step=np.repeat(np.array([frontier.step for frontier in found.frontiers], dtype=np.int64), sizes),
        frontier_row=cells // cols,
        frontier_col=cells % cols,
        frontier_p=np.repeat(np.array([frontier.p_success for frontier in found.frontiers], dtype=np.float64), sizes),
        cost_m=found.episode.travelled,
        start_row=pair.start.row,
        start_col=pair.start.col,
        goal_row=pair.goal.row,
        goal_col=pair.goal.col,
    )


def _merge(parts: Path, name: str, target: Path) -> pa.Table:
    files = [part / f"{name}.parquet" for part in sorted(parts.glob("part-*"))]
    for file in files:
        check_sum(file, "Run `dvc repro -f evaluate`: it makes damaged parts anew and keeps the others.")
    table = pa.concat_tables([pq.read_table(file) for file in files])
    write_table(target, table)
    return table


if __name__ == "__main__":
    launch("evaluate", evaluate)
