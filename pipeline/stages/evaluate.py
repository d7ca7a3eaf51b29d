"""Evaluate: paired trials on unseen plans for the optimistic and the learned planner, and the two bounds."""

import sys
from collections.abc import Callable, Iterator, Sequence
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
from pipeline.evaluation.telling import telling_trials
from pipeline.evaluation.trials import (
    EpisodeRow,
    TrialRow,
    trial_rows,
    write_episodes,
    write_estimates,
    write_trials,
)
from pipeline.files import check_sum, digest_file, write_json, write_table
from pipeline.grids.distances import NOWHERE
from pipeline.grids.occupancy import center_of
from pipeline.grids.store import PackedWorld, Pair, read_packed_worlds, read_pairs
from pipeline.learning.provenance import made_differently
from pipeline.planning.protocols import Estimator
from pipeline.randomness import stream
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import require_possible
from pipeline.simulation.world import World, make_world
from pipeline.stages.door import StageResult, launch, typed, workspace
from pipeline.stages.settings import PlannerConfig, RobotConfig, SensorConfig, require
from pipeline.stages.units import Unit, digest_code, run_units
from pipeline.systems.subgoals.competition import PLANNERS, Drive, Rules, drive
from pipeline.systems.subgoals.estimator import LearnedEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner

CODE = (
    "stages/evaluate.py", "evaluation", "grids", "learning", "planning", "randomness.py", "simulation",
    "systems/subgoals",
)  # fmt: skip
CHOSE = {
    "train": "The network learned from these very plans (evaluate.split = train): ratio and calibration flatter it.",
    "validation": "These plans chose the network's step and calibration (evaluate.split = validation): ratio and "
    "calibration flatter it.",
}
TABLES: dict[str, Callable[[Path, list[Any]], pa.Table]] = {"trials": write_trials, "estimates": write_estimates}


@dataclass(frozen=True, kw_only=True)
class EvaluateConfig:
    """Which trials are run and by whom (conf/evaluate/)."""

    split: str = "test"
    planners: list[str] = field(default_factory=lambda: list(PLANNERS))
    """Who drives. The optimistic planner always does: costs are compared with its."""
    pairs_per_unit: int = 8
    """Start-goal pairs in one unit of work: what a killed run loses at most, per worker."""
    recorded_trials: int = 24
    """Trials whose paths, maps and frontiers are kept for pictures: the worst, the best and typical ones."""
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
    """One unit's work: pairs and the plans they lie in."""

    pairs: Sequence[Pair]
    worlds: dict[str, PackedWorld]


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
    pairs, worlds = _trials(source, settings)
    network = _load(settings).header.made_with if "learned" in settings.evaluate.planners else None
    remarks = _remarks(settings, worlds, network)
    for remark in remarks:
        print(f"warning: {remark}", file=sys.stderr)
    run = partial(run_units, workers=work.workers, progress=work.progress)
    fingerprint = _fingerprint(source, settings)
    tasks = _tasks(pairs, worlds, settings.evaluate.pairs_per_unit)
    run(_units(target / "parts", tasks), partial(_run_unit, settings=settings), target / "parts", fingerprint,
        label="evaluate")  # fmt: skip
    merged = {name: _merge(target / "parts", f"{name}.parquet", target / f"{name}.parquet") for name in TABLES}
    _record(target, merged["trials"], pairs, worlds, settings, run, fingerprint)
    summary = summarise(
        merged["trials"],
        merged["estimates"],
        work.seed,
        ransac_threshold_m=settings.evaluate.ransac_threshold_m,
        remarks=remarks,
        network=network,
    )
    write_json(target / "summary.json", summary)
    print(format_cost_table(summary))
    return StageResult(
        metrics=flat_metrics(summary),
        files=[target / "summary.json"],
        datasets={"trials": (target / "trials.parquet", summary["digest"])},
    )


def _remarks(settings: _Settings, worlds: dict[str, PackedWorld], network: dict[str, Any] | None) -> list[str]:
    """Return in what these trials differ from the data that the network was made with, and whether they made it."""
    if network is None:
        return []
    resolutions = sorted({world.row["resolution_m"] for world in worlds.values()})
    sections = {"sensor": asdict(settings.sensor), "robot": asdict(settings.robot)}
    present = {f"{name}.{key}": value for name, section in sections.items() for key, value in section.items()}
    present["rasterize.resolution_m"] = resolutions[0] if len(resolutions) == 1 else resolutions
    found = made_differently(network, present)
    return [*found, *(remark for split, remark in CHOSE.items() if split == settings.evaluate.split)]


