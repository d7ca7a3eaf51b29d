"""What a reader of floor plans is, and the building that a manifest gives a file."""

import csv
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path, PurePath
from typing import Protocol

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan

MANIFEST = "manifest_dev.csv"


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

    def read(self, path: Path) -> list[FloorPlan | GridPlan]:
        """Return the plans in ``path``.

        Raises:
            PlanError: the file is missing, damaged or lacks something; names the file and what was expected.
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
