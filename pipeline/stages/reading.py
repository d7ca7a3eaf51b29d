"""Plans read from files: a folder, a file or an archive, checked one by one; what cannot be used is named."""

from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from os.path import commonpath
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from pipeline.errors import PlanError, one_line, printable
from pipeline.floorplans.checked import read_checked
from pipeline.floorplans.checks import Checked
from pipeline.floorplans.read_ranges import RANGES
from pipeline.floorplans.readers import (
    BAD,
    PLAN,
    UNRECOGNISED,
    Classified,
    Reader,
    ReadOptions,
    classify,
    nothing_found,
    say_unused,
)
from pipeline.floorplans.sources import open_source
from pipeline.settings import require
from pipeline.stages.door import Workspace
from pipeline.stages.parallel import Refused, make_all

_MAY_BE_NULL = ("metres_per_unit", "free_thresh", "occupied_thresh")
_SHOWN = 5  # names of files that are no plans


@dataclass(frozen=True, kw_only=True)
class ReadConfig:
    """What the files do not say themselves (conf/plans/, section read)."""

    metres_per_unit: float | None = None
    """Size of a pixel, a cell or a drawing unit [m]; null where the files state it."""
    invert: bool = False
    """Pictures: dark is free."""
    free_thresh: float | None = None
    """Pictures: darkness from 0 (white) to 1 (black), below which a pixel is free; null: as a ROS map states,
    else 0.196, with which grey 205 is unknown."""
    occupied_thresh: float | None = None
    """Pictures: darkness above which a pixel is occupied; between the two it is unknown. Null: as stated, else 0.65."""
    paper: bool = False
    """Pictures and other grids: free space around the house that reaches the border is paper, and no floor."""
    door_width_m: float = 0.9
    """Width of doors that the files give without one."""
    wall_m: float = 0.1
    """Thickness of walls drawn as lines."""
    levels: list[str] = field(default_factory=list)
    """Read only these floors of a file; empty reads all."""
    wall_layers: list[str] = field(default_factory=list)
    """Layers or classes of a drawing that hold walls, with * and ?; empty takes the reader's own list."""
    door_layers: list[str] = field(default_factory=list)
    """The same for doors."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        for name, (low, high) in RANGES.items():
            value = getattr(self, name)
            allowed = f"{'null or ' if name in _MAY_BE_NULL else ''}{low:g} to {high:g}"
            require(value is None or low <= value <= high, f"plans.read.{name}", value, allowed)
        thresholds = self.options().thresholds()
        ordered = thresholds[0] <= thresholds[1]
        require(ordered, "plans.read.free_thresh, occupied_thresh", thresholds, "the first below the second, or equal")

    def options(self) -> ReadOptions:
        """Return the same as readers take it."""
        return ReadOptions(
            metres_per_unit=self.metres_per_unit,
            invert=self.invert,
            free_thresh=self.free_thresh,
            occupied_thresh=self.occupied_thresh,
            paper=self.paper,
            door_width_m=self.door_width_m,
            wall_m=self.wall_m,
            levels=tuple(self.levels),
            wall_layers=tuple(self.wall_layers),
            door_layers=tuple(self.door_layers),
        )


class _OfFile(NamedTuple):
    name: str
    checked: list[Checked]
    refused: list[Refused]


def read_all(
    root: Path,
    *,
    reader: str | Reader | None,
    options: ReadOptions,
    glob: str,
    limit: int | None,
    on_error: str,
    work: Workspace,
) -> tuple[list[tuple[str, Checked]], list[Refused]]:
    """Return the checked plans of the files below ``root``, each with the name of its file, and what was refused.

    A file may hold many plans; a bad one among them is refused by itself. See PlansConfig for the arguments.

    Raises:
        PlanError: no such folder, no file that fits, or a bad file or plan where ``on_error`` is "stop".
    """
    with open_source(root) as files:
        chosen = [file for file in files if file.original.match(glob)]
        if files and not chosen:
            raise PlanError(f"plans.glob = {glob}: no file below {root} has such a name. Change it in conf/plans/.")
        found = classify(chosen, reader)
        entries = [entry for entry in found if entry.role in (PLAN, BAD)][:limit]
        if not entries:
            raise PlanError(nothing_found(root, reader, found))
        _tell_ignored([entry.file.name for entry in found if entry.role == UNRECOGNISED])
        for sentence in unused_in(entries, options):
            print(f"plans: {one_line(sentence)}")
        of_files, refused = make_all(
            partial(_read_one, options=options, on_error=on_error),
            [(str(entry.file.original), entry) for entry in entries],
            on_error=on_error,
            workers=work.workers,
            label="plans",
            progress=work.progress,
        )
    refused += [bad for of_file in of_files for bad in of_file.refused]
    return [(of_file.name, checked) for of_file in of_files for checked in of_file.checked], refused


def unused_in(entries: Sequence[Classified], options: ReadOptions) -> list[str]:
    """Return a sentence for each format among the files that does not use some of the options."""
    readers = [entry.reader for entry in entries if entry.reader is not None]
    counts, by_name = Counter(reader.name for reader in readers), {reader.name: reader for reader in readers}
    return [f"{said} ({counts[name]} files)" for name in counts for said in say_unused(by_name[name], options)]


def name_apart(found: Sequence[tuple[str, Checked]]) -> list[Checked]:
    """Return the plans of the named files with ids that differ: equal ones get their folder, file or number in front.

    Plans whose id is unique keep it. The result depends on names and order alone.
    """
    ids = [plan.plan_id for _, (plan, _) in found]
    for more in (_folders, _files, _numbers):
        ids = _distinguish(ids, [name for name, _ in found], more)
    return [Checked(replace(plan, plan_id=name), report) for name, (_, (plan, report)) in zip(ids, found, strict=True)]


def _distinguish(ids: list[str], names: list[str], more: Callable[[list[str]], list[str]]) -> list[str]:
    """Return ``ids`` in which each group of equal ones has been told apart by what ``more`` says of their files."""
    groups: dict[str, list[int]] = defaultdict(list)
    for place, plan_id in enumerate(ids):
        groups[plan_id].append(place)
    told = list(ids)
    for plan_id, places in groups.items():
        if len(places) > 1:
            for place, prefix in zip(places, more([names[place] for place in places]), strict=True):
                told[place] = ".".join(filter(None, (prefix, plan_id)))
    return told


def _folders(names: list[str]) -> list[str]:
    folders = [PurePosixPath(name).parent for name in names]
    shared = commonpath(folders)
    return [".".join(folder.relative_to(shared).parts) for folder in folders]


def _files(names: list[str]) -> list[str]:
    return [PurePosixPath(name).name for name in names] if len(set(names)) > 1 else ["" for _ in names]


def _numbers(names: list[str]) -> list[str]:
    return [str(number) for number in range(1, len(names) + 1)]


def _read_one(entry: Classified, *, options: ReadOptions, on_error: str) -> _OfFile:
    """Read and check the plans of one file."""
    result = _OfFile(entry.file.name, [], [])
    for found in read_checked(entry, options):
        if isinstance(found, Checked):
            result.checked.append(found)
        elif on_error == "stop":
            raise found
        else:
            result.refused.append(Refused(str(entry.file.original), str(found)))
    return result


def _tell_ignored(names: Sequence[str]) -> None:
    if names:
        endings = Counter(PurePosixPath(name).suffix or "no ending" for name in names)
        kinds = ", ".join(f"{count} {printable(ending)}" for ending, count in endings.most_common(_SHOWN))
        shown = ", ".join(map(printable, names[:_SHOWN])) + (", ..." if len(names) > _SHOWN else "")
        print(f"plans: {len(names)} files are no plans and were passed over ({kinds}): {shown}")