def _fingerprint(source: Path, settings: _Settings) -> dict[str, Any]:
    sections = {name: asdict(getattr(settings, name)) for name in ("evaluate", "sensor", "robot", "planner")}
    for key in ("recorded_trials", "ransac_threshold_m"):  # they change no drive
        del sections["evaluate"][key]
    learned = "learned" in settings.evaluate.planners
    return sections | {
        "code": digest_code(*CODE),
        "grids": digest_file(source / "grids.parquet"),
        "pairs": digest_file(source / "pairs.parquet"),
        "network": digest_file(settings.network) if learned else None,
        "seed": settings.seed,
    }


def _trials(source: Path, settings: _Settings) -> tuple[list[Pair], dict[str, PackedWorld]]:
    """Return the start-goal pairs of the split, and the plans they lie in by name."""
    split = settings.evaluate.split
    pairs = read_pairs(source, split)
    if not pairs:
        raise TableError(
            f"{source / 'pairs.parquet'}: no start-goal pairs in the split {split!r}, expected at least one. "
            "Raise the share or count of its plans in conf/rasterize or conf/plans, or change evaluate.split."
        )
    worlds = read_packed_worlds(source, split, robot_radius_m=settings.robot.radius_m)
    return pairs, {world.plan_id: world for world in worlds}


def _tasks(pairs: Sequence[Pair], worlds: dict[str, PackedWorld], size: int) -> list[_Task]:
    blocks = [pairs[first : first + size] for first in range(0, len(pairs), size)]
    return [_Task(block, {pair.plan_id: worlds[pair.plan_id] for pair in block}) for block in blocks]


def _units(folder: Path, tasks: Sequence[_Task]) -> list[Unit]:
    return [(folder / f"part-{index:06d}", task) for index, task in enumerate(tasks)]


def _run_unit(scratch: Path, task: _Task, *, settings: _Settings) -> None:
    rows: dict[str, list[Any]] = {name: [] for name in TABLES}
    for pair, world, drives in _drives(task, settings):
        rows["trials"] += [_trial_row(pair, world, found) for found in drives] + [_known_map_row(pair, world)]
        rows["estimates"] += [row for found in drives for row in found.estimates]
    for name, write in TABLES.items():
        write(scratch / f"{name}.parquet", rows[name])


def _record(
    target: Path,
    trials: pa.Table,
    pairs: Sequence[Pair],
    worlds: dict[str, PackedWorld],
    settings: _Settings,
    run: Callable[..., int],
    fingerprint: dict[str, Any],
) -> None:
    """Drive the most telling trials once more, from the same seeds, and write what pictures need of them."""
    chosen = telling_trials(trials, settings.evaluate.recorded_trials)
    costs = {(row.trial_id, row.planner): row.cost_m for row in trial_rows(trials)}
    tasks = _tasks([pair for pair in pairs if pair.pair_id in set(chosen)], worlds, settings.evaluate.pairs_per_unit)
    folder = target / "records"
    run(_units(folder, tasks), partial(_record_unit, settings=settings, costs=costs), folder,
        fingerprint | {"recorded": chosen}, label="record")  # fmt: skip
    if tasks:
        _merge(folder, "episodes.parquet", target / "episodes.parquet")
    else:
        write_episodes(target / "episodes.parquet", [])


def _record_unit(scratch: Path, task: _Task, *, settings: _Settings, costs: dict[tuple[str, str], float]) -> None:
    rows = []
    for pair, world, drives in _drives(task, settings):
        for found in drives:
            before = costs[pair.pair_id, found.planner]
            if found.episode.travelled != before:
                raise TableError(
                    f"trial {pair.pair_id!r} of planner {found.planner!r} took {before} m and, driven again from its "
                    f"seed, {found.episode.travelled} m: these must be equal. Its planner is not deterministic."
                )
            rows.append(_episode_row(pair, world, found))
    write_episodes(scratch / "episodes.parquet", rows)


def _drives(task: _Task, settings: _Settings) -> Iterator[tuple[Pair, World, list[Drive]]]:
    """Yield each pair of ``task`` with its world and the drives of all planners."""
    learned = _load(settings) if "learned" in settings.evaluate.planners else None
    radius = settings.robot.radius_m
    worlds = {name: make_world(name, packed.unpack().grid, radius) for name, packed in task.worlds.items()}
    for pair in task.pairs:
        world = worlds[pair.plan_id]
        yield pair, world, _drive_pair(pair, world, learned, settings)


def _load(settings: _Settings) -> LearnedEstimator:
    return LearnedEstimator.load(settings.network, input_beams=settings.sensor.input_beams)


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
    files = [part / name for part in sorted(parts.glob("part-*"))]
    for file in files:
        check_sum(file, "Run `dvc repro -f evaluate`: it makes damaged parts anew and keeps the others.")
    table = pa.concat_tables([pq.read_table(file) for file in files])
    write_table(target, table)
    return table


if __name__ == "__main__":
    launch("evaluate", evaluate)
