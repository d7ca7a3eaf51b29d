"""What horizontal cuts through the storeys of an IFC model show, found in a process of its own.

The C++ library that reads models crashes on some that refer to themselves, and never ends on others. So `cut_storeys`
starts another Python, bounded in time and memory, that writes what it finds into a file: as JSON with the areas in
well-known binary, so that nothing is unpickled here either.
"""

import json
import os
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

import shapely
from shapely.errors import GEOSException

import pipeline
from pipeline.errors import PlanError
from pipeline.floorplans.readers.drawing import PARSER_ERRORS
from pipeline.floorplans.readers.ifc_bodies import Cuts, cut_bodies, cut_unread
from pipeline.floorplans.readers.ifc_floors import (
    BARRIER,
    DOOR,
    DOORWAY,
    PASSAGE,
    SPACE,
    WALL,
    Floor,
    floors_of,
)
from pipeline.floorplans.readers.ifc_levels import Levels, entities
from pipeline.floorplans.readers.json_file import short_text
from pipeline.floorplans.walls import Area

MOST_SECONDS = 900.0
MOST_MEMORY = 8_000_000_000
_MOST_BYTES = 200_000_000
_ROLES = (WALL, BARRIER, DOOR, PASSAGE, DOORWAY, SPACE)
_TAIL = 100_000  # bytes; a signature may follow the end of a model


class Storey(NamedTuple):
    """A storey and what the cut ``CUT_M`` above its floor shows: areas [m] with labels.

    building: its name, "" for none. elevation: its height in the model [m]. walls: none where the storey is no floor of
    its own. doors: the boxes of the doors, seen from above. passages: openings in walls down to the floor, with nothing
    in them; doorways: with a door in them. elsewhere: floor of other storeys at this height. left_out: bodies of the
    whole model that could not be built. read_with: names of storeys that are a part of this floor. as_walls: how many
    bodies in the cut are of unclear classes and read as walls; unread: the same of classes that are not read. unseen:
    elements of the whole model of such classes that were not looked at.
    """

    name: str
    building: str
    elevation: float
    left_out: int
    read_with: list[str]
    as_walls: dict[str, int]
    unread: dict[str, int]
    unseen: int
    walls: list[Area]
    doors: list[Area]
    passages: list[Area]
    doorways: list[Area]
    spaces: list[tuple[Area, str]]
    elsewhere: list[Area]


def cut_storeys(path: Path) -> list[Storey]:
    """Return the storeys of a model by building, the lowest first; those that are a part of another are left out.

    Raises:
        PlanError: ifcopenshell is not installed; or the model is damaged, too large, or without storeys.
    """
    if find_spec("ifcopenshell") is None:
        raise PlanError(f"{path}: IFC models need the package ifcopenshell. Install it: pip install 'hinterland[ifc]'")
    _check_whole(path)
    with tempfile.TemporaryDirectory(prefix="hinterland-") as scratch:
        out = Path(scratch) / "cuts.json"
        call = f"from {__name__} import _serve; _serve()"
        places = [str(Path(pipeline.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])]
        try:
            code = subprocess.run(
                [sys.executable, "-c", call, str(path), str(out), str(MOST_MEMORY)],
                env=os.environ | {"PYTHONPATH": os.pathsep.join(places)},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=MOST_SECONDS,
                check=False,
            ).returncode
        except subprocess.TimeoutExpired as problem:
            if not out.is_file():
                raise PlanError(
                    f"{path}: its geometry takes more than {MOST_SECONDS:g} s. Simplify the model, or export it again."
                ) from problem
        if not out.is_file():
            raise PlanError(
                f"{path}: ifcopenshell crashed on it (exit {code}): it refers to itself, is damaged, or "
                "needs too much memory. Export it again."
            )
        found = json.loads(out.read_bytes())
    if "problem" in found:
        raise PlanError(f"{path}: {found['problem']}")
    return [_decoded(storey) for storey in found["storeys"]]


