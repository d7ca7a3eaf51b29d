"""SVG drawings whose shapes carry classes, as CubiCasa5k: Wall, Door, Window, Railing and "Space <type>" for rooms.

The class stands on a group or on a shape, in ``class``, ``id`` or Inkscape's layer label. A door inside a wall group is
a door; groups inside a door, window or room that have a class of their own (panels, labels, handles) are not drawn.
Windows and railings are walls. A group of class "Floorplan <level>" is a floor of its own, even when it is hidden.

y points down and is turned over. There is no scale: ``metres_per_unit`` is needed, in user units of the drawing.
Filled shapes are areas by the even-odd rule; with ``fill`` none, and open lines, are walls ``wall_m`` thick. Of a style
sheet only the classes without fill are read. Copies by ``<use>`` are left out, and counted in a remark.

The tree is parsed by defusedxml, which refuses entity bombs; svgelements reads only single paths and transforms.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree.ElementTree import Element, ParseError

import numpy as np
import shapely
from defusedxml import ElementTree
from defusedxml.common import DefusedXmlException
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers.drawing import LARGEST_UNIT, PARSER_ERRORS, Drawing, is_any_of, plan_of, scale_of
from pipeline.floorplans.readers.json_file import short_name, short_text, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.rooms import say_repaired

if TYPE_CHECKING:
    from svgelements import Matrix

WALLS = ("wall", "walls", "wall[-_]*", "*[-_]wall", "*[-_]walls")
DOORS = ("door", "doors", "door[-_]*", "*[-_]door", "*[-_]doors", "opening*")
SOLID = ("window*", "railing*")
_SHAPES = ("polygon", "polyline", "rect", "line", "path", "circle", "ellipse")
_NOT_DRAWN = ("defs", "symbol", "clippath", "mask", "pattern", "marker", "text", "style", "metadata", "title", "desc")
_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
_HIDDEN = re.compile(r"display\s*:\s*none")
_UNLIKELY = re.compile(r"[\d.]{60}")
_FILL = re.compile(r"(?:^|;)\s*fill\s*:\s*([^;]+)")
_PROLOGUE = re.compile(r"<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>\[]*(?:\[.*?\]\s*)?>", re.DOTALL)
_PARTS = frozenset(("Threshold", "Panel", "PanelArea", "Glass"))  # of a door or window, never one themselves
_MOST_BYTES = 30_000_000
_MOST_ELEMENTS = 300_000
_DEEPEST = 100
_CURVE_STEPS = 12


class _Place(NamedTuple):
    """Where in the tree we are. kind: "wall", "door", "room" or "". label: of a room. level: of the floor."""

    element: Element
    matrix: "Matrix"
    kind: str
    label: str
    level: str
    filled: bool
    depth: int


@dataclass
class _Found:
    """The floors by level, the classes without fill, and how many parts were left out."""

    levels: dict[str, Drawing] = field(default_factory=dict)
    unfilled: frozenset[str] = frozenset()
    copies: int = 0
    damaged: int = 0


@dataclass(frozen=True)
class Svg:
    """Reader of floors drawn as SVG; a file is a building."""

    name: str = "svg"
    patterns: tuple[str, ...] = ("*.svg",)
    uses: tuple[str, ...] = ("metres_per_unit", "levels", "wall_m", "wall_layers", "door_layers")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` begins as SVG."""
        return re.match(r"\s*<(?:\w+:)?svg[\s>]", _PROLOGUE.sub("", sniff_text(path))) is not None

    def accompanies(self, path: Path) -> bool:
        """Return False: a drawing is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the floors; see `Reader.read`. Uses scale, levels, thickness of walls, and layers as classes."""
        found = _walk(path, _parse(path), options)
        levels = {level: drawing for level, drawing in found.levels.items() if drawing.walls or drawing.rooms}
        if not levels:
            raise PlanError(
                f"{path}: no shape of a class {', '.join(options.wall_layers or WALLS[:2])} or Space. "
                "Name the classes of the walls in plans.read.wall_layers."
            )
        for level, drawing in levels.items():
            if options.levels and not {level, level.rpartition("-")[2]} & {*options.levels}:
                continue
            if found.copies:
                drawing.remarks.append(f"{found.copies} copies by <use> were left out")
            if found.damaged:
                drawing.remarks.append(f"{found.damaged} shapes could not be read and were left out")
            plan_id = f"{path.stem}.{level}" if len(levels) > 1 else path.stem
            crossed = sum(not shape.is_valid for shape in [*drawing.walls, *(outline for outline, _ in drawing.rooms)])
            if crossed:
                drawing.remarks.append(say_repaired(crossed))
            try:
                scale = scale_of(str(path), drawing, options)
                yield plan_of(
                    drawing, scale, options, plan_id=plan_id, building=path.stem, environment="svg_plans", path=path
                )
            except PlanError as problem:
                yield problem


