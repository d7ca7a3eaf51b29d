"""The tables that the evaluate stage leaves behind: trials, estimates, episodes (version 1).

A trial is one start-goal pair on one plan; every planner drives it under the same ``trial_id``, so costs are
compared in pairs. The records here have exactly the columns of their tables.
"""

import zlib
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from pipeline.errors import TableError
from pipeline.evaluation.tables import build_table, digest_of
from pipeline.files import write_table
from pipeline.grids.occupancy import Cells
from pipeline.tables import column, read_table, table_schema

VERSION = 1
BASELINE = "optimistic"
LEARNED = "learned"
# They use the true map, which no robot has: reported beneath a rule, never ranked.
BOUNDS = ("perfect", "known_map")
PLANNERS = (BASELINE, LEARNED, *BOUNDS)

REACHED = "reached"
ENDINGS = {
    REACHED: "reached the goal",
    "unreachable": "no frontier left: the goal cannot be reached",
    "cut_off": "step limit: the cost is only a lower bound, so no ratio is formed",
}


class TrialRow(NamedTuple):
    """How one planner fared on one trial.

    planner: one of PLANNERS, or the name of a later system.
    cost_m: distance really travelled [m]; for known_map the shortest distance in the true map.
    ending: a key of ENDINGS.
    steps: scans taken; decisions: times the planner chose anew; seconds: the robot's own time [s], see Episode.
    start and goal: world frame [m].
    """

    trial_id: str
    plan_id: str
    building: str
    environment: str
    split: str
    planner: str
    cost_m: float
    ending: str
    steps: int
    decisions: int
    seconds: float
    start_x_m: float
    start_y_m: float
    goal_x_m: float
    goal_y_m: float


class EstimateRow(NamedTuple):
    """What the network said about one subgoal on a learned drive, beside the truth.

    true_delta_success_m is None unless the subgoal leads to the goal, true_exploration_m is None if it does.
    weight_m: misclassification cost [m].
    """

    trial_id: str
    step: int
    p_success: float
    delta_success_m: float
    exploration_m: float
    leads_to_goal: bool
    true_delta_success_m: float | None
    true_exploration_m: float | None
    weight_m: float


class EpisodeRow(NamedTuple):
    """One recorded drive, enough to draw it.

    truth: [rows, cols] uint8, the true map; known: [rows, cols] uint8, what the robot knew at the end; row 0 is the
    lowest y. origin: outer corner of cell [0, 0], world frame [m]. path_row, path_col: [n] cells passed, in order.
    frontier_step, _row, _col, _p: [m] one entry per frontier cell at each estimate (step, cell, P_S); empty for
    planners that do not estimate.
    """

    trial_id: str
    planner: str
    plan_id: str
    resolution_m: float
    origin_x_m: float
    origin_y_m: float
    truth: Cells
    known: Cells
    path_row: Sequence[int] | NDArray[np.integer[Any]]
    path_col: Sequence[int] | NDArray[np.integer[Any]]
    frontier_step: Sequence[int] | NDArray[np.integer[Any]]
    frontier_row: Sequence[int] | NDArray[np.integer[Any]]
    frontier_col: Sequence[int] | NDArray[np.integer[Any]]
    frontier_p: Sequence[float] | NDArray[np.floating[Any]]
    cost_m: float
    start_row: int
    start_col: int
    goal_row: int
    goal_col: int


_text, _int, _real, _single = pa.string(), pa.int32(), pa.float64(), pa.float32()

TRIALS = table_schema(
    "trials",
    VERSION,
    [
        *(column(name, _text) for name in ("trial_id", "plan_id", "building", "environment", "split", "planner")),
        column("cost_m", _real, unit="m"),
        column("ending", _text),
        column("steps", _int),
        column("decisions", _int),
        column("seconds", _real, unit="s"),
        *(column(f"{end}_{axis}_m", _real, unit="m", frame="world") for end in ("start", "goal") for axis in "xy"),
    ],
)
ESTIMATES = table_schema(
    "estimates",
    VERSION,
    [
        column("trial_id", _text),
        column("step", _int),
        column("p_success", _single),
        column("delta_success_m", _single, unit="m"),
        column("exploration_m", _single, unit="m"),
        column("leads_to_goal", pa.bool_()),
        column("true_delta_success_m", _single, unit="m", optional=True),
        column("true_exploration_m", _single, unit="m", optional=True),
        column("weight_m", _single, unit="m"),
    ],
)
EPISODES = table_schema(
    "episodes",
    VERSION,
    [
        *(column(name, _text) for name in ("trial_id", "planner", "plan_id")),
        *(column(name, _int, unit="cell") for name in ("rows", "cols")),
        column("resolution_m", _real, unit="m/cell"),
        *(column(name, _real, unit="m", frame="world") for name in ("origin_x_m", "origin_y_m")),
        *(column(name, pa.binary(), frame="grid") for name in ("truth", "known")),
        *(column(name, pa.list_(_int), unit="cell", frame="grid") for name in ("path_row", "path_col")),
        column("frontier_step", pa.list_(_int)),
        *(column(name, pa.list_(_int), unit="cell", frame="grid") for name in ("frontier_row", "frontier_col")),
        column("frontier_p", pa.list_(_single)),
        column("cost_m", _real, unit="m"),
        *(column(name, _int, unit="cell", frame="grid") for name in ("start_row", "start_col", "goal_row", "goal_col")),
    ],
)


