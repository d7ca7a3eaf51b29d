"""``hinterland plan convert``: plans of any format, written in another one."""

import os
import sys
import tempfile
from argparse import Namespace
from pathlib import Path
from typing import NamedTuple

from pipeline.errors import ConfigError, PlanError
from pipeline.floorplans.openings import NARROWEST_DOOR_M
from pipeline.floorplans.plan import FloorPlan, GridPlan, Location
from pipeline.floorplans.writers import WRITERS
from pipeline.floorplans.writers.writer import Writer
from pipeline.grids.rasterize import CELLS_PER_DOOR, rasterize
from pipeline.stages.plan_files import Found, file_name, keep_existing, plan_files, read_file, told_apart
from pipeline.stages.plan_options import in_flags, read_options
from pipeline.stages.reading import unused_in

_RESOLUTION_M = 0.05


class _Output(NamedTuple):
    """Where plans go. folder: the files lie in it. name: of the only file, None where plans name their own."""

    folder: Path
    name: str | None


def convert(given: Namespace) -> int:
    """Read and check all plans, write them aside, and only then put the files in place.

    Raises:
        PlanError, ConfigError: a plan cannot be used or written, no such format, or a file that is there already.
    """
    out = Path(given.out)
    writer = writer_for(out, given.to)
    found = _read(given)
    output = _output(out, writer, len(found))
    plans = [_in_form(each, writer, given.resolution) for each in found]
    output.folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".hinterland-", dir=output.folder.parent) as scratch:
        taken: set[str] = set()
        written: list[Path] = []
        for plan in plans:
            name = output.name or file_name(plan, writer.ending, taken)
            written += writer.write(plan, Path(scratch) / name)
        targets = [output.folder / path.name for path in written]
        keep_existing(targets, force=given.force)
        output.folder.mkdir(parents=True, exist_ok=True)
        for path, target in zip(written, targets, strict=True):
            os.replace(path, target)
    plural = "plan" if len(plans) == 1 else "plans"
    print(f"{len(plans)} {plural} as {writer.name}: {', '.join(map(str, targets[:4]))}{', ...' if targets[4:] else ''}")
    return 0


def writer_for(out: Path, name: str | None) -> Writer:
    """Return the writer of a format, or of the ending of ``out`` where none is named.

    Raises:
        ConfigError: there is none.
    """
    if name is not None:
        if name not in WRITERS:
            raise ConfigError(f"--to {name}: no such format. Choose one of {', '.join(WRITERS)}.")
        return WRITERS[name]
    fitting = [writer for writer in WRITERS.values() if writer.ending == out.suffix.lower()]
    if not fitting:
        endings = ", ".join(f"{writer.name} ({writer.ending})" for writer in WRITERS.values())
        raise ConfigError(f"{out}: its ending names no format. Say which with --to: {endings}.")
    return fitting[0]


def _read(given: Namespace) -> list[Found]:
    options = read_options(given)
    with plan_files(Path(given.source), given.reader) as entries:
        read = [found for entry in entries for found in read_file(entry, options)]
        unused = unused_in(entries, options)
    problems = [each for each in read if isinstance(each, PlanError)]
    found = [each for each in read if isinstance(each, Found)]
    if problems and (not given.skip_bad or not found):
        raise problems[0]
    for sentence in unused:
        print(in_flags(sentence), file=sys.stderr)
    for problem in problems:
        print(f"left out: {in_flags(str(problem))}", file=sys.stderr)
    for each in found:
        for warning in each.report.warnings:
            print(f"{each.plan.plan_id}: {in_flags(warning)}", file=sys.stderr)
    return told_apart(found)


def _output(out: Path, writer: Writer, count: int) -> _Output:
    """Return where to write: a name with the ending of the format is a file, any other a folder."""
    is_file = out.suffix.lower() == writer.ending and not out.is_dir()
    if not is_file and out.exists() and not out.is_dir():
        raise ConfigError(f"{out}: a file, expected a folder or a name that ends in {writer.ending}.")
    if is_file and count > 1:
        raise ConfigError(
            f"{out}: {count} plans do not fit into one file. Name a folder and say --to {writer.name}, or choose with "
            "--level."
        )
    return _Output(out.parent, out.name) if is_file else _Output(out, None)


def _in_form(found: Found, writer: Writer, resolution: float | None) -> FloorPlan | GridPlan:
    """Return the plan as it is to be written: in cells where that is asked for or the format has only those."""
    plan, narrowest = found.plan, found.report.narrowest_door_m
    if isinstance(plan, FloorPlan):
        if not writer.needs_cells and resolution is None:
            return plan
        if resolution is None:
            resolution = _RESOLUTION_M
            print(f"{plan.plan_id}: drawn as cells of {resolution:g} m; --resolution changes that", file=sys.stderr)
    elif resolution is None or resolution == plan.resolution:
        return plan
    grid = in_cells(plan, resolution)
    if narrowest is not None and resolution > narrowest / CELLS_PER_DOOR + 1e-9:
        print(
            f"{plan.plan_id}: cells of {resolution:g} m may close its narrowest opening, {narrowest:.2f} m; at most "
            f"{narrowest / CELLS_PER_DOOR:.2f} surely keeps it open",
            file=sys.stderr,
        )
    return grid


def in_cells(plan: FloorPlan | GridPlan, resolution: float) -> GridPlan:
    """Return the plan as cells of ``resolution`` [m], as `pipeline.grids.rasterize` makes them, in the same frame.

    Marked doors that people pass stay open. Doors and endpoints stay; rooms and layers do not.

    Raises:
        PlanError, ConfigError: see `rasterize`.
    """
    grid = rasterize(plan, resolution, doors_from_m=NARROWEST_DOOR_M)
    told = ("plan_id", "building", "floor", "environment", "source", "split", "doors", "endpoints", "remarks")
    return GridPlan(
        **{name: getattr(plan, name) for name in told},
        cells=grid.cells,
        resolution=resolution,
        origin=Location(grid.origin.x, grid.origin.y),
    )
