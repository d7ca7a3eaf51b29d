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
from collections.abc import Iterator, Sequence
from contextlib import suppress
from importlib.util import find_spec
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

import pipeline
from pipeline.errors import PlanError
from pipeline.floorplans.readers.drawing import PARSER_ERRORS
from pipeline.floorplans.readers.json_file import short_text
from pipeline.floorplans.walls import Area, as_area

CUT_M = 1.1
MOST_SECONDS = 900.0
MOST_MEMORY = 8_000_000_000
_MOST_BYTES = 200_000_000
_MOST_TRIANGLES = 5_000_000
_MOST_STOREYS = 500
_SOLID = ("IfcWall", "IfcColumn", "IfcWindow", "IfcCurtainWall", "IfcPlate")
_ROLES = (
    ("wall", _SOLID),
    ("door", ("IfcDoor",)),
    ("passage", ("IfcOpeningElement",)),
    ("doorway", ("IfcOpeningElement",)),
    ("space", ("IfcSpace",)),
)
_OPENINGS = ("passage", "doorway")
_TAIL = 100_000  # bytes; a signature may follow the end of a model
_SILL_M = 0.3  # an opening that begins higher above the floor is a window
_SNAP_M = 1e-4  # ends of cuts closer than this are one corner


class Storey(NamedTuple):
    """A storey and what the cut ``CUT_M`` above its floor shows: areas [m] with labels.

    elevation: its height in the model [m]. doors: the boxes of the doors, seen from above. passages: openings in walls
    down to the floor, with nothing in them; doorways: with a door in them. left_out: bodies of the whole model that
    could not be built.
    """

    name: str
    elevation: float
    left_out: int
    walls: list[Area]
    doors: list[Area]
    passages: list[Area]
    doorways: list[Area]
    spaces: list[tuple[Area, str]]


