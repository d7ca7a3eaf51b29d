"""The tree of an SVG drawing, walked as a viewer draws it: where each shape lies, how it looks and what clips it.

Transforms of groups, shapes, nested drawings and copies are composed on the way down, those of ``style`` included; so
are clip paths, and the viewports of nested drawings and symbols, which cut off what hangs out. The outermost drawing
keeps its user units: its view box only says what shares of 100 % are taken of, and cuts nothing off.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon, box

from pipeline.errors import PlanError
from pipeline.floorplans.readers.drawing import LARGEST_UNIT, PARSER_ERRORS
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.readers.svg_areas import filled
from pipeline.floorplans.readers.svg_meaning import Meaning, meaning_of, tag_of
from pipeline.floorplans.readers.svg_paint import is_switched_off, is_visible
from pipeline.floorplans.readers.svg_shapes import SHAPES, outlines_of
from pipeline.floorplans.readers.svg_style import Styles, inherited, resolved
from pipeline.floorplans.readers.svg_units import (
    Matrix,
    Viewport,
    fitted,
    length,
    moved,
    origin_of,
    transform_of,
    view_box,
)
from pipeline.floorplans.walls import Area, as_area

_NOT_DRAWN = ("defs", "symbol", "clippath", "mask", "pattern", "marker", "text", "style", "metadata", "title", "desc")
_LINK = "{http://www.w3.org/1999/xlink}href"
_MOST_ELEMENTS = 300_000
_MOST_COPIES = 30_000
_DEEPEST = 100
_CORNERS_AS_ELEMENT = 20  # of a clip path: applying it takes as long as walking over this many elements
_TRANSFORMS = frozenset(("transform", "translate", "rotate", "scale"))
_CUTTING = frozenset(("clip-path", "mask"))
_UPRIGHT = Matrix(d=-1.0)  # y down to y up


class Place(NamedTuple):
    """Where in the tree we are.

    matrix: from user units here to those of the drawing, y up. style: as `svg_style.inherited`. viewport: what shares
    are taken of. clip: what may be seen, in units of the drawing, y up; None: everything. via: the elements that are
    being copied or clip here, so that none does within itself.
    """

    element: Element
    said: Mapping[str, str]
    matrix: Matrix
    meaning: Meaning
    style: Mapping[str, str]
    viewport: Viewport
    hidden: bool = False
    clip: Area | None = None
    depth: int = 0
    via: frozenset[int] = frozenset()


@dataclass
class Tally:
    """How much was left out. astray: copies of nothing in the file. unclipped: clip paths and masks not applied.

    pictures: ``<image>`` that stand for a wall, door or room.
    """

    hidden: int = 0
    damaged: int = 0
    astray: int = 0
    unclipped: int = 0
    pictures: int = 0


class Tree:
    """The shapes of a drawing. tally: what was left out on the way."""

    def __init__(self, root: Element, options: ReadOptions, name: str) -> None:
        self.tally = Tally()
        self._name = name
        self._root = root
        self._options = options
        self._elements = self._copies = 0
        self._ids: dict[str, Element] = {}
        self._parents: dict[Element, Element] = {}
        for count, element in enumerate(root.iter()):
            if count >= _MOST_ELEMENTS:
                raise PlanError(self._too_large())
            if "id" in element.attrib:
                self._ids.setdefault(element.attrib["id"], element)
            self._parents |= dict.fromkeys(element, element)
        self._clips: dict[int, Area | None] = {}
        self._styles = Styles(root, name)
        self.unread_rules = self._styles.unread

    def shapes(self) -> Iterator[Place]:
        """Yield the place of each shape that stands for something, hidden ones too, in the order of drawing.

        Raises:
            PlanError: too many elements, copies or groups in each other; or a clip path that is a scribble.
        """
        said = resolved(self._styles.of(self._root), {})
        start = Place(self._root, said, _UPRIGHT, Meaning(), inherited({}, said), _outer_viewport(self._root, said))
        try:
            start = start._replace(matrix=_UPRIGHT @ _own_transform(said, start.viewport))
        except PARSER_ERRORS:
            self.tally.damaged += 1
        for place in self._walk(start):
            if place.meaning.kind:
                yield place

    def _walk(self, start: Place) -> Iterator[Place]:
        """Yield the places of all shapes, without recursion."""
        stack = [start]
        while stack:
            place = stack.pop()
            self._spend(1, copies=len(place.via) > 0)
            if place.depth > _DEEPEST:
                raise PlanError(self._too_large())
            tag = tag_of(place.element)
            if tag in SHAPES:
                yield place
            elif tag == "image":
                self.tally.pictures += bool(place.meaning.kind)
            elif tag == "use":
                copied = self._copied(place)
                if copied is not None:
                    stack.append(copied)
            elif tag not in _NOT_DRAWN or place is start or (tag == "symbol" and place.via):
                entered = (self._entered(child, place) for child in reversed(_children(place.element, tag)))
                stack += [inner for inner in entered if inner is not None]

    def _entered(self, child: Element, outer: Place, *, copied: bool = False, use: Place | None = None) -> Place | None:
        """Return the place of a child; None where nothing of it is drawn."""
        tag = tag_of(child)
        if not tag or (tag in _NOT_DRAWN and not copied):
            return None
        said = resolved(self._styles.of(child), outer.style)
        meaning = meaning_of(child, outer.meaning, self._options, copied=copied)
        if meaning.is_floor:  # drawings of several floors show one at a time
            said = {key: value for key, value in said.items() if key not in ("display", "visibility", "opacity")}
        style = inherited(outer.style, said)
        hidden = outer.hidden or is_switched_off(said)
        depth, via = outer.depth + 1, outer.via
        place = Place(child, said, outer.matrix, meaning, style, outer.viewport, hidden, outer.clip, depth, via)
        try:
            if not _TRANSFORMS.isdisjoint(said):
                boxed = said.get("transform-box", "").lower() in ("fill-box", "content-box", "stroke-box")
                around = self._box(place) if boxed else None
                place = place._replace(matrix=outer.matrix @ _own_transform(said, outer.viewport, around))
            if tag == "svg" or (tag == "symbol" and copied):
                place = self._in_viewport(place, use)
        except PARSER_ERRORS:  # one shape must not end the file
            self.tally.damaged += 1
            return None
        return place if _CUTTING.isdisjoint(said) else self._clipped(place)

    def _in_viewport(self, place: Place, use: Place | None) -> Place:
        """Return the place inside a nested drawing or a symbol; ``use`` may give it another size."""
        said, whole = place.said, place.viewport
        sizes = {key: text for key, text in said.items() if key in ("width", "height")}
        sizes |= {key: text for key, text in (use.said if use else {}).items() if key in ("width", "height")}
        x, y = (length(said.get(key, "0"), share) for key, share in zip("xy", whole, strict=True))
        width, height = (
            None if share is None and sizes.get(key, "100%").endswith("%") else length(_no_auto(sizes.get(key)), share)
            for key, share in zip(("width", "height"), whole, strict=True)
        )
        given = place.element.get("viewBox")
        seen = view_box(given) if given is not None else None
        matrix = place.matrix @ moved(x, y)
        if (width is not None and width <= 0) or (height is not None and height <= 0) or (given and seen is None):
            return place._replace(hidden=True)
        if width is None or height is None:  # the drawing does not say: as large as its view box
            return place._replace(matrix=matrix, viewport=seen[2:] if seen else (width, height))
        if said.get("overflow", "hidden") in ("hidden", "scroll", "clip"):
            corners = np.array([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])
            place = place._replace(clip=self._intersection(place.clip, Polygon(matrix.apply(corners))))
        if seen is None:
            return place._replace(matrix=matrix, viewport=(width, height))
        aspect = place.element.get("preserveAspectRatio", "")
        return place._replace(matrix=matrix @ fitted(seen, width, height, aspect), viewport=seen[2:])

    def _copied(self, use: Place) -> Place | None:
        """Return the place of what ``<use>`` names."""
        link = use.element.get("href", use.element.get(_LINK, "")).strip()
        target = self._ids.get(link[1:]) if link.startswith("#") else None
        around: Element | None = use.element
        while around is not None and around is not target:
            around = self._parents.get(around)
        is_drawn = target is not None and (tag_of(target) not in _NOT_DRAWN or tag_of(target) == "symbol")
        if target is None or not is_drawn or around is not None or id(target) in use.via:
            self.tally.astray += 1
            return None
        try:
            x, y = (length(use.said.get(key, "0"), share) for key, share in zip("xy", use.viewport, strict=True))
        except ValueError:
            self.tally.damaged += 1
            return None
        outer = use._replace(matrix=use.matrix @ moved(x, y), via=use.via | {id(target)})
        return self._entered(target, outer, copied=True, use=use)

    def _clipped(self, place: Place) -> Place:
        """Return the place with its ``clip-path`` applied."""
        self.tally.unclipped += place.said.get("mask", "none").lower() != "none"
        value = place.said.get("clip-path", "none").strip()
        if value.lower() in ("none", "inherit", "initial", "unset"):
            return place
        inner = value[4:-1].strip().strip("\"'") if value[:4].lower() == "url(" and value.endswith(")") else ""
        target = self._ids.get(inner[1:]) if inner.startswith("#") else None
        area = self._clip_area(target, place) if target is not None and tag_of(target) == "clippath" else None
        if area is None:
            self.tally.unclipped += 1
            return place
        moved_area = shapely.transform(area, place.matrix.apply)
        return place._replace(clip=self._intersection(place.clip, moved_area))

    def _clip_area(self, element: Element, place: Place) -> Area | None:
        """Return what a ``<clipPath>`` leaves, in user units where it is used; None where it cannot be read."""
        if id(element) in self._clips:
            return self._clips[id(element)]
        if id(element) in place.via:
            return None
        said = self._styles.of(element)
        boxed = element.get("clipPathUnits") == "objectBoundingBox"
        try:
            matrix = _own_transform(said, place.viewport)
            if boxed:
                left, top, width, height = self._box(place)
                matrix = moved(left, top) @ Matrix(a=width, d=height) @ matrix
        except PARSER_ERRORS:
            return None
        via = place.via | {id(element)}
        start = Place(element, said, matrix, Meaning("clip"), inherited({}, said), place.viewport)
        parts: list[Area] = []
        for shape in self._walk(self._clipped(start._replace(depth=place.depth + 1, via=via))):
            if shape.hidden or not is_visible(shape.style):
                continue
            try:
                outlines = outlines_of(tag_of(shape.element), shape.element.attrib, shape.said, shape.viewport)
                rings = [shape.matrix.apply(corners) for corners, _ in outlines if len(corners) > 2]
                nonzero = shape.style.get("clip-rule", "").lower() != "evenodd"
                if rings:
                    area, _ = filled(rings, nonzero=nonzero, name=self._name)
                    parts.append(as_area(self.cut(area, shape.clip)))
            except PARSER_ERRORS:
                self.tally.damaged += 1
        area = as_area(shapely.union_all(parts)) if parts else MultiPolygon()
        if not boxed:
            self._clips[id(element)] = area
        return area

    def _box(self, place: Place) -> tuple[float, float, float, float]:
        """Return left, top, width and height of the box around all shapes in an element, in user units of its own.

        Raises:
            ValueError: there is no shape in it.
        """
        counted = replace(self.tally)
        start = Place(place.element, place.said, Matrix(), Meaning(), place.style, place.viewport)
        found = []
        for shape in self._walk(start._replace(depth=place.depth + 1, via=place.via)):
            outlines = outlines_of(tag_of(shape.element), shape.element.attrib, shape.said, shape.viewport)
            found += [shape.matrix.apply(corners) for corners, _ in outlines]
        self.tally = counted  # what is left out is counted where it is drawn
        corners = np.concatenate(found) if found else np.zeros((0, 2))
        if not len(corners):
            raise ValueError("the box of nothing")
        (left, top), (right, bottom) = corners.min(axis=0), corners.max(axis=0)
        return float(left), float(top), float(right - left), float(bottom - top)

    def _intersection(self, one: Area | None, other: Area) -> Area:
        self._spend(1 + int(shapely.get_num_coordinates(other)) // _CORNERS_AS_ELEMENT)
        if not (np.abs(shapely.get_coordinates(other)) <= LARGEST_UNIT).all():
            return one if one is not None else box(*[-LARGEST_UNIT] * 2, *[LARGEST_UNIT] * 2)
        valid = other if other.is_valid else as_area(shapely.make_valid(other))
        both: Area = valid if one is None else as_area(shapely.intersection(one, valid))
        shapely.prepare(both)
        return both

    def cut(self, shape: shapely.Geometry, clip: Area | None) -> shapely.Geometry:
        """Return what ``clip`` leaves of a shape."""
        if clip is None or clip.covers(shape):
            return shape
        corners = int(shapely.get_num_coordinates(shape) + shapely.get_num_coordinates(clip))
        self._spend(corners // _CORNERS_AS_ELEMENT)
        return shapely.intersection(shape, clip)

    def _spend(self, elements: int, *, copies: bool = False) -> None:
        self._elements += elements
        self._copies += copies
        if self._elements > _MOST_ELEMENTS:
            raise PlanError(self._too_large())
        if self._copies > _MOST_COPIES:
            raise PlanError(f"{self._name}: <use> copies more than {_MOST_COPIES:,} elements. Simplify the drawing.")

    def _too_large(self) -> str:
        return f"{self._name}: more than {_MOST_ELEMENTS:,} elements or {_DEEPEST} groups in each other."


def _children(element: Element, tag: str) -> list[Element]:
    """Return what is drawn of the children: all, but of a ``<switch>`` the first that asks for nothing special."""
    if tag != "switch":
        return list(element)
    plain = [child for child in element if not child.get("requiredExtensions") and tag_of(child) != "foreignobject"]
    return plain[:1]


def _outer_viewport(root: Element, said: Mapping[str, str]) -> Viewport:
    seen = view_box(root.get("viewBox", ""))
    if seen is not None:
        return seen[2], seen[3]
    sizes: list[float | None] = []
    for key in ("width", "height"):
        try:
            sizes.append(length(said.get(key, ""), None))
        except ValueError:
            sizes.append(None)
    return sizes[0], sizes[1]


def _own_transform(
    said: Mapping[str, str], viewport: Viewport, around: tuple[float, float, float, float] | None = None
) -> Matrix:
    """Return the map that an element has of its own; ``around``: the box that its shares are taken of, if its own.

    Raises:
        ValueError: it cannot be read.
    """
    left, top, width, height = around or (0.0, 0.0, *viewport)
    matrix = Matrix()
    for key in ("translate", "rotate", "scale"):
        if said.get(key, "none").lower() != "none":
            matrix = matrix @ transform_of(f"{key}({said[key]})", (width, height))
    matrix = matrix @ transform_of(said.get("transform", ""), (width, height))
    if matrix == Matrix():
        return matrix
    x, y = origin_of(said.get("transform-origin", "0 0"), (width, height))
    return moved(left + x, top + y) @ matrix @ moved(-left - x, -top - y)


def _no_auto(text: str | None) -> str:
    return "100%" if text is None or text.lower() == "auto" else text
