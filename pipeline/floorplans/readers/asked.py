"""A reader with the options that a person gives: what has no effect is refused or remarked, never passed over.

A scale for a file that states another one is refused; in a folder it is meant for those files that state none, and the
others remark it. Floors are selected by their names also where the reader does not
part them; floors that are not there are refused where nothing is left, else remarked. Every other option that a
reader does not use, and layers of doors without a door, are remarked.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from math import isclose
from pathlib import Path

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers.json_file import short_text
from pipeline.floorplans.readers.reader import Reader, ReadOptions

_SHOWN = 20  # names of floors
_REFUSED = ("metres_per_unit", "levels")  # rather than remarked, where a reader does not use them


def read_as_asked(
    path: Path, reader: Reader, options: ReadOptions, *, lone: bool = True
) -> Iterator[FloorPlan | GridPlan | PlanError]:
    """Yield each plan in ``path`` that ``options`` select, with remarks on options without effect, or an error for it.

    lone: the options were given for this very file, not for a folder of many.

    Raises:
        PlanError: see `Reader.read`; a lone file states another scale than the one given; it has no plan, or none of
            the floors asked for: names those that there are.
    """
    said = (*say_unused(reader, options),)
    found = _on_levels(path, reader, options) if options.levels else reader.read(path, options)
    count = 0
    for plan in found:
        count += 1
        if isinstance(plan, PlanError):
            yield plan
            continue
        wrong = _other_scale(reader, plan, options.metres_per_unit)
        if wrong and lone:
            raise PlanError(f"{path}: {wrong}. Leave it away, or correct the file.")
        kept = (f"{wrong}, which holds",) if wrong else ()
        yield replace(plan, remarks=(*plan.remarks, *_without_doors(plan, reader, options), *said, *kept))
    if not count:
        raise PlanError(f"{path}: {reader.name} finds no plan in it. Check the file.")


def say_unused(reader: Reader, options: ReadOptions) -> list[str]:
    """Return a sentence on the options that differ from the default and that the reader does not use; at most one."""
    usual = ReadOptions()
    given = [field.name for field in fields(options) if getattr(options, field.name) != getattr(usual, field.name)]
    unused = [f"plans.read.{name}" for name in given if name not in (*reader.uses, *_REFUSED)]
    if not unused:
        return []
    return [
        f"{' and '.join(unused)} {'has' if len(unused) == 1 else 'have'} no effect: {reader.name} needs no such thing"
    ]


def _on_levels(path: Path, reader: Reader, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
    """Yield the plans of the floors asked for, with a remark on those that are not there.

    Raises:
        PlanError: none of them is; the message names those that are.
    """
    parted = "levels" in reader.uses
    found = list(reader.read(path, options)) if parted else []
    if not found:  # a floor may be called as it is printed as well
        everything = list(reader.read(path, replace(options, levels=())))
        problems = [each for each in everything if isinstance(each, PlanError)]
        plans = [each for each in everything if not isinstance(each, PlanError)]
        chosen = [each for each in plans if any(_is_called(path, each, level, parted) for level in options.levels)]
        if plans and not chosen:
            floors = [*dict.fromkeys(_short(path, each) for each in plans)]
            asked = f"plans.read.levels = {_listed(options.levels)}"
            raise PlanError(
                f"{path}: {asked} selects nothing; there {'is' if len(floors) == 1 else 'are'} {_listed(floors)}."
            )
        found = [*chosen, *problems] if chosen or not parted else []
    missing = [level for level in options.levels if not _is_there(path, reader, options, level, found)]
    said = (f"plans.read.levels = {_listed(missing)} selects nothing in this file",) if missing else ()
    for each in found:
        yield each if isinstance(each, PlanError) else replace(each, remarks=(*each.remarks, *said))


def _is_there(
    path: Path, reader: Reader, options: ReadOptions, level: str, found: Sequence[FloorPlan | GridPlan | PlanError]
) -> bool:
    """Return whether one of several floors asked for is there; a reader may know a floor by more names than one."""
    parted = "levels" in reader.uses
    if len(options.levels) == 1 or any(
        _is_called(path, each, level, parted) for each in found if not isinstance(each, PlanError)
    ):
        return True
    return parted and next(iter(reader.read(path, replace(options, levels=(level,)))), None) is not None


def _is_called(path: Path, plan: FloorPlan | GridPlan, level: str, parted: bool) -> bool:
    """Return whether ``level`` names the floor of a plan; where the reader does not part floors, 1 also names 7-1."""
    if level in (plan.floor, _short(path, plan)):
        return True
    return not parted and re.search(rf"(?:(?<=\w)[-_ ]|(?<=\D)\.){re.escape(level)}$", plan.floor) is not None


def _short(path: Path, plan: FloorPlan | GridPlan) -> str:
    """Return the name of the floor of a plan without that of its file in front."""
    return plan.floor.removeprefix(f"{path.stem}.")


def _other_scale(reader: Reader, plan: FloorPlan | GridPlan, asked: float | None) -> str:
    """Return what is wrong with a scale beside the one that the file states; empty where nothing is."""
    if asked is None or "metres_per_unit" in reader.uses:
        return ""
    if isinstance(plan, GridPlan) and isclose(plan.resolution, asked, rel_tol=1e-6):
        return ""
    stated = f"cells of {plan.resolution:g} m" if isinstance(plan, GridPlan) else "its own scale"
    return f"plans.read.metres_per_unit={asked:g} does not fit: a file of {reader.name} states {stated}"


def _without_doors(plan: FloorPlan | GridPlan, reader: Reader, options: ReadOptions) -> list[str]:
    if not options.door_layers or "door_layers" not in reader.uses or plan.doors:
        return []
    return [f"plans.read.door_layers = {_listed(options.door_layers)} selects nothing: no door was found"]


def _listed(names: Sequence[str]) -> str:
    """Return names in words; of many, the first."""
    return ", ".join(map(short_text, names[:_SHOWN])) + (", ..." if len(names) > _SHOWN else "")
