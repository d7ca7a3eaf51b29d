"""What an entity of a DXF drawing is in the plane: lines, wide lines, and areas, in drawing units."""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString, Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.floorplans.readers.drawing import LARGEST_UNIT
from pipeline.floorplans.readers.dxf_widths import wide_shapes, widest

CURVE_STEPS = 8  # per curve of up to a quarter turn
_MOST_RINGS = 3_000  # of one hatch
_EXTERNAL, _TEXTBOX, _OUTERMOST = 1, 8, 16  # flags of a boundary of a hatch
_IGNORE_STYLE, _OUTERMOST_STYLE = 2, 1


def shapes_of(entity: Any, *, thinnest: float) -> list[BaseGeometry] | None:
    """Return lines and areas of an entity in world coordinates, None where its kind is not read.

    thinnest: a polyline that is nowhere wider is a line [drawing units]. What has no extent is left out, so the list
    may be empty.

    Raises:
        Exception: anything, where the entity is damaged; ezdxf has no narrower promise.
    """
    read = _KINDS.get(entity.dxftype())
    if read is None:
        return None
    found = [shape for shape in read(entity, thinnest) if shape is not None]
    if not all((np.abs(shapely.get_coordinates(shape)) <= LARGEST_UNIT).all() for shape in found):
        raise ValueError("a coordinate is not finite or too large")
    return found


def corners_of(entity: Any) -> NDArray[np.float64]:
    """Return the corners (n, 2) of a line or curve in world coordinates, curves as short pieces."""
    from ezdxf.path import make_path

    return np.array([(point.x, point.y) for point in make_path(entity).approximate(CURVE_STEPS)]).reshape(-1, 2)


def _line(entity: Any, _: float = 0.0) -> Iterator[LineString | None]:
    yield _line_through(corners_of(entity))


def _line_through(corners: NDArray[np.float64]) -> LineString | None:
    if not np.isfinite(corners).all():
        raise ValueError("a coordinate is not finite")
    return LineString(corners) if len(corners) >= 2 and np.ptp(corners, axis=0).any() else None


def _polyline(entity: Any, thinnest: float) -> Iterator[BaseGeometry | None]:
    """Yield a polyline: meshes face by face, wide ones as areas, others as one line."""
    if entity.dxftype() == "POLYLINE" and (entity.is_polygon_mesh or entity.is_poly_face_mesh):
        for face in entity.virtual_entities():
            yield from _face(face)
        return
    if widest(entity) > thinnest:
        yield from wide_shapes(entity, thinnest)
    else:
        yield from _line(entity)


def _area(corners: NDArray[np.float64]) -> BaseGeometry | None:
    """Return the area of a face, or the line that it is when seen from above."""
    if len(corners) < 3 or not np.isfinite(corners).all():
        return _line_through(corners)  # which refuses the latter
    polygon = Polygon(corners)
    if not polygon.is_valid:
        polygon = shapely.convex_hull(polygon)
    if polygon.area > 1e-9 * float(np.ptp(corners, axis=0).max(initial=0.0)) ** 2:
        return polygon
    in_order = corners[np.lexsort((corners[:, 1], corners[:, 0]))]
    return _line_through(in_order[[0, -1]])


def _face(entity: Any, _: float = 0.0) -> Iterator[BaseGeometry | None]:
    """Yield a filled triangle or quadrilateral; a vertical face in space is a line seen from above."""
    yield _area(np.array([(point.x, point.y) for point in entity.wcs_vertices()]).reshape(-1, 2))


def _hatch(entity: Any, _: float = 0.0) -> Iterator[BaseGeometry | None]:
    """Yield the filled area: islands in it by the style of the hatch."""
    from ezdxf.path import from_hatch_boundary_path

    boundaries = [boundary for boundary in entity.paths if not boundary.path_type_flags & _TEXTBOX]
    if len(boundaries) > _MOST_RINGS:
        raise ValueError("a hatch of too many boundaries")
    rings = []
    for boundary in boundaries:
        path = from_hatch_boundary_path(boundary, entity.ocs(), entity.dxf.elevation.z)
        corners = np.array([(point.x, point.y) for point in path.approximate(CURVE_STEPS)]).reshape(-1, 2)
        if len(corners) >= 3 and np.ptp(corners, axis=0).all():
            rings.append((corners, boundary.path_type_flags))
    style = entity.dxf.get("hatch_style", 0) if entity.dxftype() == "HATCH" else 0
    if style == _IGNORE_STYLE:
        yield from (Polygon(corners) for corners, _ in rings)
    elif rings:
        shown = [ring for ring, flags in rings if style != _OUTERMOST_STYLE or flags & (_EXTERNAL | _OUTERMOST)]
        first, *others = shown or [ring for ring, _ in rings]
        yield Polygon(first, others)  # where no ring holds the others it is invalid, and repaired by even-odd


def _mline(entity: Any, _: float = 0.0) -> Iterator[BaseGeometry | None]:
    """Yield the areas between the outer lines of a multiline, piece by piece where it was cut."""
    vertices = list(entity.vertices)
    if entity.is_closed and len(vertices) > 2:
        vertices.append(vertices[0])
    for start, end in pairwise(vertices):
        offsets = [params[0] if len(params) else 0.0 for params in start.line_params]
        if not offsets:
            continue
        sides = int(np.argmin(offsets)), int(np.argmax(offsets))
        one, other = (_pieces(start, end, side) for side in sides)
        if len(one) != len(other):  # cut on one side alone: no way through
            one, other = ([(pieces[0][0], pieces[-1][1])] for pieces in (one, other))
        for (a, b), (d, c) in zip(one, other, strict=True):
            yield _area(np.array([a, b, c, d]))


def _pieces(start: Any, end: Any, element: int) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return the pieces of one line of a multiline between two vertices, as start and end.

    Its parameters are the offset of the line, and where along it pieces start and end in turn; the last may be open.
    """
    offset, *marks = start.line_params[element]
    first = start.location + start.miter_direction * offset
    last = end.location + end.miter_direction * end.line_params[element][0]
    spots = [first + start.line_direction * mark for mark in (marks or [0.0])]
    spots += [last] if len(spots) % 2 else []
    return [((a.x, a.y), (b.x, b.y)) for a, b in zip(spots[::2], spots[1::2], strict=True)]


_KINDS: dict[str, Callable[[Any, float], Iterator[BaseGeometry | None]]] = {
    **dict.fromkeys(("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE"), _line),
    **dict.fromkeys(("LWPOLYLINE", "POLYLINE"), _polyline),
    **dict.fromkeys(("SOLID", "TRACE", "3DFACE"), _face),
    **dict.fromkeys(("HATCH", "MPOLYGON"), _hatch),
    "MLINE": _mline,
}


def outlines(shapes: Sequence[BaseGeometry]) -> list[LineString]:
    """Return lines as they are and areas as their outlines: a door is found by what is drawn of it."""
    lines = [shapely.boundary(shape) if shape.geom_type.endswith("Polygon") else shape for shape in shapes]
    return [part for line in lines for part in shapely.get_parts(line) if not part.is_empty]
