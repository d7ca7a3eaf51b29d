"""A survey of folders full of plans: what each data set holds, what could not be read and why."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import NamedTuple, TypeAlias

from pipeline.errors import PlanError
from pipeline.floorplans.checked import read_checked
from pipeline.floorplans.manifest import PATTERN
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers import (
    BAD,
    COMPANION,
    PLAN,
    UNRECOGNISED,
    Classified,
    ReadOptions,
    classify,
)
from pipeline.floorplans.sources import is_archive, lone_file, open_source

_MUCH = 0.01  # of a floor, lost


@dataclass(frozen=True, kw_only=True)
class DataSet:
    """How the plans of one data set are to be read: by the named reader or any, and with which options."""

    reader: str | None = None
    options: ReadOptions = field(default_factory=ReadOptions)


@dataclass(frozen=True, kw_only=True)
class SurveyRow:
    """What one data set holds.

    files: all of them, members of archives counted singly. read_files: those that gave at least one plan. companions:
    files that belong to a plan without holding one. unrecognised: names of files that are none of any format.
    plans, floors, buildings: what was read and passed the checks; a floor is counted once for its building.
    warnings: their number over all plans. failures: one line for each file or record that gave no plan. lost: for each
    plan the share of its floor that is lost on cells, where that was measured. losses: a line for each plan that loses
    much.
    """

    name: str
    files: int = 0
    read_files: int = 0
    companions: int = 0
    unrecognised: tuple[str, ...] = ()
    plans: int = 0
    floors: int = 0
    buildings: int = 0
    warnings: int = 0
    failures: tuple[str, ...] = ()
    lost: tuple[float, ...] = ()
    losses: tuple[str, ...] = ()
    seconds: float = 0.0


class FileTally(NamedTuple):
    """What one file holds. floors: building and floor of each plan. failures: one line for each record without one.

    lost, losses: as in `SurveyRow`.
    """

    plans: int
    floors: frozenset[tuple[str, str]]
    warnings: int
    failures: tuple[str, ...]
    lost: tuple[float, ...] = ()
    losses: tuple[str, ...] = ()


class Loss(NamedTuple):
    """The share of the floor of a plan that is lost on cells, and a sentence where that is much, else empty."""

    share: float
    said: str


MeasureLoss: TypeAlias = Callable[[FloorPlan | GridPlan], Loss]
ReadFile: TypeAlias = Callable[[Classified], FileTally]
Spread: TypeAlias = Callable[[ReadFile, Sequence[Classified]], Iterable[FileTally]]
"""How the files are read: ``map`` reads one after the other; the tallies come in the order of the files."""


def survey(root: Path, data_sets: Mapping[str, DataSet] | None = None, *, spread: Spread = map) -> list[SurveyRow]:
    """Return one row for each data set below ``root``, by name: its folders and archives, or ``root`` itself.

    ``root`` itself is the one data set where it is a file, or a folder with a manifest, plan files or no folders.
    data_sets: how to read the data set of a name; others are read by any reader without options.

    Raises:
        PlanError: no such folder or file.
    """
    given = data_sets or {}
    return [survey_one(place, given.get(place.name, DataSet()), spread=spread) for place in data_sets_in(root)]


def data_sets_in(root: Path) -> list[Path]:
    """Return the folders below ``root``, and the archives beside them, that are a data set each; or ``root`` itself."""
    if not root.is_dir():
        return [root]
    entries = sorted(path for path in root.iterdir() if not path.name.startswith("."))
    if not any(path.is_dir() for path in entries) or any(root.glob(PATTERN)) or _holds_plans(root):
        return [root]
    return [path for path in entries if path.is_dir() or is_archive(path)]


def survey_one(root: Path, data_set: DataSet, *, spread: Spread = map, measure: MeasureLoss | None = None) -> SurveyRow:
    """Return what the files below ``root`` hold; ``measure`` says how much of each plan is lost on cells."""
    begun = perf_counter()
    with open_source(root) as files:
        found = classify(files, data_set.reader)
        entries = [entry for entry in found if entry.role in (PLAN, BAD)]
        tallies = list(spread(partial(tally_of, options=data_set.options, measure=measure), entries))
    floors = {floor for tally in tallies for floor in tally.floors}
    return SurveyRow(
        name=root.resolve().name,
        files=len(files),
        read_files=sum(tally.plans > 0 for tally in tallies),
        companions=sum(entry.role == COMPANION for entry in found),
        unrecognised=tuple(entry.file.name for entry in found if entry.role == UNRECOGNISED),
        plans=sum(tally.plans for tally in tallies),
        floors=len(floors),
        buildings=len({building for building, _ in floors}),
        warnings=sum(tally.warnings for tally in tallies),
        failures=tuple(failure for tally in tallies for failure in tally.failures),
        lost=tuple(share for tally in tallies for share in tally.lost),
        losses=tuple(said for tally in tallies for said in tally.losses),
        seconds=perf_counter() - begun,
    )


def tally_of(entry: Classified, options: ReadOptions, measure: MeasureLoss | None = None) -> FileTally:
    """Read and check one file and count what it holds; no plan is kept and no PlanError leaves it."""
    plans, warnings = 0, 0
    floors: set[tuple[str, str]] = set()
    failures: list[str] = []
    losses: list[Loss] = []
    for found in read_checked(entry, options):
        if isinstance(found, PlanError):
            failures.append(" ".join(str(found).split()))
            continue
        plans += 1
        warnings += len(found.report.warnings)
        floors.add((found.plan.building, found.plan.floor))
        if measure is not None:
            losses.append(measure(found.plan))
    said = tuple(loss.said for loss in losses if loss.said)
    return FileTally(plans, frozenset(floors), warnings, tuple(failures), tuple(loss.share for loss in losses), said)


def survey_table(rows: Sequence[SurveyRow]) -> str:
    """Return the rows as text, a line for each data set and one for all, below it the failures."""
    head: tuple[str, ...] = ("data set", "files", "read", "companions", "no plan", "plans", "floors", "buildings",
                             "warnings", "failures", "seconds")  # fmt: skip
    counts = [(row.files, row.read_files, row.companions, len(row.unrecognised), row.plans, row.floors, row.buildings,
               row.warnings, len(row.failures), round(row.seconds, 1)) for row in rows]  # fmt: skip
    total = [round(sum(column), 1) for column in zip(*counts, strict=True)] or [0] * (len(head) - 1)
    lines = [head, *((row.name, *map(str, cells)) for row, cells in zip(rows, counts, strict=True))]
    lines.append(("all", *map(str, total)))
    if any(row.lost for row in rows):
        every = [share for row in rows for share in row.lost]
        lost = [_said_lost(shares) for shares in (*(row.lost for row in rows), every)]
        head_of_lost = ("lost median", "most", "above 1 %")
        lines = [(*line, *more) for line, more in zip(lines, [head_of_lost, *lost], strict=True)]
    widths = [max(len(line[k]) for line in lines) for k in range(len(lines[0]))]
    text = ["  ".join(cell.ljust(width) if k == 0 else cell.rjust(width)
                      for k, (cell, width) in enumerate(zip(line, widths, strict=True))) for line in lines]  # fmt: skip
    told = [f"{row.name}: {said}" for row in rows for said in (*row.failures, *row.losses)]
    return "\n".join([*text, *told])


def _said_lost(shares: Sequence[float]) -> tuple[str, str, str]:
    if not shares:
        return "-", "-", "-"
    return f"{median(shares):.2%}", f"{max(shares):.2%}", str(sum(share > _MUCH for share in shares))


def _holds_plans(folder: Path) -> bool:
    files = [lone_file(path) for path in sorted(folder.iterdir()) if path.is_file()]
    return any(entry.role == PLAN for entry in classify(files))
