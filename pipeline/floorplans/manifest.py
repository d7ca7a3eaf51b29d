"""Buildings from a manifest: a table beside or above the plans that says which of them are one building."""

import csv
from collections import defaultdict
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path, PurePath
from typing import NamedTuple

from pipeline.errors import PlanError
from pipeline.floorplans.sources import SourceFile

PATTERN = "manifest*.csv"
BUILDING_COLUMNS = ("building", "venue", "home")
"""The first of these that a line fills holds the key by which plans are split."""

_LEVELS_ABOVE = 5  # <data set>/dev/maps.zip/<site>/<floor>/plan.json
_LONGEST_NAME = 200  # letters of a building
_LARGEST = 100_000_000
_LONGEST_FIELD = 10_000_000  # lists of categories exceed the 131,072 characters that csv allows by itself


class Manifest(NamedTuple):
    """What a manifest says of one file.

    place: the file, below the folder of the manifest. places: the building of each file, named without its ending,
    and of each folder (with a slash at the end) whose lines agree on one. records: the building of each record.
    """

    place: Path
    places: Mapping[str, str]
    records: Mapping[str, str]

    def building_of(self, plan_id: str) -> str | None:
        """Return the building of a plan of the file, None where the manifest does not say."""
        for record in (plan_id, plan_id.removeprefix(f"{self.place.stem}.")):
            if record in self.records:
                return self.records[record]
        folders = self.place.parts[:-1]
        names = ["/".join((*folders[k:], self.place.stem)) for k in range(len(folders) + 1)]
        names += ["/".join((*folders[k:], "")) for k in range(len(folders))]
        return next((self.places[name] for name in names if name in self.places), None)


def find_manifest(file: SourceFile) -> Manifest | None:
    """Return what the nearest manifest beside or above a file says, None where there is none.

    A member of an archive lies below it, as below a folder: a manifest within the archive comes first. A line is found
    by its columns ``file`` and ``member`` (folder and file inside an archive), endings ignored, so that a YAML finds
    the line of its picture; by ``id``, a record of a file that holds many; or else by its folder.

    Raises:
        PlanError: the manifest cannot be read.
    """
    inside = [folder for folder in file.path.parents if file.unpacked and folder.is_relative_to(file.unpacked[0])]
    original = file.original.absolute()
    places = [(folder, file.path) for folder in inside] + [(folder, original) for folder in original.parents]
    for folder, path in places[: len(inside) + _LEVELS_ABOVE]:
        tables = sorted(folder.glob(PATTERN)) if folder.is_dir() else []
        if tables:
            found = [_lines(table, table.stat().st_mtime_ns) for table in tables]
            buildings = {name: building for of_table, _ in found for name, building in of_table.items()}
            records = {name: building for _, of_table in found for name, building in of_table.items()}
            return Manifest(path.relative_to(folder), buildings, records)
    return None


@lru_cache(maxsize=32)
def _lines(table: Path, _changed_ns: int) -> tuple[dict[str, str], dict[str, str]]:
    """Return the building of every place and of every record in ``table`` that has just one."""
    places: defaultdict[str, set[str]] = defaultdict(set)
    records: defaultdict[str, set[str]] = defaultdict(set)
    for row in _rows(table):
        building = _clean(next((row[name] for name in BUILDING_COLUMNS if row.get(name)), ""))
        if not building:
            continue
        for name in _places(row):
            places[name].add(building)
            if "/" in name:
                places[f"{name.rpartition('/')[0]}/"].add(building)
        if row.get("id"):
            records[row["id"]].add(building)
    return _agreed(places), _agreed(records)


def _agreed(named: Mapping[str, set[str]]) -> dict[str, str]:
    return {name: next(iter(found)) for name, found in named.items() if len(found) == 1}


def _rows(table: Path) -> list[dict[str, str]]:
    csv.field_size_limit(_LONGEST_FIELD)
    try:
        if table.stat().st_size > _LARGEST:
            raise PlanError(f"{table}: larger than {_LARGEST:,} bytes, expected a table with a line for each plan.")
        with table.open(newline="", encoding="utf-8-sig") as stream:
            rows = list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise PlanError(f"{table}: not a readable manifest ({problem}); expected a CSV table in UTF-8.") from problem
    return [{key: value for key, value in row.items() if isinstance(value, str)} for row in rows]


def _clean(building: str) -> str:
    """Return the name of a building as one short line without control characters."""
    shown = "".join(letter if letter.isprintable() else " " for letter in building[: 2 * _LONGEST_NAME])
    return " ".join(shown.split())[:_LONGEST_NAME]


def _places(row: Mapping[str, str]) -> list[str]:
    """Return the files a line names; a place inside an archive is unique only with the name of the archive."""
    file, member = row.get("file"), row.get("member")
    places = [f"{file}/{member}", member] if file and member else [member or file]
    return [PurePath(place).with_suffix("").as_posix() for place in places if place and PurePath(place).name]
