"""Buildings and splits from a manifest: a table beside or above the plans that says which are one building."""

import csv
from collections import defaultdict
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path, PurePath
from typing import NamedTuple

from pipeline.errors import PlanError
from pipeline.floorplans.sources import SourceFile

PATTERN = "manifest*.csv"
BUILDING_COLUMNS = ("building", "venue", "home")
"""The first of these that a line fills holds the key by which plans are split."""
SPLIT_COLUMN = "split"
SPLITS = ("train", "validation", "test")

_LEVELS_ABOVE = 5  # <data set>/dev/maps.zip/<site>/<floor>/plan.json
_LONGEST_NAME = 200  # letters of a building
_LARGEST = 100_000_000
_LONGEST_FIELD = 10_000_000  # lists of categories exceed the 131,072 characters that csv allows by itself


class Said(NamedTuple):
    """What the lines on one place or record agree on; None where they say nothing or contradict each other."""

    building: str | None = None
    split: str | None = None


class Manifest(NamedTuple):
    """What a manifest says of one file.

    place: the file, below the folder of the manifest. places: what it says of each file, named without its ending, and
    of each folder (with a slash at the end). records: the same of each record. splits: the split of each building.
    """

    place: Path
    places: Mapping[str, Said]
    records: Mapping[str, Said]
    splits: Mapping[str, str]

    def building_of(self, plan_id: str) -> str | None:
        """Return the building of a plan of the file, None where the manifest does not say."""
        return next((said.building for said in self._on(plan_id) if said.building is not None), None)

    def split_of(self, plan_id: str) -> str | None:
        """Return the split of a plan of the file, that of its building if its own line has none; None where unsaid."""
        nearest = next(self._on(plan_id), Said())  # a line of its own without a split is not overruled by its folder
        return nearest.split or self.splits.get(self.building_of(plan_id) or "")

    def _on(self, plan_id: str) -> Iterator[Said]:
        """Yield what is said of a plan, the nearest first: its record, its file, its folder."""
        for record in (plan_id, plan_id.removeprefix(f"{self.place.stem}.")):
            if record in self.records:
                yield self.records[record]
        folders = self.place.parts[:-1]
        names = ["/".join((*folders[k:], self.place.stem)) for k in range(len(folders) + 1)]
        names += ["/".join((*folders[k:], "")) for k in range(len(folders))]
        yield from (self.places[name] for name in names if name in self.places)


class _Row(NamedTuple):
    """A line with its split, and how messages name it: "manifest.csv, line 3 (a.npz)"."""

    split: str
    name: str


class _Table(NamedTuple):
    places: dict[str, Said]
    records: dict[str, Said]
    splits: dict[str, _Row]


def find_manifest(file: SourceFile) -> Manifest | None:
    """Return what the nearest manifest beside or above a file says, None where there is none.

    A member of an archive lies below it, as below a folder: a manifest within the archive comes first. A line is found
    by its columns ``file`` and ``member`` (folder and file inside an archive), endings ignored, so that a YAML finds
    the line of its picture; by ``id``, a record of a file that holds many; or else by its folder.

    Raises:
        PlanError: the manifest cannot be read, has a split that is none, or puts one building into two.
    """
    inside = [folder for folder in file.path.parents if file.unpacked and folder.is_relative_to(file.unpacked[0])]
    original = file.original.absolute()
    places = [(folder, file.path) for folder in inside] + [(folder, original) for folder in original.parents]
    for folder, path in places[: len(inside) + _LEVELS_ABOVE]:
        tables = sorted(folder.glob(PATTERN)) if folder.is_dir() else []
        if tables:
            found = [_lines(table, table.stat().st_mtime_ns) for table in tables]
            said = {name: each for table in found for name, each in table.places.items()}
            records = {name: each for table in found for name, each in table.records.items()}
            splits: dict[str, _Row] = {}
            for table in found:
                for building, row in table.splits.items():
                    _note_split(splits, building, row)
            by_building = {building: row.split for building, row in splits.items()}
            return Manifest(path.relative_to(folder), said, records, by_building)
    return None


@lru_cache(maxsize=32)
def _lines(table: Path, _changed_ns: int) -> _Table:
    """Return what ``table`` says of every place, of every record, and of the split of every building."""
    places: defaultdict[str, list[Said]] = defaultdict(list)
    records: defaultdict[str, list[Said]] = defaultdict(list)
    splits: dict[str, _Row] = {}
    for line, row in _rows(table):
        building = _clean(next((row[name] for name in BUILDING_COLUMNS if row.get(name)), "")) or None
        listed = row.get("member") or row.get("file") or row.get("id") or ""
        named = f"{table}, line {line} ({_clean(listed)})"
        split = _split(row.get(SPLIT_COLUMN) or "", named)
        said = Said(building, split)
        if building and split:
            _note_split(splits, building, _Row(split, named))
        for name in _places(row):
            places[name].append(said)
            if "/" in name:
                places[f"{name.rpartition('/')[0]}/"].append(said)
        if row.get("id"):
            records[row["id"]].append(said)
    return _Table(_agreed(places), _agreed(records), splits)


def _note_split(splits: dict[str, _Row], building: str, row: _Row) -> None:
    before = splits.setdefault(building, row)
    if before.split != row.split:
        raise PlanError(
            f"{row.name}: building {building} is in split {row.split}, and in {before.split} by {before.name}; "
            "expected one split for each building, or floors that were learnt from would be tested on."
        )


def _split(given: str, named: str) -> str | None:
    split = given.strip().lower()
    if split and split not in SPLITS:
        raise PlanError(f"{named}: split = {_clean(given)}, expected {', '.join(SPLITS)}, or nothing.")
    return split or None


def _agreed(named: Mapping[str, list[Said]]) -> dict[str, Said]:
    return {
        name: Said(_only({said.building for said in found} - {None}), _only({said.split for said in found}))
        for name, found in named.items()
    }


def _only(found: set[str | None]) -> str | None:
    return next(iter(found)) if len(found) == 1 else None


def _rows(table: Path) -> list[tuple[int, dict[str, str]]]:
    """Return the rows of ``table``, each with the number of its (last) line."""
    csv.field_size_limit(_LONGEST_FIELD)
    try:
        if table.stat().st_size > _LARGEST:
            raise PlanError(f"{table}: larger than {_LARGEST:,} bytes, expected a table with a line for each plan.")
        with table.open(newline="", encoding="utf-8-sig") as stream:
            reader = csv.DictReader(stream)
            rows = [(reader.line_num, row) for row in reader]
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise PlanError(f"{table}: not a readable manifest ({problem}); expected a CSV table in UTF-8.") from problem
    return [(line, {key: value for key, value in row.items() if isinstance(value, str)}) for line, row in rows]


def _clean(building: str) -> str:
    """Return the name of a building as one short line without control characters."""
    shown = "".join(letter if letter.isprintable() else " " for letter in building[: 2 * _LONGEST_NAME])
    return " ".join(shown.split())[:_LONGEST_NAME]


def _places(row: Mapping[str, str]) -> list[str]:
    """Return the files a line names; a place inside an archive is unique only with the name of the archive."""
    file, member = row.get("file"), row.get("member")
    places = [f"{file}/{member}", member] if file and member else [member or file]
    return [PurePath(place).with_suffix("").as_posix() for place in places if place and PurePath(place).name]
