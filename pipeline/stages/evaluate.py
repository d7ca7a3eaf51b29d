"""Evaluate: every competitor on the same trials, in units of work; then the summary, and drives worth a look."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from omegaconf import DictConfig

from pipeline.errors import PartError
from pipeline.evaluation.competitors import Competitor, Outcome, make_roster
from pipeline.evaluation.cost_table import format_cost_table
from pipeline.evaluation.settings import EvaluateSettings
from pipeline.evaluation.summary import flat_metrics, summarise
from pipeline.evaluation.telling import telling_trials
from pipeline.evaluation.trials import EpisodeRow, Replay, TrialRow, episodes_table, trial_rows, trials_table
from pipeline.files import check_sum, digest_file, write_json, write_table
from pipeline.grids.blocks import PairBlock, pairs_in_blocks
from pipeline.grids.distances import NOWHERE
from pipeline.grids.occupancy import Point, center_of
from pipeline.grids.store import Pair, grid_resolution
from pipeline.parts import named, resolve
from pipeline.planning.seen import NO_GOAL
from pipeline.randomness import stream
from pipeline.settings import RobotConfig
from pipeline.simulation.ground import Ground
from pipeline.source_code import digest_part
from pipeline.stages.door import StageResult, Workspace, launch, workspace
from pipeline.stages.jobs import fingerprint_of, job_of, nothing_to_do, system_of
from pipeline.stages.networks import SETTING, with_local_networks
from pipeline.stages.units import run_units
from pipeline.systems.system import Contest, Entrant, Job, System

SECTIONS = ("evaluate", "sensor", "robot", "planner")
CODE = ("stages/evaluate.py", "evaluation", "grids", "learning", "planning", "randomness.py", "simulation")


@dataclass(frozen=True, kw_only=True)
class _Field:
    """All that a worker needs to let everybody drive."""

    contest: str
    roster: Sequence[Competitor]
    job: Job

    def entrants(self) -> Iterator[tuple[Competitor, Entrant]]:
        """Yield the competitors, each with what this process makes of it."""
        contest: Contest = resolve(self.contest)
        for competitor in self.roster:
            part, settings = contest.part_of(competitor)
            with named(part):
                entrant = contest.enter(competitor, part, settings, self.job)
            yield competitor, entrant


def evaluate(raw: DictConfig) -> StageResult:
    """Write trials, side tables, episodes and their summary to ``artifacts/evaluate``."""
    work, system = workspace(raw), system_of(raw)
    target = work.folder("evaluate")
    if system.contest is None:
        return nothing_to_do("evaluate", target, f"{system.title} compares nobody")
    job = job_of(raw, system, work, SECTIONS)
    job = replace(job, resolution_m=grid_resolution(work.folder("rasterize")))
    config = with_local_networks(job.section("evaluate", EvaluateSettings), raw, target / "networks")
    job = replace(job, sections={**job.sections, "evaluate": config})
    field = _Field(contest=system.contest, roster=make_roster(config.competitors), job=job)
    contest: Contest = resolve(system.contest)
    entrants = list(field.entrants())
    remarks = _remarks(entrants)
    for remark in remarks:
        print(f"warning: {remark}", file=sys.stderr)
    fingerprint = _fingerprint(work, system, field, contest, entrants)
    blocks = pairs_in_blocks(
        work.folder("rasterize"),
        config.split,
        config.pairs_per_unit,
        robot_radius_m=job.section("robot", RobotConfig).radius_m,
        otherwise="change evaluate.split",
    )
    names = ("trials", *contest.tables)
    parts = target / "parts"
    _run(work, partial(_drive_block, field=field), blocks, parts, fingerprint, "evaluate")
    merged = {name: _merge(parts, name, target / f"{name}.parquet") for name in names}
    _record(work, field, blocks, merged["trials"], fingerprint)
    summary = summarise(
        merged["trials"],
        work.seed,
        measures=contest.measure(merged),
        ransac_threshold_m=config.ransac_threshold_m,
        remarks=remarks,
        made_with=_of_each(entrants, "made_with"),
        weights=_of_each(entrants, "weights"),
    )
    write_json(target / "summary.json", summary)
    print(format_cost_table(summary))
    return StageResult(
        metrics=flat_metrics(summary),
        files=[target / "summary.json"],
        datasets={"trials": (target / "trials.parquet", summary["digest"])},
    )


def _remarks(entrants: Sequence[tuple[Competitor, Entrant]]) -> list[str]:
    """Return what the reader of the numbers has to know of those who drive."""
    remarks: list[str] = []
    for competitor, entrant in entrants:
        remarks += [f"{competitor.title}: {remark}" for remark in getattr(entrant, "remarks", ())]
    return list(dict.fromkeys(remarks))


def _fingerprint(
    work: Workspace, system: System, field: _Field, contest: Contest, entrants: Sequence[tuple[Competitor, Entrant]]
) -> dict[str, Any]:
    own = {entry.name: digest_part(contest.part_of(entry)[0].make) for entry in field.roster if ":" in entry.use}
    base = fingerprint_of(field.job, system, work.folder("rasterize"), CODE)
    for name in ("recorded_trials", "ransac_threshold_m"):  # they change no drive
        del base["evaluate"][name]
    _by_content(base["evaluate"])
    return base | {"own": own, "reads": _of_each(entrants, "reads")}


def _by_content(evaluate: dict[str, Any]) -> None:
    """Put the digest of each network in place of its path: moved weights make the same trials, others new ones."""
    for holder in (evaluate, *(entry["settings"] for entry in evaluate["competitors"].values())):
        if isinstance(holder.get(SETTING), str):
            holder[SETTING] = digest_file(Path(holder[SETTING]))


def _of_each(entrants: Sequence[tuple[Competitor, Entrant]], name: str) -> dict[str, Any]:
    """Return the attribute ``name`` of those entrants that have it, by the name of the competitor."""
    return {entry.name: found for entry, made in entrants if (found := getattr(made, name, None))}


def _run(
    work: Workspace, make: Any, blocks: Sequence[PairBlock], folder: Path, fingerprint: dict[str, Any], label: str
) -> None:
    run_units(
        [(folder / f"part-{index:06d}", block) for index, block in enumerate(blocks)],
        make,
        folder,
        fingerprint,
        workers=work.workers,
        label=label,
        progress=work.progress,
    )


def _drive_block(scratch: Path, block: PairBlock, *, field: _Field) -> None:
    contest: Contest = resolve(field.contest)
    trials: list[TrialRow] = []
    side: dict[str, list[Any]] = {name: [] for name in contest.tables}
    for pair, ground, competitor, outcome in _outcomes(block, field):
        trials.append(_trial_row(pair, ground, competitor, outcome))
        for name, rows in outcome.side.items():
            side[name] += rows
    write_table(scratch / "trials.parquet", trials_table(trials))
    for name, table in contest.tables.items():
        write_table(scratch / f"{name}.parquet", table(side[name]))


def _record(
    work: Workspace, field: _Field, blocks: Sequence[PairBlock], trials: pa.Table, fingerprint: dict[str, Any]
) -> None:
    """Drive the trials worth a look once more, and keep what a picture needs: a drive follows from its seed."""
    wanted = set(telling_trials(trials, field.job.section("evaluate", EvaluateSettings).recorded_trials))
    chosen = [
        PairBlock([pair], {pair.plan_id: block.worlds[pair.plan_id]})
        for block in blocks
        for pair in block.pairs
        if pair.pair_id in wanted
    ]
    folder, target = work.folder("evaluate") / "records", work.folder("evaluate") / "episodes.parquet"
    costs = {(row.trial_id, row.competitor): row.cost_m for row in trial_rows(trials)}
    make = partial(_record_block, field=field, costs=costs)
    _run(work, make, chosen, folder, fingerprint | {"recorded": sorted(wanted)}, "record")
    if chosen:
        _merge(folder, "episodes", target)
    else:
        write_table(target, episodes_table([]))


def _record_block(scratch: Path, block: PairBlock, *, field: _Field, costs: Mapping[tuple[str, str], float]) -> None:
    rows = []
    for pair, ground, competitor, outcome in _outcomes(block, field):
        before = costs[pair.pair_id, competitor.name]
        if outcome.cost_m != before:
            raise PartError(
                f"{competitor.key}: trial {pair.pair_id!r} cost {before} m and, driven again from its seed, "
                f"{outcome.cost_m} m: these must be equal. What drives is not deterministic."
            )
        if isinstance(outcome.replay, Replay):
            rows.append(_episode_row(pair, ground, competitor, outcome, outcome.replay))
    write_table(scratch / "episodes.parquet", episodes_table(rows))


def _outcomes(block: PairBlock, field: _Field) -> Iterator[tuple[Pair, Ground, Competitor, Outcome]]:
    """Let everybody drive every pair of ``block``; the noise of sensors is the same for all on one trial."""
    grounds: Mapping[str, Ground] = {name: Ground(packed.unpack()) for name, packed in block.worlds.items()}
    entrants, goals = list(field.entrants()), resolve(field.contest).goals
    for pair in block.pairs if goals else [pair._replace(goal=NO_GOAL) for pair in block.pairs]:
        for competitor, entrant in entrants:
            rng = stream(field.job.seed, "evaluate", pair.pair_id)
            with named(f"{competitor.key}.use = {competitor.use}, trial {pair.pair_id}"):
                outcome = entrant.drive(grounds[pair.plan_id], pair, rng)
            yield pair, grounds[pair.plan_id], competitor, outcome


def _trial_row(pair: Pair, ground: Ground, competitor: Competitor, outcome: Outcome) -> TrialRow:
    start = center_of(ground.record.grid, pair.start)
    goal = Point(nan, nan) if pair.goal == NO_GOAL else center_of(ground.record.grid, pair.goal)
    return TrialRow(
        pair.pair_id, pair.plan_id, pair.building, pair.environment, pair.split,
        competitor.name, str(competitor.role), competitor.title, competitor.place,
        outcome.cost_m, outcome.ending, outcome.steps, outcome.decisions, outcome.seconds,
        start.x, start.y, goal.x, goal.y,
    )  # fmt: skip


def _episode_row(pair: Pair, ground: Ground, competitor: Competitor, outcome: Outcome, replay: Replay) -> EpisodeRow:
    grid = ground.record.grid
    cols = grid.cells.shape[1]
    path_row, path_col = np.divmod(replay.path, cols)
    sizes = np.array([mark.cells.size for mark in replay.marks], dtype=np.int64)
    cells = np.concatenate([mark.cells for mark in replay.marks]) if sizes.size else NOWHERE
    return EpisodeRow(
        trial_id=pair.pair_id,
        competitor=competitor.name,
        plan_id=pair.plan_id,
        resolution_m=grid.resolution,
        origin_x_m=grid.origin.x,
        origin_y_m=grid.origin.y,
        truth=grid.cells,
        known=replay.known,
        path_row=path_row,
        path_col=path_col,
        frontier_step=np.repeat(np.array([mark.step for mark in replay.marks], dtype=np.int64), sizes),
        frontier_row=cells // cols,
        frontier_col=cells % cols,
        frontier_p=np.repeat(np.array([mark.value for mark in replay.marks], dtype=np.float64), sizes),
        cost_m=outcome.cost_m,
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
