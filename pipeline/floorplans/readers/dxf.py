"""DXF drawings: walls and doors by the names of their layers.

Walls are the lines, polylines, arcs and circles of the layers of walls and windows, ``wall_m`` thick; a wall drawn by
both faces is filled (`pipeline.floorplans.walls`). A closed polyline is a line too: it may as well outline a room as a
pillar. Layers of hatches, dimensions and tags are passed over.

What touches on the door layers is one door. An arc is the swing of a leaf: the doorway runs from its centre to the end
of the arc that lies in a wall, or nearest to one; the other end is where the open leaf stands. A door without an arc is
as wide as the longer side of its box. Doorways are cut through walls that were drawn across them.

The unit is ``$INSUNITS`` of the header; ``metres_per_unit`` replaces it, and is needed where it is unset.
"""

import logging
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.errors import GEOSException
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers.drawing import LARGEST_UNIT, PARSER_ERRORS, Drawing, is_any_of, plan_of, scale_of
from pipeline.floorplans.readers.json_file import short_text, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.walls import door_of

if TYPE_CHECKING:
    from ezdxf.document import Drawing as Document

WALLS = ("*wall*", "*wand*", "*wände*", "*waende*", "*mur", "*mur[-_ ]*", "*murs*", "*pared*", "*muro*")
DOORS = ("*door*", "*tuer*", "*tür*", "*porte*", "*puerta*", "*porta*")
WINDOWS = ("*window*", "*glaz*", "*fenster*", "*fen[eê]tre*", "*ventana*", "*finestr*")
_NO_DOORS = ("*indoor*", "*outdoor*", "*imported*", "*exported*", "*supported*", "*porteu*", "*portal*")
_MARKS = ("*patt*", "*hatch*", "*fill*", "*anno*", "*dims*", "*text*", "*ceil*", "*iden*", "*[-_ ]tag*")
_LINES = ("LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE")
logging.getLogger("ezdxf").addHandler(logging.NullHandler())  # what matters is in the error or in the remarks

_BINARY = "AutoCAD Binary DXF"
_MOST_BYTES = 200_000_000
_MOST_ENTITIES = 300_000
_DEEPEST_BLOCK = 6
_CURVE_STEPS = 8  # per curve of up to a quarter turn
_SWING_DEG = (20.0, 200.0)
_TOUCH_M = 0.02
_IN_WALL_M = 0.02  # a line no further than this from a wall line lies in the wall
_LEAF_M = 0.06  # a leaf is drawn as a line or a box no further than this from the end of its swing
_JAMB_M = 0.15  # the end of a doorway is no further from the wall that it meets
_WIDTHS_M = (0.4, 6.0)


@dataclass
class _Found:
    """The shapes of wall and door layers in drawing units, y up.

    arcs: swings of door leaves as centre, start and end. layers: all layer names met. left_out: entities by kind.
    """

    walls: list[BaseGeometry] = field(default_factory=list)
    doors: list[BaseGeometry] = field(default_factory=list)
    arcs: list[tuple[tuple[float, float], tuple[float, float], tuple[float, float]]] = field(default_factory=list)
    layers: set[str] = field(default_factory=set)
    left_out: dict[str, int] = field(default_factory=dict)
    damaged_blocks: int = 0
    entities: int = 0

    def leave_out(self, kind: str) -> None:
        """Count an entity that is not used."""
        self.left_out[kind] = self.left_out.get(kind, 0) + 1


