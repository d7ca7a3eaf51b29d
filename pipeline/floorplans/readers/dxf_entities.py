"""The walls and doors among the entities of a DXF drawing, block by block, as a drawing program would show them.

What its author switched off is no wall: layers off or frozen, invisible entities, block references on a frozen layer,
what the clip of a block cuts away. In a block, what lies on layer 0 belongs to the layer that the block is put on; so
a block on a layer that is off still shows what lies on layers of its own, and one on a frozen layer shows nothing.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.errors import PlanError
from pipeline.floorplans.readers.drawing import PARSER_ERRORS
from pipeline.floorplans.readers.dxf_doors import Swing, swings_of
from pipeline.floorplans.readers.dxf_layers import LayerTable, is_door_block, is_door_name, is_wall_name
from pipeline.floorplans.readers.dxf_shapes import outlines, shapes_of
from pipeline.floorplans.readers.json_file import short_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.walls import repaired

MOST_ENTITIES = 300_000
_DEEPEST_BLOCK = 6
_MOST_CLIP_CORNERS = 1_000
_XREF = 4 | 8  # flags of a block: an external reference, or one laid over


@cache
def damage() -> tuple[type[Exception], ...]:
    """Return what ezdxf raises on damaged text: errors of its own, and of Python many kinds; the last at its end."""
    from ezdxf.lldxf.const import DXFError

    return (DXFError, *PARSER_ERRORS, StopIteration)


class _Clip(NamedTuple):
    """What a clipped block shows: ``area``, or all but it."""

    area: BaseGeometry
    inverted: bool


class _Place(NamedTuple):
    """Where entities stand: the layer that layer 0 stands for, depth in blocks, and what holds for all of them."""

    layer: str | None = None
    depth: int = 0
    door: str = ""  # the block that makes them parts of a door
    hidden: str = ""  # the layer whose state hides them all, or the one of the invisible reference
    clips: tuple[_Clip, ...] = ()


_TOP = _Place()


@dataclass
class Found:
    """The shapes of wall and door layers in drawing units, y up, and what was left out.

    layers: all names met. passed: those with shapes that are no walls and no doors by name. wall_layers, door_layers:
    those whose shapes were taken; for doors also blocks. unread, damaged: entities by layer and kind. hidden, clipped:
    entities by layer. external: references to other files. absent: blocks that the file does not hold.
    """

    walls: list[BaseGeometry] = field(default_factory=list)
    doors: list[LineString] = field(default_factory=list)
    swings: list[Swing] = field(default_factory=list)
    layers: set[str] = field(default_factory=set)
    passed: set[str] = field(default_factory=set)
    wall_layers: set[str] = field(default_factory=set)
    door_layers: set[str] = field(default_factory=set)
    unread: Counter[tuple[str, str]] = field(default_factory=Counter)
    damaged: Counter[tuple[str, str]] = field(default_factory=Counter)
    hidden: Counter[str] = field(default_factory=Counter)
    clipped: Counter[str] = field(default_factory=Counter)
    external: Counter[str] = field(default_factory=Counter)
    absent: Counter[str] = field(default_factory=Counter)
    damaged_blocks: int = 0
    deep_blocks: int = 0
    entities: int = 0


@dataclass(frozen=True)
class Collector:
    """Collects walls and doors into ``found``; thinnest: as in `shapes_of`."""

    found: Found
    table: LayerTable
    options: ReadOptions
    thinnest: float

    def collect(self, entities: Iterable[Any], place: _Place = _TOP) -> None:
        """Collect the shapes of ``entities``.

        Raises:
            PlanError: there are far too many, or an outline crosses itself far too often.
        """
        for entity in entities:
            self.found.entities += 1
            if self.found.entities > MOST_ENTITIES:
                raise PlanError(f"more than {MOST_ENTITIES:,} entities with those of blocks. Simplify the drawing.")
            own = _name_in(entity, "layer", "0")
            layer = place.layer if own == "0" and place.layer is not None else own
            self.found.layers.add(layer)
            if entity.dxftype() == "INSERT":
                self._enter(entity, layer, place)
            elif place.door or is_door_name(layer, self.options):
                self._add(entity, layer, place, is_door=True)
            elif is_wall_name(layer, self.options):
                self._add(entity, layer, place, is_door=False)
            else:
                self.found.passed.add(layer)

    def _enter(self, insert: Any, layer: str, place: _Place) -> None:
        """Collect what a block reference on ``layer`` puts into the drawing."""
        name = _name_in(insert, "name", "")
        hides = _is_invisible(insert) or self.table.is_frozen(layer)
        if self._is_elsewhere(insert, name, hidden=bool(hides or place.hidden)):
            return
        if place.depth >= _DEEPEST_BLOCK:
            self.found.deep_blocks += 1
            return
        inner = _Place(
            layer=layer,
            depth=place.depth + 1,
            door=place.door or (name if is_door_block(name, self.options) else ""),
            hidden=place.hidden or (layer if hides else ""),
            clips=(*place.clips, *self._clips(insert)),
        )
        self.collect(self._parts(insert, layer), inner)

    def _is_elsewhere(self, insert: Any, name: str, *, hidden: bool) -> bool:
        """Return whether the file does not hold the block, and count it."""
        try:
            block = insert.block()
            flags = 0 if block is None else int(block.block.dxf.get("flags", 0))
            path = "" if block is None else str(block.block.dxf.get("xref_path", ""))
            empty = block is None or len(block) == 0
        except damage():
            return False  # what is damaged is found where it is read
        if block is None or (empty and flags & _XREF):
            if not hidden:
                counter = self.found.external if block is not None else self.found.absent
                counter[short_text(path) or short_text(name)] += 1
            return True
        return False

    def _clips(self, insert: Any) -> Iterator[_Clip]:
        """Yield the clip of a block reference, if it has one that is switched on."""
        from ezdxf.xclip import XClip

        try:
            clip = XClip(insert)
            if not clip.is_clipping_enabled:
                return
            path = clip.get_wcs_clipping_path()
            corners = [(point.x, point.y) for point in path.inner_polygon()]
            if not 3 <= len(corners) <= _MOST_CLIP_CORNERS or not np.isfinite(corners).all():
                raise ValueError("not the corners of a clip")
            area = repaired(Polygon(corners), "the clip of a block")
        except damage():
            self.found.damaged_blocks += 1
            return
        shapely.prepare(area)
        yield _Clip(area, bool(path.is_inverted_clip))

    def _parts(self, insert: Any, layer: str) -> Iterator[Any]:
        """Yield what a block puts into the drawing, copy by copy; a damaged block ends early and is counted."""

        def skipped(entity: Any, _: str) -> None:
            self.found.unread[_name_in(entity, "layer", layer), entity.dxftype()] += 1

        try:
            if insert.mcount > MOST_ENTITIES:
                raise PlanError(f"a block is put {insert.mcount:,} times. Simplify the drawing.")
            for copy in insert.multi_insert() if insert.mcount > 1 else (insert,):
                yield from copy.virtual_entities(skipped_entity_callback=skipped)
        except PlanError:
            raise
        except damage():
            self.found.damaged_blocks += 1

    def _add(self, entity: Any, layer: str, place: _Place, *, is_door: bool) -> None:
        found, kind = self.found, entity.dxftype()
        if place.hidden or _is_invisible(entity) or self.table.is_hidden(layer):
            found.hidden[place.hidden or layer] += 1
            return
        try:
            shapes = shapes_of(entity, thinnest=self.thinnest)
            swings = swings_of(entity) if is_door else []
        except damage():
            found.damaged[layer, kind] += 1
            return
        if shapes is None:
            found.unread[layer, kind] += 1
            return
        if not shapes:  # without extent
            found.damaged[layer, kind] += 1
            return
        whole = [_sound(shape) for shape in shapes]
        shown = _clipped(whole, place.clips)
        found.clipped[layer] += shown is not whole
        if is_door:
            found.doors += outlines(shown)
            found.swings += [swing for swing in swings if _is_shown(swing, place.clips)]
        else:
            found.walls += shown
        if shown:
            names = found.door_layers if is_door else found.wall_layers
            names.add(f"block {place.door}" if is_door and not is_door_name(layer, self.options) else layer)


def _name_in(entity: Any, key: str, default: str) -> str:
    """Return the name of a layer or block; entities of kinds that ezdxf does not know have none."""
    try:
        return str(entity.dxf.get(key, default))
    except damage():
        return default


def _is_invisible(entity: Any) -> bool:
    try:
        return bool(entity.dxf.get("invisible", 0))
    except damage():
        return False


def _sound(shape: BaseGeometry) -> BaseGeometry:
    return repaired(shape, "an area") if shape.geom_type == "Polygon" else shape


def _clipped(shapes: list[BaseGeometry], clips: tuple[_Clip, ...]) -> list[BaseGeometry]:
    """Return what the clips leave of ``shapes``: the same list where that is all."""
    for area, inverted in clips:
        if all(_is_whole(shape, area, inverted) for shape in shapes):
            continue
        cut = shapely.difference(shapes, area) if inverted else shapely.intersection(shapes, area)
        parts = shapely.get_parts(shapely.get_parts(cut))
        shapes = parts[(shapely.get_dimensions(parts) > 0) & ~shapely.is_empty(parts)].tolist()
    return shapes


def _is_whole(shape: BaseGeometry, area: BaseGeometry, inverted: bool) -> bool:
    return bool(shapely.disjoint(area, shape) if inverted else shapely.covers(area, shape))


def _is_shown(swing: Swing, clips: tuple[_Clip, ...]) -> bool:
    """Return whether the clips leave the middle of a swing."""
    middle = Point(np.mean(swing, axis=0))
    return all(bool(shapely.covers(area, middle)) is not inverted for area, inverted in clips)
