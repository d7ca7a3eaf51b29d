"""What a reader of floor plans is, and the building that a manifest gives a file."""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path, PurePath
from typing import Protocol

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan

MANIFEST = "manifest_dev.csv"


@dataclass(frozen=True, kw_only=True)
class ReadOptions:
    """What a person may say about files that do not say it themselves (conf/plans/: ``read``).

    metres_per_unit: size of a pixel or drawing unit [m]; needed where the format has no scale, refused by readers
    whose format states it. invert: dark pixels are free. free_thresh, occupied_thresh: a pixel whose darkness (0
    white to 1 black, after ``invert``) is below the first is free, above the second occupied, between them unknown.
    door_width_m: width cut for doors that the file gives without one [m]. wall_m: thickness of walls drawn as lines
    [m]. levels: read only these floors of a file; empty reads all. wall_layers, door_layers: names, with * and ?, of
    the layers or classes of a drawing that hold walls and doors; empty takes the reader's own list.
    """

    metres_per_unit: float | None = None
    invert: bool = False
    free_thresh: float = 0.25
    occupied_thresh: float = 0.65
    door_width_m: float = 0.9
    wall_m: float = 0.1
    levels: tuple[str, ...] = ()
    wall_layers: tuple[str, ...] = ()
    door_layers: tuple[str, ...] = ()


class Reader(Protocol):
    """One format. ``patterns`` are the file names it looks for in a folder, such as ``*.npz``."""

    @property
    def name(self) -> str:
        """Name in the registry and in the configuration."""
        ...

    @property
    def patterns(self) -> Sequence[str]:
        """File names that may hold a plan of this format."""
        ...

    def sniff(self, path: Path) -> bool:
        """Return whether the content of ``path`` looks like this format. Never raises on a foreign file."""
        ...

    def accompanies(self, path: Path) -> bool:
        """Return whether ``path`` belongs to a plan without holding one itself: a scenario, a mask, an index."""
        ...

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield each plan in ``path``, or the error that says why one record of it is none.

        Raises:
            PlanError: the file as a whole is missing, damaged or lacks something; names it and what was expected.
        """
        ...


def building_in_manifest(path: Path) -> str | None:
    """Return the building that a manifest beside or above ``path`` gives this file, None without such a line.

    A line is found by its column ``member`` (folder and file inside an archive) or ``file``; endings are ignored, so
    that a YAML finds the line of its picture.

    Raises:
        PlanError: the manifest has no column ``building``.
    """
    for folder in path.resolve().parents[:3]:
        if (folder / MANIFEST).is_file():
            lines = _manifest(folder / MANIFEST)
            return lines.get(f"{path.parent.name}/{path.stem}") or lines.get(path.stem)
    return None


@lru_cache(maxsize=32)
def _manifest(path: Path) -> dict[str, str]:
    with path.open(newline="", encoding="utf-8") as stream:
        lines = list(csv.DictReader(stream))
    if lines and "building" not in lines[0]:
        raise PlanError(
            f"{path}: no column 'building', found {', '.join(lines[0])}. Add it: plans are split by building."
        )
    names = (PurePath(line.get("member") or line["file"]) for line in lines)
    return {str(name.with_suffix("")): line["building"] for name, line in zip(names, lines, strict=True)}