@dataclass(frozen=True)
class Dxf:
    """Reader of one floor per DXF file; the file is the building."""

    name: str = "dxf"
    patterns: tuple[str, ...] = ("*.dxf",)
    uses: tuple[str, ...] = ("metres_per_unit", "wall_m", "wall_layers", "door_layers")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` begins with a section of DXF, as text or binary."""
        text = sniff_text(path)
        return text.startswith(_BINARY) or re.match(r"(?:\s*999\s*\n.*\n)*\s*0\s*\n\s*SECTION\s*\n", text) is not None

    def accompanies(self, path: Path) -> bool:
        """Return False: a drawing is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the plan in model space; see `Reader.read`. Uses scale, thickness of walls and layers."""
        from ezdxf.lldxf.const import DXFError

        document = _load(path)
        found = _Found()
        try:
            _collect(found, document.modelspace(), options, layer=None, depth=0)
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem
        except DXFError as problem:  # an entity that has not what every entity has
            raise PlanError(f"{path}: damaged DXF ({short_text(str(problem))}). Export it again.") from problem
        if not found.walls:
            names = ", ".join(short_text(name) for name in sorted(found.layers)[:20]) or "none"
            raise PlanError(
                f"{path}: no wall on layers {', '.join(options.wall_layers or WALLS[:1])}; it has {names}. "
                "Name the layers of the walls in plans.read.wall_layers."
            )
        remarks = [f"{count} {kind} on wall or door layers were left out" for kind, count in found.left_out.items()]
        if found.damaged_blocks:
            remarks.append(f"{found.damaged_blocks} blocks are damaged: what could not be read of them was left out")
        drawing = Drawing(walls=found.walls, remarks=remarks)
        scale = _scale(path, document, found, drawing, options)
        try:
            drawing.openings = _doorways(found, scale)
        except GEOSException as problem:
            raise PlanError(f"{path}: the doors cannot be combined ({problem}). Simplify the drawing.") from problem
        unlikely = [opening for opening in drawing.openings if not _is_doorway(opening, scale)]
        drawing.openings = [opening for opening in drawing.openings if _is_doorway(opening, scale)]
        if unlikely:
            drawing.remarks.append(f"{len(unlikely)} doors are not {_WIDTHS_M[0]} to {_WIDTHS_M[1]} m wide: left out")
        yield plan_of(
            drawing, scale, options, plan_id=path.stem, building=path.stem, environment="dxf_plans", path=path
        )


def _damage() -> tuple[type[Exception], ...]:
    """Return what ezdxf raises on damaged text: errors of its own, and of Python many kinds; the last at its end."""
    from ezdxf.lldxf.const import DXFError

    return (DXFError, *PARSER_ERRORS, StopIteration)


def _load(path: Path) -> "Document":
    from ezdxf.filemanagement import readfile

    try:
        if path.stat().st_size > _MOST_BYTES:
            raise PlanError(f"{path}: more than {_MOST_BYTES:,} bytes, at most that many are read. Simplify it.")
        document = readfile(path)
        document.modelspace()  # raises where the file has none
        return document
    except PlanError:
        raise
    except OSError as problem:
        raise PlanError(f"{path}: not a readable DXF file ({short_text(str(problem))}).") from problem
    except _damage() as problem:
        raise PlanError(
            f"{path}: damaged DXF ({type(problem).__name__}: {short_text(str(problem))}). Export it again."
        ) from problem


def _collect(
    found: _Found, entities: Iterable[Any], options: ReadOptions, *, layer: str | None, depth: int, door: bool = False
) -> None:
    """Collect the shapes of ``entities``; those of a block on layer 0 belong to the ``layer`` it is put on."""
    for entity in entities:
        found.entities += 1
        if found.entities > _MOST_ENTITIES:
            raise PlanError(f"more than {_MOST_ENTITIES:,} entities with those of blocks. Simplify the drawing.")
        own = _name_in(entity, "layer", "0")
        name = layer if own == "0" and layer is not None else own
        found.layers.add(name)
        kind = entity.dxftype()
        if kind == "INSERT":
            is_door = door or _is_door_name(_name_in(entity, "name", ""), options)
            if depth < _DEEPEST_BLOCK:
                _collect(found, _parts(found, entity), options, layer=name, depth=depth + 1, door=is_door)
        elif door or _is_door_name(name, options):
            _add(found, entity, kind, found.doors)
        elif _is_wall_layer(name, options):
            _add(found, entity, kind, found.walls)


def _name_in(entity: Any, key: str, default: str) -> str:
    """Return the name of a layer or block; entities of kinds that ezdxf does not know have none."""
    try:
        return str(entity.dxf.get(key, default))
    except _damage():
        return default


def _parts(found: _Found, insert: Any) -> Iterator[Any]:
    """Yield what a block puts into the drawing, copy by copy; a damaged block ends early and is counted."""
    try:
        if insert.mcount > _MOST_ENTITIES:
            raise PlanError(f"a block is put {insert.mcount:,} times. Simplify the drawing.")
        for copy in insert.multi_insert() if insert.mcount > 1 else (insert,):
            yield from copy.virtual_entities()
    except PlanError:
        raise
    except _damage():
        found.damaged_blocks += 1


def _is_door_name(name: str, options: ReadOptions) -> bool:
    if options.door_layers:
        return is_any_of(name, options.door_layers)
    return is_any_of(name, DOORS) and not is_any_of(name, (*_NO_DOORS, *_MARKS))


def _is_wall_layer(name: str, options: ReadOptions) -> bool:
    if options.wall_layers:
        return is_any_of(name, options.wall_layers)
    return is_any_of(name, (*WALLS, *WINDOWS)) and not is_any_of(name, _MARKS)


def _add(found: _Found, entity: Any, kind: str, shapes: list[BaseGeometry]) -> None:
    if kind not in _LINES:
        found.leave_out(kind)
        return
    try:
        shape = _line(entity)
        arcs = [entity] if kind == "ARC" else _bulges(entity, kind) if shapes is found.doors else []
        swings = [swing for arc in arcs if shapes is found.doors and (swing := _swing(arc)) is not None]
    except _damage():
        shape, swings = None, []
    if shape is None or not (np.abs(shapely.get_coordinates(shape)) <= LARGEST_UNIT).all():
        found.leave_out(f"damaged {kind}")
        return
    shapes.append(shape)
    found.arcs += swings


def _line(entity: Any) -> LineString | None:
    """Return an entity as a line in world coordinates, curves as short pieces; None without extent."""
    from ezdxf.path import make_path

    corners = np.array([(point.x, point.y) for point in make_path(entity).approximate(_CURVE_STEPS)])
    if len(corners) < 2 or not np.ptp(corners, axis=0).any():
        return None
    return LineString(corners)


def _bulges(entity: Any, kind: str) -> list[Any]:
    """Return the arcs within a polyline."""
    if kind not in ("LWPOLYLINE", "POLYLINE"):
        return []
    return [part for part in entity.virtual_entities() if part.dxftype() == "ARC"]


def _swing(arc: Any) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]] | None:
    """Return centre, start and end of an arc that may be the swing of a leaf."""
    turn = (float(arc.dxf.end_angle) - float(arc.dxf.start_angle)) % 360
    if not _SWING_DEG[0] <= turn <= _SWING_DEG[1]:
        return None
    centre = arc.ocs().to_wcs(arc.dxf.center)
    start, end = arc.start_point, arc.end_point
    return (centre.x, centre.y), (start.x, start.y), (end.x, end.y)


def _scale(path: Path, document: "Document", found: _Found, drawing: Drawing, options: ReadOptions) -> float:
    """Return metres per drawing unit, from a person or from the header."""
    from ezdxf.enums import InsertUnits
    from ezdxf.units import conversion_factor

    try:
        unit = int(document.header.get("$INSUNITS", 0))
        stated = conversion_factor(InsertUnits(unit), InsertUnits.Meters) if unit else None
    except (ValueError, TypeError, KeyError, ArithmeticError):
        stated = None
    if stated is None or options.metres_per_unit is not None:
        radii = [LineString((centre, start)) for centre, start, _ in found.arcs]
        scale = scale_of(str(path), Drawing(openings=[*radii]), options)
        if stated is not None and abs(scale / stated - 1) > 1e-6:
            drawing.remarks.append(f"the header states {stated:g} m per unit, {scale:g} m was asked for and taken")
        return scale
    return float(stated)


def _doorways(found: _Found, scale: float) -> list[BaseGeometry]:
    """Return a line from jamb to jamb for every door, in drawing units."""
    walls = shapely.multilinestrings(
        [part for wall in found.walls for part in shapely.get_parts(wall) if not part.is_empty]
    )
    shapely.prepare(walls)
    touch = _TOUCH_M / scale
    doorways: list[BaseGeometry] = []
    shapes = np.array(found.doors, dtype=object)
    tree = shapely.STRtree(shapes)
    for centre, start, end in found.arcs:
        doorways.append(_doorway(walls, tree, LineString((centre, start)), LineString((centre, end)), scale))
    swings = shapely.multipoints([spot for arc in found.arcs for spot in arc]) if found.arcs else None
    clusters = shapely.get_parts(shapely.union_all(shapely.buffer(shapes, touch, quad_segs=2)))
    for cluster in clusters:
        if swings is not None and shapely.distance(cluster, swings) <= touch:
            continue  # the leaf or the frame of a door whose arc has told the doorway
        members = shapely.multilinestrings(shapes[tree.query(cluster, predicate="intersects")].tolist())
        corners = shapely.get_coordinates(shapely.oriented_envelope(members))
        doorways.append(_middle_line(corners) if len(corners) >= 4 else LineString(corners))
    return doorways


def _doorway(
    walls: BaseGeometry, doors: shapely.STRtree, one: LineString, other: LineString, scale: float
) -> LineString:
    """Return which of the two ends of a swing is the doorway, and not the open leaf.

    A wall drawn across the door tells it: one line lies in that wall. Else one line bridges the gap between two jambs;
    the open leaf may stand along another wall, but not on it. Where these say nothing, or each another, the leaf is the
    line that is drawn. Else the doorway is the line that is nearer to walls.
    """
    lines = one, other
    spots = [shapely.line_interpolate_point(line, np.linspace(0.0, 1.0, 11), normalized=True) for line in lines]
    away = [shapely.distance(along, walls) * scale for along in spots]
    nearer = 0 if away[0].mean() <= away[1].mean() else 1
    in_wall = bool(away[nearer].mean() <= _IN_WALL_M)
    bridges = [
        bool(max(distance[0], distance[-1]) < _JAMB_M < distance[5] and distance[3:8].min() > _JAMB_M / 2)
        for distance in away
    ]
    if in_wall and not bridges[1 - nearer]:
        return lines[nearer]
    if not in_wall and bridges[0] != bridges[1]:
        return lines[bridges.index(True)]
    drawn = [
        len(np.unique(doors.query(along[3:8], predicate="dwithin", distance=_LEAF_M / scale)[0])) == 5
        for along in spots
    ]
    return lines[drawn.index(False)] if drawn[0] != drawn[1] else lines[nearer]


def _middle_line(corners: NDArray[np.float64]) -> LineString:
    """Return the line through the middle of a box, along its longer side."""
    a, b, c, d = corners[:4]
    if np.hypot(*(b - a)) < np.hypot(*(c - b)):
        a, b, c, d = b, c, d, a
    return LineString([(a + d) / 2, (b + c) / 2])


def _is_doorway(opening: BaseGeometry, scale: float) -> bool:
    return _WIDTHS_M[0] <= door_of(opening).width * scale <= _WIDTHS_M[1]
