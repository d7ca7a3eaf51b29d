"""The tables that every evaluation leaves behind: trials and episodes (version 2).

A trial is one start-goal pair, or one start, on one plan; every competitor meets it under the same ``trial_id``, so
costs are compared in pairs. The records here have exactly the columns of their tables. What only one system knows of a
trial stands in a side table of its own, keyed by trial and competitor.
"""

import zlib
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipeline.errors import TableError
from pipeline.evaluation.competitors import Role
from pipeline.grids.occupancy import Cells
from pipeline.tables import Table, column, digest_of

VERSION = 2

REACHED, COVERED = "reached", "covered"
ENDINGS = {
    REACHED: "reached the goal",
    COVERED: "saw all that can be reached",
    "unreachable": "no frontier left: the goal cannot be reached",
    "cut_off": "step limit: the cost is only a lower bound, so no ratio is formed",
}
FINISHED = (REACHED, COVERED)
"""Endings after which a cost is a cost; after any other it is only a lower bound."""


class Mark(NamedTuple):
    """What a competitor thought of some cells at one step, for pictures: flat cells [k] and a number in [0, 1]."""

    step: int
    cells: NDArray[np.int32]
    value: float


class Replay(NamedTuple):
    """One drive, enough to draw it over the true map.

    known: [rows, cols] uint8, what the robot knew at the end. path: [k] int32 flat cells passed, in order.
    """

    known: Cells
    path: NDArray[np.int32]
    marks: Sequence[Mark] = ()


class TrialRow(NamedTuple):
    """How one competitor fared on one trial.

    competitor, role, title, place: as in `pipeline.evaluation.competitors.Competitor`.
    cost_m: what is compared, usually the distance really travelled [m]. ending: a key of ENDINGS.
    steps: observations; decisions: times it chose anew; seconds: its own time [s], see Episode.
    start and goal: world frame [m]; the goal is NaN where there is none.
    """

    trial_id: str
    plan_id: str
    building: str
    environment: str
    split: str
    competitor: str
    role: str
    title: str
    place: int
    cost_m: float
    ending: str
    steps: int
    decisions: int
    seconds: float
    start_x_m: float
    start_y_m: float
    goal_x_m: float
    goal_y_m: float


class EpisodeRow(NamedTuple):
    """One recorded drive with its true map.

    truth: [rows, cols] uint8, the true map; known: [rows, cols] uint8, what the robot knew at the end; row 0 is the
    lowest y. origin: outer corner of cell [0, 0], world frame [m]. path_row, path_col: [n] cells passed, in order.
    frontier_step, _row, _col, _p: [m] one entry per marked cell (step, cell, number in [0, 1]), such as a frontier's
    P_S; empty for competitors that mark none. goal_row, goal_col: -1 where there is no goal.
    """

    trial_id: str
    competitor: str
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

TRIALS = Table(
    "trials",
    VERSION,
    [
        *(column(name, _text) for name in ("trial_id", "plan_id", "building", "environment", "split")),
        *(column(name, _text) for name in ("competitor", "role", "title")),
        column("place", _int),
        column("cost_m", _real, unit="m"),
        column("ending", _text),
        column("steps", _int),
        column("decisions", _int),
        column("seconds", _real, unit="s"),
        *(column(f"{end}_{axis}_m", _real, unit="m", frame="world") for end in ("start", "goal") for axis in "xy"),
    ],
    stage="evaluate",
)
EPISODES = Table(
    "episodes",
    VERSION,
    [
        *(column(name, _text) for name in ("trial_id", "competitor", "plan_id")),
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
    stage="evaluate",
)


def trials_table(rows: Iterable[TrialRow]) -> pa.Table:
    """Return ``rows`` as a checked table, sorted by trial and competitor so that the order of work leaves no trace.

    Raises TableError for a row twice, an unknown ending, or a cost that is no distance.
    """
    ordered = sorted(rows, key=lambda row: (row.trial_id, row.competitor))
    for before, after in pairwise(ordered):
        if before.trial_id == after.trial_id and before.competitor == after.competitor:
            raise TableError(
                f"trials: trial {after.trial_id!r} of competitor {after.competitor!r} comes twice, expected once."
            )
    for row in ordered:
        if row.ending not in ENDINGS:
            raise TableError(f"trials: {row.trial_id!r} ended {row.ending!r}, expected one of {sorted(ENDINGS)}.")
        if not (np.isfinite(row.cost_m) and row.cost_m >= 0):
            raise TableError(
                f"trials: {row.trial_id!r} of competitor {row.competitor!r} costs {row.cost_m} m, expected a finite "
                f"distance of at least 0: record what was travelled up to the ending."
            )
    return TRIALS.stack(ordered)


def episodes_table(rows: Iterable[EpisodeRow]) -> pa.Table:
    """Return ``rows`` as a table, maps compressed. Raises TableError where the two maps differ in shape."""
    listed = list(rows)
    for row in listed:
        if row.truth.ndim != 2 or row.truth.shape != row.known.shape:
            raise TableError(
                f"episodes: trial {row.trial_id!r} has the maps truth {row.truth.shape} and known "
                f"{row.known.shape}, expected one shape [rows, cols]."
            )
    columns: dict[str, list[Any]] = {
        name: [row[index] for row in listed] for index, name in enumerate(EpisodeRow._fields)
    }
    columns["rows"] = [row.truth.shape[0] for row in listed]
    columns["cols"] = [row.truth.shape[1] for row in listed]
    for name in ("truth", "known"):
        columns[name] = [_packed(getattr(row, name)) for row in listed]
    return EPISODES.of(columns)


def write_trials(path: Path, rows: Iterable[TrialRow]) -> pa.Table:
    """Write the trial table atomically and return it."""
    return TRIALS.write(path, trials_table(rows))


def write_episodes(path: Path, rows: Iterable[EpisodeRow]) -> pa.Table:
    """Write the episode table atomically and return it."""
    return EPISODES.write(path, episodes_table(rows))


def read_trials(path: Path) -> pa.Table:
    """Read a trial table. Raises TableError for a missing or damaged file or another version."""
    return TRIALS.read(path)


def read_episodes(path: Path) -> list[EpisodeRow]:
    """Read recorded drives, maps unpacked. Raises TableError like read_trials, and for a damaged map."""
    table = EPISODES.read(path)
    return [_episode(path, raw) for raw in table.to_pylist()]


def trial_rows(table: pa.Table) -> list[TrialRow]:
    """Return the rows of a trial table as records."""
    return [TrialRow(**raw) for raw in table.to_pylist()]


def digest(table: pa.Table) -> str:
    """Return the SHA-256 of a table's content without ``seconds``, the one column that differs between equal runs."""
    return digest_of(table, without=("seconds",))


class Entry(NamedTuple):
    """A competitor as a trial table knows it."""

    name: str
    role: str
    title: str


def competitors_in(trials: pa.Table) -> list[Entry]:
    """Return the competitors of a trial table in the order in which tables and figures show them.

    Raises:
        TableError: there is not exactly one in the role baseline.
    """
    keys = trials.select(["place", "competitor", "role", "title"])
    found = sorted(set(zip(*(keys.column(name).to_pylist() for name in keys.schema.names), strict=True)))
    entries = [Entry(*rest) for _, *rest in found]
    baselines = [entry.name for entry in entries if entry.role == Role.baseline]
    if entries and len(baselines) != 1:
        raise TableError(f"trials: the competitors in the role baseline are {baselines}, expected exactly one.")
    return entries


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
