"""Readers of floor plans, one per format, found by name or by a look into the file."""

from pathlib import Path

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers.mit_campus_grids import MitCampusGrids
from pipeline.floorplans.readers.reader import Reader, ReadOptions
from pipeline.floorplans.readers.ros_map_server import RosMapServer

__all__ = ["READERS", "ReadOptions", "Reader", "find_plan_files", "read_plan_file"]

READERS: dict[str, Reader] = {reader.name: reader for reader in (MitCampusGrids(), RosMapServer())}


def find_plan_files(root: Path, reader_name: str | None = None) -> list[Path]:
    """Return the files under ``root`` (a folder or one file) that a reader, or the named one, may read; sorted.

    Raises:
        PlanError: no such folder, or no file in it that fits.
    """
    patterns = [pattern for reader in _chosen(reader_name) for pattern in reader.patterns]
    if not root.exists():
        raise PlanError(f"plans.root = {root}: no such folder or file. Give the folder that holds the plans.")
    if root.is_file():
        return [root]
    files = sorted({path for pattern in patterns for path in root.rglob(pattern) if path.is_file()})
    if not files:
        raise PlanError(f"plans.root = {root}: no {' or '.join(patterns)} in this folder. Is it the right one?")
    return files


def read_plan_file(
    path: Path, reader_name: str | None = None, options: ReadOptions | None = None
) -> list[FloorPlan | GridPlan | PlanError]:
    """Read one file with the named reader, or with the first one that recognises its content.

    A record of the file that is no plan comes back as the error that says why.

    Raises:
        PlanError: no such file, no reader recognises it, or it is damaged.
    """
    if not path.is_file():
        raise PlanError(f"{path}: no such file.")
    chosen = (
        _chosen(reader_name) if reader_name is not None else [reader for reader in _chosen(None) if reader.sniff(path)]
    )
    if not chosen:
        raise PlanError(
            f"{path}: not recognised as {' or '.join(READERS)}. Name the format in plans.reader, or move it away."
        )
    return list(chosen[0].read(path, options or ReadOptions()))


def _chosen(name: str | None) -> list[Reader]:
    if name is None:
        return list(READERS.values())
    if name not in READERS:
        raise PlanError(f"plans.reader = {name}: no such reader. Choose one of {', '.join(READERS)}, or null.")
    return [READERS[name]]
