"""SVG drawings whose shapes carry classes, as CubiCasa5k: Wall, Door, Window, Railing and "Space <type>" for rooms.

The class stands on a group or on a shape, in ``class``, ``id`` or Inkscape's layer label. A door inside a wall group is
a door; groups inside a door, window or room that have a class of their own (panels, labels, handles) are not drawn.
Windows and railings are walls. A group of class "Floorplan <level>" is a floor of its own, even when it is hidden.

y points down and is turned over. There is no scale: ``metres_per_unit`` is needed, in user units of the drawing.
What is hidden by display, visibility or opacity is passed over and counted. Walls are what is painted: areas within
closed outlines that have a fill, by the fill rule of SVG, and lines as wide as their stroke. Where the drawing says no
stroke width, and where it is that of a pen and no wall, a line is ``wall_m`` thick. An open outline is a line, unless
it is filled and has no stroke. Doors and rooms are areas however they are painted.

The tree is parsed by defusedxml, which refuses entity bombs. `svg_tree` walks it; svgelements parses paths, no more.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import numpy as np
import shapely
from defusedxml import ElementTree
from defusedxml.common import DefusedXmlException
from shapely.geometry.base import BaseGeometry

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers.drawing import LARGEST_UNIT, PARSER_ERRORS, Drawing, plan_of, scale_of
from pipeline.floorplans.readers.json_file import short_text, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.readers.svg_areas import drawn, filled
from pipeline.floorplans.readers.svg_meaning import WALLS, tag_of
from pipeline.floorplans.readers.svg_paint import is_visible, paint_of
from pipeline.floorplans.readers.svg_shapes import Outline, outlines_of
from pipeline.floorplans.readers.svg_tree import Place, Tree
from pipeline.floorplans.rooms import say_count, say_repaired
from pipeline.floorplans.walls import as_area

_PROLOGUE = re.compile(r"<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>\[]*(?:\[.*?\]\s*)?>", re.DOTALL)
_MOST_BYTES = 30_000_000
_THINNEST_WALL_M = 0.03  # what is drawn thinner is drawn with a pen


@dataclass
class _Found:
    """The floors by level; outlines that cross themselves, lines thinner than a wall, and what refuses a floor."""

    tree: Tree
    options: ReadOptions
    name: str
    levels: dict[str, Drawing] = field(default_factory=dict)
    crossed: dict[str, int] = field(default_factory=dict)
    thin: dict[str, int] = field(default_factory=dict)
    refused: dict[str, PlanError] = field(default_factory=dict)


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
        name = str(path)
        found = _Found(Tree(_parse(path), options, name), options, name)
        for place in found.tree.shapes():
            try:
                _add_shape(found, place)
            except PlanError as problem:  # a scribble: one bad floor must not cost the others
                found.refused.setdefault(place.meaning.level, problem)
        drawn_on = {level for level, drawing in found.levels.items() if drawing.walls or drawing.rooms}
        levels = {level: found.levels[level] for level in found.levels if level in drawn_on | found.refused.keys()}
        if not levels:
            hidden = found.tree.tally.hidden
            raise PlanError(
                f"{path}: no shape of a class {', '.join(options.wall_layers or WALLS[:2])} or Space"
                f"{f' is shown; {hidden} are hidden' if hidden else ''}. "
                "Name the classes of the walls in plans.read.wall_layers."
            )
        for level, drawing in levels.items():
            if options.levels and not {level, level.rpartition("-")[2]} & {*options.levels}:
                continue
            drawing.remarks += _remarks(found, level)
            plan_id = f"{path.stem}.{level}" if len(levels) > 1 else path.stem
            if level in found.refused:
                yield PlanError(str(found.refused[level]).replace(name, f"{name} ({plan_id})", 1))
                continue
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


def _remarks(found: _Found, level: str) -> Iterator[str]:
    """Yield what was left out of the file, or guessed in the floor ``level``, each with its count."""
    tally, thin = found.tree.tally, found.thin.get(level, 0)
    if tally.hidden:
        yield f"{say_count(tally.hidden, 'shape')} of walls, doors or rooms passed over: hidden or not painted"
    if tally.astray:
        yield f"{say_count(tally.astray, '<use>')} left out: nothing in this file to copy"
    if tally.damaged:
        yield f"{say_count(tally.damaged, 'shape')} left out: could not be read"
    if tally.unclipped:
        yield f"{say_count(tally.unclipped, 'clipping')} by path or mask not applied"
    if tally.pictures:
        yield f"{say_count(tally.pictures, '<image>')} of walls, doors or rooms left out: pictures are not read"
    if found.tree.unread_rules:
        yield f"{say_count(found.tree.unread_rules, 'rule')} of style sheets not followed"
    if thin:
        width = f"{found.options.wall_m:g} m"
        yield f"{say_count(thin, 'line')} drawn thinner than {_THINNEST_WALL_M:g} m taken as walls of {width}"
    if found.crossed.get(level, 0):
        yield say_repaired(found.crossed[level])


def _add_shape(found: _Found, place: Place) -> None:
    """Add a shape to its floor, or count it as hidden or damaged."""
    meaning, tally = place.meaning, found.tree.tally
    if meaning.level in found.refused:
        return
    if place.hidden or not is_visible(place.style):
        tally.hidden += 1
        return
    drawing = found.levels.setdefault(meaning.level, Drawing())
    try:
        outlines = outlines_of(tag_of(place.element), place.element.attrib, place.said, place.viewport)
        outlines = [outline for outline in outlines if len(outline.corners) > 1]
        if outlines and meaning.kind in ("wall", "solid") and not _is_painted(place):
            tally.hidden += 1
            return
        shapes = _wall(found, place, outlines) if meaning.kind in ("wall", "solid") else _marked(found, place, outlines)
        shapes = [shape for shape in shapes if not shape.is_empty]
        sound = all((np.abs(shapely.get_coordinates(shape)) <= LARGEST_UNIT).all() for shape in shapes)
        shapes = [part for shape in shapes for part in _parts(found.tree.cut(shape, place.clip))] if sound else []
    except PARSER_ERRORS:  # one shape must not end the file
        shapes, sound = [], False
    if not sound or (not shapes and not outlines):
        tally.damaged += 1
    elif not shapes:
        tally.hidden += 1  # clipped away
    elif meaning.kind == "room":
        drawing.rooms += [(shape, meaning.label) for shape in shapes if shapely.get_dimensions(shape) == 2]
    else:
        (drawing.openings if meaning.kind == "door" else drawing.walls).extend(shapes)


def _is_painted(place: Place) -> bool:
    """Return whether anything of a wall is drawn. A drawing that says nothing of strokes is taken to draw its lines."""
    paint = paint_of(place.style, place.viewport)
    return paint.stroke is not False or (paint.fill is not False and tag_of(place.element) != "line")


def _wall(found: _Found, place: Place, outlines: list[Outline]) -> list[BaseGeometry]:
    """Return the areas and lines that a wall is painted as, in units of the drawing, y up."""
    paint, stretch, level = paint_of(place.style, place.viewport), place.matrix.stretch, place.meaning.level
    pen = paint.pen
    if stretch == 0:  # pressed flat: not drawn
        return []
    if place.said.get("vector-effect") == "non-scaling-stroke" and pen.width is not None:
        pen = pen._replace(width=pen.width / stretch)
    scale = found.options.metres_per_unit or 0.0
    is_thick = pen.width is not None and pen.width * stretch * scale >= _THINNEST_WALL_M
    fills_open = paint.stroke is not True and (paint.fill is True or paint.stroke is False)
    shapes: list[BaseGeometry] = []
    lines = outlines
    if paint.fill is not False and tag_of(place.element) != "line":
        inside = [each for each in outlines if len(each.corners) > 2 and (fills_open or _is_closed(each, place))]
        area = _area(found, place, inside)
        if area is not None:
            within = {id(each) for each in inside}
            shapes, lines = [area], [each for each in outlines if id(each) not in within]
    if is_thick:
        stroked = outlines if paint.stroke is True else lines
        thick = [drawn(each.corners, pen, closed=each.closed, name=found.name) for each in stroked]
        shapes += [shapely.transform(shape, place.matrix.apply) for shape in thick]
    elif lines:
        found.thin[level] = found.thin.get(level, 0) + (pen.width is not None)
        shapes.append(_lines(place, lines))
    return shapes


def _marked(found: _Found, place: Place, outlines: list[Outline]) -> list[BaseGeometry]:
    """Return the area of a door or room, whose paint does not matter, or the lines of one without an area."""
    area = _area(found, place, [each for each in outlines if len(each.corners) > 2 and _is_closed(each, place)])
    return [area] if area is not None else [_lines(place, outlines)] if outlines else []


def _is_closed(outline: Outline, place: Place) -> bool:
    corners = outline.corners
    back = len(corners) > 3 and bool((corners[0] == corners[-1]).all())
    return outline.closed or (place.meaning.kind != "wall" and back)


def _area(found: _Found, place: Place, outlines: list[Outline]) -> BaseGeometry | None:
    """Return what lies within outlines, in units of the drawing; None where they enclose nothing."""
    rings = [place.matrix.apply(outline.corners) for outline in outlines]
    if not rings:
        return None
    nonzero = place.style.get("fill-rule", "").lower() != "evenodd"
    area, crossed = filled(rings, nonzero=nonzero, name=found.name)
    if place.meaning.kind != "door" and len(rings) == 1:
        level = place.meaning.level
        found.crossed[level] = found.crossed.get(level, 0) + crossed
    return area if area.area > 0 else None


def _lines(place: Place, outlines: list[Outline]) -> BaseGeometry:
    rows = [np.concatenate([line, line[:1]]) if closed else line for line, closed in outlines]
    return shapely.multilinestrings([shapely.linestrings(place.matrix.apply(row)) for row in rows])


def _parts(shape: BaseGeometry) -> list[BaseGeometry]:
    """Return the areas of a shape as one and its lines as one, without the points that clipping leaves."""
    if shape.geom_type != "GeometryCollection":
        return [shape] if not shape.is_empty and shapely.get_dimensions(shape) > 0 else []
    parts = shapely.get_parts(shapely.get_parts(shape))
    lines = parts[shapely.get_dimensions(parts) == 1]
    found = [as_area(shape), shapely.multilinestrings(lines) if len(lines) else shapely.MultiLineString()]
    return [part for part in found if not part.is_empty]