def _parse(path: Path) -> Element:
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise PlanError(f"{path}: more than {_MOST_BYTES:,} bytes, at most that many are read. Simplify it.")
        root = ElementTree.parse(path).getroot()
    except DefusedXmlException as problem:
        raise PlanError(f"{path}: declares XML entities, which are not read. Save it without them.") from problem
    except (OSError, ParseError, ValueError, LookupError) as problem:
        raise PlanError(f"{path}: not whole XML ({short_text(str(problem))}). Get the file again.") from problem
    if root is None:
        raise PlanError(f"{path}: an empty document, expected a drawing. Get the file again.")
    return root


def _walk(path: Path, root: Element, options: ReadOptions) -> _Found:
    """Collect the shapes of every floor, without recursion."""
    from svgelements import Matrix

    found, count = _Found(unfilled=_unfilled(root)), 0
    stack = [_Place(root, Matrix(), "", "", "", True, 0)]
    while stack:
        place = stack.pop()
        count += 1
        if count > _MOST_ELEMENTS or place.depth > _DEEPEST:
            raise PlanError(f"{path}: more than {_MOST_ELEMENTS:,} elements or {_DEEPEST} groups in each other.")
        tag = _tag(place.element)
        if tag == "use":
            found.copies += 1
        elif tag in _SHAPES and place.kind:
            _add_shape(found, place, tag)
        elif tag not in _NOT_DRAWN:
            stack += [inner for child in reversed(place.element) if (inner := _enter(found, place, child, options))]
    return found


def _enter(found: _Found, outer: _Place, child: Element, options: ReadOptions) -> _Place | None:
    """Return the place of a child; None where it is not drawn."""
    from svgelements import Matrix

    if not isinstance(child.tag, str):  # a comment
        return None
    names = [child.get(key, "").split() for key in ("class", "id", _LABEL)]
    classes = [name for part in names for name in part]
    is_floor = "Floorplan" in classes
    hidden = child.get("display") == "none" or _HIDDEN.search(child.get("style", ""))
    if hidden and not (is_floor or "Floor" in classes):
        return None
    kind, label = _kind(names, options)
    if not kind:
        own = bool(child.get("class") or _PARTS.intersection(classes)) and _tag(child) not in _SHAPES
        kind, label = ("", "") if own and outer.kind in ("door", "room", "solid") else (outer.kind, outer.label)
    matrix = outer.matrix
    if child.get("transform"):
        try:
            _check_numbers(child.get("transform", ""))
            matrix = Matrix(child.get("transform")) * outer.matrix
        except PARSER_ERRORS:  # one shape must not end the file
            found.damaged += 1
            return None
    level = next((name for name in classes if name.startswith("Floor-")), child.get("id", ""))
    level = short_name(level) if is_floor else outer.level
    fill = _FILL.search(child.get("style", ""))
    paint = fill[1].strip() if fill else "none" if found.unfilled.intersection(names[0]) else child.get("fill", "")
    filled = paint != "none" if paint else outer.filled
    return _Place(child, matrix, kind, label, level, filled, outer.depth + 1)


def _check_numbers(text: str) -> None:
    """Refuse what takes svgelements minutes: it tries every way to part a long row of digits in two.

    Raises:
        ValueError: no drawing has such numbers.
    """
    if _UNLIKELY.search(text):
        raise ValueError(f"a number of more digits than any drawing has: {short_text(text)}")