def cut_storeys(path: Path) -> list[Storey]:
    """Return the storeys of a model, the lowest first.

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
            ended = subprocess.run(
                [sys.executable, "-c", call, str(path), str(out), str(MOST_MEMORY)],
                env=os.environ | {"PYTHONPATH": os.pathsep.join(places)},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=MOST_SECONDS,
                check=False,
            )
        except subprocess.TimeoutExpired as problem:
            raise PlanError(
                f"{path}: its geometry takes more than {MOST_SECONDS:g} s. Simplify the model, or export it again."
            ) from problem
        if ended.returncode != 0 or not out.is_file():
            raise PlanError(
                f"{path}: ifcopenshell crashed on it (exit {ended.returncode}): it refers to itself, is damaged, or "
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
    areas = {role: [(shapely.from_wkb(area), label) for area, label in storey[role]] for role, _ in _ROLES}
    walls, doors, passages, doorways = (
        [area for area, _ in areas[role]] for role in ("wall", "door", "passage", "doorway")
    )
    return Storey(
        storey["name"], storey["elevation"], storey["left_out"], walls, doors, passages, doorways, areas["space"]
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
        answer: dict[str, Any] = {"storeys": _storeys(path)}
    except PlanError as problem:
        answer = {"problem": str(problem)}
    out.write_text(json.dumps(answer), encoding="utf-8")


def _storeys(path: Path) -> list[dict[str, Any]]:
    model, scale = _open(path)
    storeys = _all(model, "IfcBuildingStorey")
    if not storeys:
        raise PlanError("no IfcBuildingStorey, expected one for each floor. Export it with storeys.")
    if len(storeys) > _MOST_STOREYS:
        raise PlanError(f"{len(storeys):,} storeys, at most {_MOST_STOREYS} are read. Split the model.")
    floors = [height * scale for height in _heights(storeys)]
    names = [short_text(storey.Name or f"{floor:g}") for storey, floor in zip(storeys, floors, strict=True)]
    # Buildings in one model may both have a "Level 1".
    names = [f"{name} {floor:g}" if names.count(name) > 1 else name for name, floor in zip(names, floors, strict=True)]
    upward = sorted(zip(floors, names, strict=True))
    cuts, left_out = _cut_all(model, [floor for floor, _ in upward])
    return [
        {"name": name, "elevation": floor, "left_out": left_out, **cut}
        for (floor, name), cut in zip(upward, cuts, strict=True)
    ]


def _heights(storeys: list[Any]) -> list[float]:
    """Return the heights of the floors in the world, where bodies are placed, in units of the model.

    Elevation is above the building's own zero, and its site may lie 100 m above the sea; but it is all there is where
    the storeys are all placed at one height.
    """
    from ifcopenshell.util.placement import get_local_placement

    elevations = [_elevation(storey) for storey in storeys]
    placements = [storey.ObjectPlacement for storey in storeys]
    if not all(placements):
        return elevations
    placed = [float(get_local_placement(placement)[2][3]) for placement in placements]
    if not np.isfinite(placed).all() or (len({*placed}) == 1 and len({*elevations}) > 1):
        return elevations
    return placed


def _elevation(storey: Any) -> float:
    value = storey.Elevation
    if value is None:
        return 0.0
    if not isinstance(value, int | float) or not isfinite(value):
        raise PlanError(
            f"the elevation of a storey is {short_text(str(value))!r}, expected a number. Repair the model."
        )
    return float(value)


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


def _all(model: Any, kind: str) -> list[Any]:
    """Return the entities of a kind; none where the schema of the model has no such kind."""
    try:
        return list(model.by_type(kind))
    except RuntimeError:
        return []


def _cut_all(model: Any, floors: Sequence[float]) -> tuple[list[dict[str, list[tuple[str, str]]]], int]:
    """Return what is cut above each floor [m]: areas (as hexadecimal WKB) with labels by role; and bodies left out."""
    found: list[dict[str, list[tuple[str, str]]]] = [{role: [] for role, _ in _ROLES} for _ in floors]
    left, left_out = _MOST_TRIANGLES, 0
    for role, kinds in _ROLES:
        products = [each for kind in kinds for each in _all(model, kind)]
        if role in _OPENINGS:
            products = [each for each in products if _role_of_opening(each) == role]
        for product, triangles in _meshes(products):
            left -= len(triangles)
            left_out += not len(triangles)
            if left < 0:
                raise PlanError(f"more than {_MOST_TRIANGLES:,} triangles, at most that many are read.")
            low, high = triangles[:, :, 2].min(initial=np.inf), triangles[:, :, 2].max(initial=-np.inf)
            for floor, cut in zip(floors, found, strict=True):
                if low < floor + (_SILL_M if role in _OPENINGS else CUT_M) and floor + CUT_M < high:
                    area = _box(triangles) if role == "door" else _section(triangles, floor + CUT_M)
                    if not area.is_empty:
                        label = short_text(product.LongName or product.Name or "") if role == "space" else ""
                        cut[role].append((shapely.to_wkb(area, hex=True), label))
    return found, left_out


def _role_of_opening(opening: Any) -> str:
    """Return "doorway" for an opening with a door in a wall, "passage" where nothing with a body stands, else ""."""
    if "recess" in f"{getattr(opening, 'PredefinedType', '')} {opening.ObjectType}".lower():
        return ""
    if not any(relation.RelatingBuildingElement.is_a("IfcWall") for relation in opening.VoidsElements):
        return ""
    fillings = [relation.RelatedBuildingElement for relation in opening.HasFillings]
    if not all(filling.is_a("IfcDoor") for filling in fillings):
        return ""
    return "doorway" if any(filling.Representation is not None for filling in fillings) else "passage"


def _meshes(products: list[Any]) -> Iterator[tuple[Any, NDArray[np.float64]]]:
    """Yield each product that has a body, with its triangles [k, 3, 3] in metres; none where it cannot be built."""
    import ifcopenshell.geom

    kernel: Any = ifcopenshell.geom
    settings = kernel.settings()
    settings.set("use-world-coords", True)
    settings.set("disable-opening-subtractions", True)
    for product in products:
        if getattr(product, "Representation", None) is None:
            continue
        corners, faces = np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
        with suppress(RuntimeError, TypeError, ValueError):
            shape = kernel.create_shape(settings, product)
            corners = np.asarray(shape.geometry.verts, dtype=np.float64).reshape(-1, 3)
            faces = np.asarray(shape.geometry.faces, dtype=np.int64).reshape(-1, 3)
        yield product, corners[faces if np.isfinite(corners).all() else faces[:0]]


def _section(triangles: NDArray[np.float64], height: float) -> Area:
    """Return the area that a horizontal plane cuts out of a closed body."""
    above = triangles[:, :, 2] > height
    crossing = triangles[above.any(axis=1) & ~above.all(axis=1)]
    if not len(crossing):
        return Polygon()
    up = crossing[:, :, 2] > height
    lone = np.where(up.sum(axis=1) == 1, up.argmax(axis=1), (~up).argmax(axis=1))  # the corner on its own side
    rows = np.arange(len(crossing))
    apex = crossing[rows, lone]
    ends = []
    for other in (crossing[rows, (lone + 1) % 3], crossing[rows, (lone + 2) % 3]):
        share = (height - apex[:, 2]) / (other[:, 2] - apex[:, 2])
        ends.append(apex[:, :2] + share[:, None] * (other[:, :2] - apex[:, :2]))
    lines = np.round(np.stack(ends, axis=1) / _SNAP_M) * _SNAP_M
    lines = lines[(lines[:, 0] != lines[:, 1]).any(axis=1)]
    rings = shapely.get_parts(shapely.polygonize(shapely.get_parts(shapely.union_all(shapely.linestrings(lines)))))
    return as_area(shapely.union_all(rings)) if len(rings) else Polygon()


def _box(triangles: NDArray[np.float64]) -> Area:
    """Return the smallest rectangle around a body, seen from above."""
    box = shapely.oriented_envelope(shapely.multipoints(triangles[:, :, :2].reshape(-1, 2)))
    return box if isinstance(box, Polygon) else Polygon()
