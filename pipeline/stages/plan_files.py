"""The plans of a folder, a file or an archive for the command ``hinterland plan``: each checked, or the error."""

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import chain, count
from pathlib import Path
from typing import NamedTuple

from pipeline.errors import ConfigError, PlanError
from pipeline.floorplans.checked import read_checked
from pipeline.floorplans.checks import Checked, PlanReport
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers import (
    BAD,
    COMPANION,
    PLAN,
    Classified,
    ReadOptions,
    classify,
    nothing_found,
)
from pipeline.floorplans.sources import open_source
from pipeline.stages.parallel import make_all
from pipeline.stages.reading import name_apart

_LONGEST_NAME = 120


class Found(NamedTuple):
    """A plan that may be used. file: what a person calls the file. reader: its format."""

    file: str
    reader: str
    plan: FloorPlan | GridPlan
    report: PlanReport


@contextmanager
def plan_files(root: Path, reader: str | None) -> Iterator[list[Classified]]:
    """Yield the files below ``root`` that hold plans, or should by their names; what was unpacked goes afterwards.

    Raises:
        PlanError: nothing there, no file that fits, no such reader, or ``root`` is a part of another plan.
    """
    with open_source(root) as files:
        found = classify(files, reader)
        entries = [entry for entry in found if entry.role in (PLAN, BAD)]
        if not entries and root.is_file() and [entry.role for entry in found] == [COMPANION]:
            raise PlanError(f"{root}: a part of a plan, not a plan itself: a file beside it uses it. Give that file.")
        if not entries:
            raise PlanError(nothing_found(root, reader, found))
        yield entries


def read_file(entry: Classified, options: ReadOptions) -> Iterator[Found | PlanError]:
    """Yield each plan of a file, checked, or the error that refuses it; raises none itself."""
    for found in read_checked(entry, options):
        if isinstance(found, Checked):
            yield Found(entry.file.name, entry.reader.name if entry.reader else "", *found)
        else:
            yield found


def read_side_by_side(
    entries: Sequence[Classified], options: ReadOptions, *, workers: int | None, shown: bool, limit: int | None = None
) -> list[Found | PlanError]:
    """Return the plans and errors of many files in their order, the first ``limit`` plans; over processes.

    The result does not depend on the number of workers: files are read batch by batch until there are enough plans.
    """
    read: list[Found | PlanError] = []
    left = list(entries)
    while left and (limit is None or limit > _count(read)):
        wanted = len(left) if limit is None else limit - _count(read)
        tasks = [(entry.file.name, (entry, options, wanted if limit is not None else None)) for entry in left[:wanted]]
        batches, _ = make_all(
            _read_some, tasks, on_error="stop", workers=workers or os.cpu_count() or 1, label="files", progress=shown
        )
        for found in (found for batch in batches for found in batch):
            if limit is None or _count(read) < limit:
                read.append(found)
        left = left[wanted:]
    return read


def told_apart(found: Sequence[Found]) -> list[Found]:
    """Return the plans with ids that differ; see `pipeline.stages.reading.name_apart`."""
    checked = name_apart([(each.file, Checked(each.plan, each.report)) for each in found])
    return [each._replace(plan=plan) for each, (plan, _) in zip(found, checked, strict=True)]


def file_name(plan: FloorPlan | GridPlan, ending: str, taken: set[str]) -> str:
    """Return a name for the file of a plan that is not ``taken``, and take it; it leads nowhere, whatever the plan's.

    taken: names without ending, in small letters, since some file systems do not tell them from capitals.
    """
    stem = re.sub(r"[^\w.-]+", "_", plan.plan_id).strip("._")[:_LONGEST_NAME] or "plan"
    numbered = (f"{stem}-{number}" for number in count(2))
    name = next(name for name in chain([stem], numbered) if name.lower() not in taken)
    taken.add(name.lower())
    return f"{name}{ending}"


def keep_existing(targets: Sequence[Path], *, force: bool) -> None:
    """Refuse to overwrite files.

    Raises:
        ConfigError: one of ``targets`` exists, and ``force`` is not given.
    """
    taken = [target for target in targets if target.exists()]
    if taken and not force:
        more = f" (and {len(taken) - 1} more)" if len(taken) > 1 else ""
        raise ConfigError(f"{taken[0]}: exists{more}. Give another name, or --force to overwrite it.")


def _read_some(task: tuple[Classified, ReadOptions, int | None]) -> list[Found | PlanError]:
    """Return what a file holds, up to its ``most``-th plan."""
    entry, options, most = task
    kept: list[Found | PlanError] = []
    for found in read_file(entry, options):
        kept.append(found)
        if most is not None and _count(kept) >= most:
            break
    return kept


def _count(read: Sequence[Found | PlanError]) -> int:
    return sum(isinstance(found, Found) for found in read)