def trials_table(rows: Iterable[TrialRow]) -> pa.Table:
    """Return ``rows`` as a checked table, sorted by trial and planner so that the order of work leaves no trace.

    Raises TableError for a row twice, an unknown ending, or a cost that is no distance.
    """
    ordered = sorted(rows, key=lambda row: (row.trial_id, row.planner))
    for before, after in pairwise(ordered):
        if before.trial_id == after.trial_id and before.planner == after.planner:
            raise TableError(
                f"trials: trial {after.trial_id!r} of planner {after.planner!r} comes twice, expected once."
            )
    for row in ordered:
        if row.ending not in ENDINGS:
            raise TableError(f"trials: {row.trial_id!r} ended {row.ending!r}, expected one of {sorted(ENDINGS)}.")
        if not (np.isfinite(row.cost_m) and row.cost_m >= 0):
            raise TableError(
                f"trials: {row.trial_id!r} of planner {row.planner!r} costs {row.cost_m} m, expected a finite "
                f"distance of at least 0: record what was travelled up to the ending."
            )
    return build_table(_columns(TrialRow._fields, ordered), TRIALS)


def estimates_table(rows: Iterable[EstimateRow]) -> pa.Table:
    """Return ``rows`` as a table in the given order. Raises TableError for a probability outside [0, 1]."""
    listed = list(rows)
    for row in listed:
        if not 0.0 <= row.p_success <= 1.0:
            raise TableError(
                f"estimates: trial {row.trial_id!r}, step {row.step} has P_S = {row.p_success}, expected 0 to 1."
            )
    return build_table(_columns(EstimateRow._fields, listed), ESTIMATES)


def episodes_table(rows: Iterable[EpisodeRow]) -> pa.Table:
    """Return ``rows`` as a table, maps compressed. Raises TableError where the two maps differ in shape."""
    listed = list(rows)
    for row in listed:
        if row.truth.ndim != 2 or row.truth.shape != row.known.shape:
            raise TableError(
                f"episodes: trial {row.trial_id!r} has the maps truth {row.truth.shape} and known "
                f"{row.known.shape}, expected one shape [rows, cols]."
            )
    columns = _columns(EpisodeRow._fields, listed)
    columns["rows"] = [row.truth.shape[0] for row in listed]
    columns["cols"] = [row.truth.shape[1] for row in listed]
    for name in ("truth", "known"):
        columns[name] = [_packed(getattr(row, name)) for row in listed]
    return build_table(columns, EPISODES)


def write_trials(path: Path, rows: Iterable[TrialRow]) -> pa.Table:
    """Write the trial table atomically and return it."""
    return _stored(path, trials_table(rows))


def write_estimates(path: Path, rows: Iterable[EstimateRow]) -> pa.Table:
    """Write the estimate table atomically and return it."""
    return _stored(path, estimates_table(rows))


def write_episodes(path: Path, rows: Iterable[EpisodeRow]) -> pa.Table:
    """Write the episode table atomically and return it."""
    return _stored(path, episodes_table(rows))


def read_trials(path: Path) -> pa.Table:
    """Read a trial table. Raises TableError for a missing or damaged file or another version."""
    return read_table(path, TRIALS, stage="evaluate")


def read_estimates(path: Path) -> pa.Table:
    """Read an estimate table. Raises TableError like read_trials."""
    return read_table(path, ESTIMATES, stage="evaluate")


def read_episodes(path: Path) -> list[EpisodeRow]:
    """Read recorded drives, maps unpacked. Raises TableError like read_trials, and for a damaged map."""
    table = read_table(path, EPISODES, stage="evaluate")
    return [_episode(path, raw) for raw in table.to_pylist()]


def trial_rows(table: pa.Table) -> list[TrialRow]:
    """Return the rows of a trial table as records."""
    return [TrialRow(**raw) for raw in table.to_pylist()]


def empty_estimates() -> pa.Table:
    """Return an estimate table without rows, for runs that recorded none."""
    return ESTIMATES.empty_table()


def digest(table: pa.Table) -> str:
    """Return the SHA-256 of a table's content without ``seconds``, the one column that differs between equal runs."""
    return digest_of(table, without=("seconds",))


def planners_in(trials: pa.Table) -> list[str]:
    """Return the planners of a trial table: baseline, learned, other systems by name, then the bounds."""
    present = set(pc.unique(trials.column("planner")).to_pylist())
    others = sorted(present - set(PLANNERS))
    return [name for name in (BASELINE, LEARNED, *others, *BOUNDS) if name in present]


def _columns(names: Sequence[str], rows: Sequence[tuple[Any, ...]]) -> dict[str, list[Any]]:
    return {name: [row[index] for row in rows] for index, name in enumerate(names)}


def _stored(path: Path, table: pa.Table) -> pa.Table:
    write_table(path, table)
    return table


def _packed(cells: Cells) -> bytes:
    return zlib.compress(np.ascontiguousarray(cells, dtype=np.uint8).tobytes(), level=6)


def _episode(path: Path, raw: dict[str, Any]) -> EpisodeRow:
    rows, cols = raw.pop("rows"), raw.pop("cols")
    for name in ("truth", "known"):
        try:
            raw[name] = np.frombuffer(zlib.decompress(raw[name]), dtype=np.uint8).reshape(rows, cols)
        except (zlib.error, ValueError) as error:
            raise TableError(
                f"{path}: the map {name!r} of trial {raw['trial_id']!r} is not {rows} x {cols} compressed cells "
                f"({error}): run `dvc repro -f evaluate`."
            ) from error
    for name in ("path_row", "path_col", "frontier_step", "frontier_row", "frontier_col"):
        raw[name] = np.asarray(raw[name], dtype=np.int32)
    raw["frontier_p"] = np.asarray(raw["frontier_p"], dtype=np.float32)
    return EpisodeRow(**raw)