def _check_whole(path: Path) -> None:
    """Refuse a model that is absent, too large, or cut off: ifcopenshell would read what is left without a word."""
    try:
        with path.open("rb") as stream:
            size = path.stat().st_size
            stream.seek(max(0, size - _TAIL))
            tail = stream.read()
    except OSError as problem:
        raise PlanError(f"{path}: cannot be read ({problem.strerror}). Check the path and its rights.") from problem
    if size > _MOST_BYTES:
        raise PlanError(f"{path}: more than {_MOST_BYTES:,} bytes, at most that many are read. Split the model.")
    if b"END-ISO-10303-21" not in tail:
        raise PlanError(f"{path}: it has no end (END-ISO-10303-21): a part is missing. Copy or export it again.")


def _decoded(storey: dict[str, Any]) -> Storey:
    said = {key: value for key, value in storey.items() if key not in _ROLES}
    said["elsewhere"] = [shapely.from_wkb(area) for area in storey["elsewhere"]]
    labelled = {role: [(shapely.from_wkb(area), label) for area, label in storey[role]] for role in _ROLES}
    areas = {role: [area for area, _ in found] for role, found in labelled.items()}
    return Storey(
        **said,
        walls=areas[WALL] + areas[BARRIER],
        doors=areas[DOOR],
        passages=areas[PASSAGE],
        doorways=areas[DOORWAY],
        spaces=labelled[SPACE],
    )


def _serve() -> None:
    """Cut the model named on the command line; what is found, or why nothing is, goes into the file named next."""
    path, out, most_memory = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_AS, (most_memory, most_memory))
    except (ImportError, ValueError, OSError):  # a system without such limits
        pass
    try:
        _storeys(path, out)
    except PlanError as problem:
        _write(out, {"problem": str(problem)})
    except GEOSException as problem:
        if not out.is_file():
            _write(out, {"problem": f"its bodies cannot be combined ({problem}). Export the model again."})


def _storeys(path: Path, out: Path) -> None:
    """Write what is found into ``out``; without what is merely counted first, should the library crash on that."""
    model, scale = _open(path)
    levels = Levels(model, scale)
    cuts = cut_bodies(model, levels)
    _write(out, {"storeys": _found(levels, cuts, unseen=len(entities(model, "IfcElement")))})
    unseen = cut_unread(model, levels, cuts.pieces)
    _write(out, {"storeys": _found(levels, cuts, unseen=unseen)})


def _found(levels: Levels, cuts: Cuts, *, unseen: int) -> list[dict[str, Any]]:
    floors = floors_of(levels.levels, cuts.pieces, cuts.inhabited, len(levels.buildings))
    read = {number for floor in floors for number in (floor.level, *floor.read_with)}
    floors += [Floor(number) for number in range(len(levels.levels)) if number not in read]
    return [_encoded(floor, levels, cuts, unseen) for floor in sorted(floors, key=lambda floor: floor.level)]


def _encoded(floor: Floor, levels: Levels, cuts: Cuts, unseen: int) -> dict[str, Any]:
    level = levels.levels[floor.level]
    areas: dict[str, list[tuple[str, str]]] = {role: [] for role in _ROLES}
    for piece in floor.pieces:
        areas[piece.role].append((shapely.to_wkb(piece.area, hex=True), piece.label))
    return {
        "name": level.name,
        "building": levels.buildings[level.building] if level.building >= 0 else "",
        "elevation": level.elevation,
        "left_out": cuts.left_out,
        "read_with": [levels.levels[number].name for number in floor.read_with],
        "elsewhere": [shapely.to_wkb(area, hex=True) for area in floor.elsewhere],
        "as_walls": floor.as_walls,
        "unread": floor.unread,
        "unseen": unseen,
        **areas,
    }


def _write(out: Path, answer: dict[str, Any]) -> None:
    whole = out.with_suffix(".part")
    whole.write_text(json.dumps(answer), encoding="utf-8")
    whole.replace(out)


def _open(path: Path) -> tuple[Any, float]:
    """Return the model and the metres of its length unit."""
    import ifcopenshell
    from ifcopenshell.util.unit import calculate_unit_scale

    try:
        model = ifcopenshell.open(str(path))
        scale = float(calculate_unit_scale(model))
    except (ifcopenshell.Error, *PARSER_ERRORS) as problem:
        raise PlanError(f"not a readable IFC model ({short_text(str(problem))}). Export it again.") from problem
    if not (isfinite(scale) and scale > 0):
        raise PlanError(f"its length unit has {scale:g} m, expected more than 0. Repair the model.")
    return model, scale
