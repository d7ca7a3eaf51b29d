"""Bodies of an IFC model as triangles, what they are to a floor, and their cuts by horizontal planes.

Walls, columns, windows, curtain walls and plates are walls. Members, railings, chimneys and proxies are barriers: they
close rooms in some models, as a proxy from a program without walls does, and are read as walls, which is said. A
curtain wall of members alone, which lost its panels on the way, is closed between them. All other elements that stand
in a cut, such as stairs and furniture, are counted.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.readers.ifc_floors import BARRIER, DOOR, DOORWAY, PASSAGE, SPACE, UNREAD, WALL, Piece
from pipeline.floorplans.readers.ifc_levels import Level, Levels, entities
from pipeline.floorplans.readers.json_file import short_text
from pipeline.floorplans.walls import Area, as_area

CUT_M = 1.1
_MOST_TRIANGLES = 5_000_000
_MOST_UNREAD = 1_000  # bodies that are only counted
_SILL_M = 0.3  # an opening that begins higher above the floor is a window
_PANEL_M = 1.5  # members of a curtain wall no further apart had a panel between them
_SNAP_M = 1e-4  # ends of cuts closer than this are one corner
_ROLES = (
    (WALL, ("IfcWall", "IfcColumn", "IfcWindow", "IfcCurtainWall", "IfcPlate")),
    (BARRIER, ("IfcMember", "IfcRailing", "IfcChimney", "IfcBuildingElementProxy")),
    (DOOR, ("IfcDoor",)),
    (PASSAGE, ("IfcOpeningElement",)),
    (DOORWAY, ("IfcOpeningElement",)),
    (SPACE, ("IfcSpace",)),
)
_OPENINGS = (PASSAGE, DOORWAY)
_READ = tuple(kind for _, kinds in _ROLES for kind in kinds)
# Neither obstacles nor bodies of their own: holes, limits of rooms, steel within concrete.
_NO_BODIES = (
    *("IfcFeatureElement", "IfcVirtualElement"),
    *("IfcReinforcingElement", "IfcReinforcingBar", "IfcReinforcingMesh"),
)


class Cuts(NamedTuple):
    """pieces: what is cut above each level. inhabited: levels with bodies of their own. left_out: not to be built."""

    pieces: list[list[Piece]]
    inhabited: frozenset[int]
    left_out: int


def cut_bodies(model: Any, levels: Levels) -> Cuts:
    """Return what is cut above each level of what a floor is made of.

    Raises:
        PlanError: too many triangles.
    """
    pieces: list[list[Piece]] = [[] for _ in levels.levels]
    left, left_out = _MOST_TRIANGLES, 0
    inhabited = {levels.home(slab).level for slab in entities(model, "IfcSlab") if _is_floor(slab)}
    for role, kinds in _ROLES:
        products = [each for kind in kinds for each in entities(model, kind)]
        if role in _OPENINGS:
            products = [each for each in products if _role_of_opening(each) == role]
        for product, triangles in _meshes(products):
            left -= len(triangles)
            if left < 0:
                raise PlanError(f"more than {_MOST_TRIANGLES:,} triangles, at most that many are read.")
            if role != BARRIER:
                inhabited.add(levels.home(product).level)
            whole = _cut(role, product, triangles, levels, pieces)
            left_out += not (whole and len(triangles))
    for found in pieces:
        found += _panels(found)
    return Cuts(pieces, frozenset(inhabited - {-1}), left_out)


def cut_unread(model: Any, levels: Levels, pieces: list[list[Piece]]) -> int:
    """Add to ``pieces`` the elements in each cut whose class is not read; return how many were not looked at."""
    skipped = {each.id() for kind in (*_READ, *_NO_BODIES) for each in entities(model, kind)}
    others = [each for each in entities(model, "IfcElement") if each.id() not in skipped and _has_body(each)]
    left = _MOST_TRIANGLES
    for count, (product, triangles) in enumerate(_meshes(others[:_MOST_UNREAD])):
        left -= len(triangles)
        if left < 0:
            return len(others) - count
        _cut(UNREAD, product, triangles, levels, pieces)
    return max(0, len(others) - _MOST_UNREAD)


def _cut(role: str, product: Any, triangles: NDArray[np.float64], levels: Levels, pieces: list[list[Piece]]) -> bool:
    """Add to ``pieces`` what the planes of the levels of its building cut out of a body; return whether all gave areas.

    A body that is not closed gives none.
    """
    whole = True
    home = levels.home(product)
    low, high = triangles[:, :, 2].min(initial=np.inf), triangles[:, :, 2].max(initial=-np.inf)
    for level, found in zip(levels.levels, pieces, strict=True):
        if -1 not in (home.building, level.building) and home.building != level.building:
            continue
        if _crosses(role, low, high, level):
            area = _box(triangles) if role == DOOR else _section(triangles, level.elevation + CUT_M)
            if not area.is_empty or role == UNREAD:
                label = short_text(product.LongName or product.Name or "") if role == SPACE else ""
                found.append(Piece(role, product.is_a(), home, area, label, _curtain_wall_of(product)))
            else:
                whole = False
    return whole


def _crosses(role: str, low: float, high: float, level: Level) -> bool:
    return bool(low < level.elevation + (_SILL_M if role in _OPENINGS else CUT_M) and level.elevation + CUT_M < high)


def _panels(cut: Sequence[Piece]) -> list[Piece]:
    """Return what closes the curtain walls in a cut that show members and nothing else."""
    parts: dict[int, list[Piece]] = {}
    for piece in cut:
        if piece.part_of:
            parts.setdefault(piece.part_of, []).append(piece)
    closed = []
    for members in parts.values():
        if len(members) > 1 and all(piece.kind == "IfcMember" for piece in members):
            bare = shapely.union_all([piece.area for piece in members])
            grown = shapely.buffer(bare, _PANEL_M / 2, join_style="mitre")
            between = shapely.difference(shapely.buffer(grown, -_PANEL_M / 2, join_style="mitre"), bare)
            closed.append(Piece(BARRIER, "IfcCurtainWall", members[0].home, as_area(between)))
    return [piece for piece in closed if not piece.area.is_empty]


def _curtain_wall_of(product: Any) -> int:
    """Return the id of the curtain wall that a product is a part of, 0 for none."""
    wholes = [getattr(each, "RelatingObject", None) for each in getattr(product, "Decomposes", None) or ()]
    return next((whole.id() for whole in wholes if whole is not None and whole.is_a("IfcCurtainWall")), 0)


def _has_body(product: Any) -> bool:
    return getattr(product, "Representation", None) is not None


def _is_floor(slab: Any) -> bool:
    return str(getattr(slab, "PredefinedType", "")) not in ("ROOF", "LANDING")


def _role_of_opening(opening: Any) -> str:
    """Return "doorway" for an opening with a door in a wall, "passage" where nothing with a body stands, else ""."""
    if "recess" in f"{getattr(opening, 'PredefinedType', '')} {opening.ObjectType}".lower():
        return ""
    if not any(relation.RelatingBuildingElement.is_a("IfcWall") for relation in opening.VoidsElements):
        return ""
    fillings = [relation.RelatedBuildingElement for relation in opening.HasFillings]
    if not all(filling.is_a("IfcDoor") for filling in fillings):
        return ""
    return DOORWAY if any(_has_body(filling) for filling in fillings) else PASSAGE


def _meshes(products: Sequence[Any]) -> Iterator[tuple[Any, NDArray[np.float64]]]:
    """Yield each product that has a body, with its triangles [k, 3, 3] in metres; none where it cannot be built."""
    import ifcopenshell.geom

    kernel: Any = ifcopenshell.geom
    settings = kernel.settings()
    settings.set("use-world-coords", True)
    settings.set("disable-opening-subtractions", True)
    for product in filter(_has_body, products):
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
        # Always from the end above: the two triangles at an edge must find the very same point, or no ring closes.
        falls = (apex[:, 2] > height)[:, None]
        top, foot = np.where(falls, apex, other), np.where(falls, other, apex)
        share = (height - foot[:, 2]) / (top[:, 2] - foot[:, 2])
        ends.append(foot[:, :2] + share[:, None] * (top[:, :2] - foot[:, :2]))
    lines = np.round(np.stack(ends, axis=1) / _SNAP_M) * _SNAP_M
    lines = lines[(lines[:, 0] != lines[:, 1]).any(axis=1)]
    rings = shapely.get_parts(shapely.polygonize(shapely.get_parts(shapely.union_all(shapely.linestrings(lines)))))
    return as_area(shapely.union_all(rings)) if len(rings) else Polygon()


def _box(triangles: NDArray[np.float64]) -> Area:
    """Return the smallest rectangle around a body, seen from above."""
    box = shapely.oriented_envelope(shapely.multipoints(triangles[:, :, :2].reshape(-1, 2)))
    return box if isinstance(box, Polygon) else Polygon()