def _kind(names: list[list[str]], options: ReadOptions) -> tuple[str, str]:
    """Return what classes, id and label of an element stand for, and the label of a room."""
    for part in names:
        if "Space" in part:
            label = " ".join(part[part.index("Space") + 1 :])
            return ("", "") if label.startswith("Outdoor") else ("room", short_text(label))
    classes = [name for part in names for name in part]
    for kind, patterns in (("door", options.door_layers or DOORS), ("wall", options.wall_layers or WALLS)):
        if any(is_any_of(name, patterns) for name in classes):
            return kind, ""
    return ("solid", "") if any(is_any_of(name, SOLID) for name in classes) else ("", "")


def _unfilled(root: Element) -> frozenset[str]:
    """Return the classes that a style sheet of the drawing leaves without fill."""
    sheets = [element.text or "" for element in root.iter() if _tag(element) == "style"]
    rules = [block.partition("{")[::2] for sheet in sheets for block in sheet.split("}")]
    without = [selectors for selectors, sets in rules if (fill := _FILL.search(sets)) and fill[1].strip() == "none"]
    return frozenset(name.strip()[1:] for names in without for name in names.split(",") if name.strip()[:1] == ".")


def _add_shape(found: _Found, place: _Place, tag: str) -> None:
    drawing = found.levels.setdefault(place.level, Drawing())
    try:
        shape = _shape(place, tag)
    except PARSER_ERRORS:  # see _enter
        shape = None
    if shape is None or shape.is_empty or not (np.abs(shapely.get_coordinates(shape)) <= LARGEST_UNIT).all():
        found.damaged += 1
    elif place.kind == "room":
        if shapely.get_dimensions(shape) == 2:
            drawing.rooms.append((shape, place.label))
    else:
        (drawing.openings if place.kind == "door" else drawing.walls).append(shape)


def _shape(place: _Place, tag: str) -> BaseGeometry | None:
    """Return a shape in user units, y up; None for one without extent."""
    import svgelements

    attributes = {key: value for key, value in place.element.attrib.items() if key not in ("transform", "id", "style")}
    _check_numbers(" ".join(attributes.values()))
    maker = {
        "polygon": svgelements.Polygon,
        "polyline": svgelements.Polyline,
        "rect": svgelements.Rect,
        "line": svgelements.SimpleLine,
        "circle": svgelements.Circle,
        "ellipse": svgelements.Ellipse,
    }
    if tag == "path":
        outline = svgelements.Path(attributes.get("d", ""))
    elif tag in ("polygon", "polyline"):
        outline = svgelements.Path(maker[tag](attributes.get("points", "")))
    else:
        outline = svgelements.Path(maker[tag](attributes))
    lines, rings = [], []
    for part in (outline * place.matrix).as_subpaths():
        corners = _corners(part)
        closed = tag == "polygon" or any(isinstance(segment, svgelements.Close) for segment in part)
        closed = closed or (place.kind != "wall" and len(corners) > 3 and (corners[0] == corners[-1]).all())
        if closed and (place.filled or place.kind in ("door", "room")) and len(corners) > 2:
            rings.append(shapely.polygons(corners))
        elif len(corners) > 1:
            lines.append(shapely.linestrings(np.concatenate([corners, corners[:1]]) if closed else corners))
    if rings:
        return shapely.symmetric_difference_all(rings) if len(rings) > 1 else rings[0]
    return shapely.multilinestrings(lines) if lines else None


def _corners(part: Iterable[Any]) -> NDArray[np.float64]:
    """Return the corners of a subpath [points, xy], y up, curves as short lines."""
    from svgelements import Close, Line, Move

    corners: list[tuple[float, float]] = []
    for segment in part:
        steps = (1.0,) if isinstance(segment, Move | Line | Close) else np.linspace(0, 1, _CURVE_STEPS + 1)[1:]
        for step in steps:
            point = segment.end if step == 1.0 else segment.point(float(step))
            if point is not None:
                corners.append((float(point.x), -float(point.y)))
    kept = [corner for k, corner in enumerate(corners) if k == 0 or corner != corners[k - 1]]
    return np.array(kept, dtype=np.float64).reshape(-1, 2)


def _tag(element: Element) -> str:
    return element.tag.rpartition("}")[2].lower() if isinstance(element.tag, str) else ""
