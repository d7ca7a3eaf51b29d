"""Doors of a DXF drawing: the swings of their leaves, and the doorway that each stands for.

A block that is put in stretched draws its swing as part of an ellipse, others draw it as a spline or as a chain of
short lines. What is curved evenly is the image of an arc under a stretch: its centre is the hinge.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from pipeline.floorplans.readers.dxf_shapes import corners_of, outlines
from pipeline.floorplans.walls import door_of

_SWING_DEG = (20.0, 200.0)
_BEND_DEG = (0.05, 50.0)  # between the pieces of a chain that draws a curve
_FEWEST_CORNERS = 4  # of such a chain
_MOST_CORNERS = 2_000
_UNEVEN = 0.02  # of a curve, in radii
_EXACT, _TELLING = 1e-5, 6  # an ellipse runs through any five corners
_ROUNDS, _TRIES = 5, 24  # of the search for a centre
_TOUCH_M = 0.02
_IN_WALL_M = 0.02  # a line no further than this from a wall line lies in the wall
_LEAF_M = 0.06  # a leaf is drawn as a line or a box no further than this from the end of its swing
_JAMB_M = 0.15  # the end of a doorway is no further from the wall that it meets
WIDTHS_M = (0.4, 6.0)


class Swing(NamedTuple):
    """The way of the edge of a leaf, in drawing units."""

    centre: tuple[float, float]
    start: tuple[float, float]
    end: tuple[float, float]


def swings_of(entity: Any) -> list[Swing]:
    """Return the curves of an entity that may be swings of leaves.

    Raises:
        Exception: anything, where the entity is damaged.
    """
    kind = entity.dxftype()
    if kind == "ARC":
        return _of_turn(entity, float(entity.dxf.end_angle) - float(entity.dxf.start_angle))
    if kind == "ELLIPSE":
        return _of_turn(entity, float(np.degrees(entity.dxf.end_param - entity.dxf.start_param)))
    if kind in ("LWPOLYLINE", "POLYLINE"):
        if kind == "POLYLINE" and (entity.is_polygon_mesh or entity.is_poly_face_mesh):
            return []
        bulges = [part for part in entity.virtual_entities() if part.dxftype() == "ARC"]
        if bulges:
            return [swing for arc in bulges for swing in swings_of(arc)]
    if kind in ("LWPOLYLINE", "POLYLINE", "SPLINE"):
        return [swing for chain in _chains(corners_of(entity)) for swing in _of_chain(chain)]
    return []


def _of_turn(entity: Any, turn: float) -> list[Swing]:
    """Return an arc or elliptic arc as a swing; the angle within an ellipse is that of the arc it was."""
    if not _SWING_DEG[0] <= turn % 360 <= _SWING_DEG[1]:
        return []
    centre = entity.dxf.center if entity.dxftype() == "ELLIPSE" else entity.ocs().to_wcs(entity.dxf.center)
    return [Swing(*((spot.x, spot.y) for spot in (centre, entity.start_point, entity.end_point)))]


def _chains(corners: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """Yield the parts (n, 2) of a line that bend a little, and to the same side, at every corner."""
    if len(corners) > _MOST_CORNERS:
        return
    corners = (
        corners[np.concatenate([[True], (np.diff(corners, axis=0) != 0).any(axis=1)])] if len(corners) else corners
    )
    way = np.diff(corners, axis=0)
    bends = np.degrees(np.angle(np.exp(1j * np.diff(np.arctan2(way[:, 1], way[:, 0])))))
    even = (_BEND_DEG[0] <= np.abs(bends)) & (np.abs(bends) <= _BEND_DEG[1])
    side = np.where(even, np.sign(bends), 0.0)
    for first, last in _runs(side):
        if last - first + 2 >= _FEWEST_CORNERS:
            yield corners[first : last + 2]


def _runs(side: NDArray[np.float64]) -> Iterator[tuple[int, int]]:
    """Yield start and end of each stretch of equal values that are not 0."""
    cuts = np.concatenate([[0], np.flatnonzero(np.diff(side)) + 1, [len(side)]])
    for first, last in zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True):
        if last > first and side[first]:
            yield first, last


class _Fit(NamedTuple):
    """Centre of an ellipse, what makes it the unit circle, and how far the corners are from it, in radii."""

    centre: NDArray[np.float64]
    stretch: NDArray[np.float64]
    uneven: float


def _of_chain(corners: NDArray[np.float64]) -> list[Swing]:
    """Return a chain as a swing, if a quarter of an ellipse, a circle or another ellipse runs through its corners.

    A free ellipse must fit exactly, where a simpler curve does at all: through rounded corners it may be far off.
    """
    middle = corners.mean(axis=0)
    size = float(np.ptp(corners, axis=0).max())
    local = (corners - middle) / size
    simple = min((fit for fit in (_quarter(local), _circle(local)) if fit), key=lambda fit: fit.uneven, default=None)
    free = _ellipse(local)
    is_exact = free is not None and free.uneven <= _EXACT and len(corners) >= _TELLING
    best = free if simple is None or simple.uneven > (_EXACT if is_exact else _UNEVEN) else simple
    if best is None or best.uneven > _UNEVEN:
        return []
    around = (local - best.centre) @ best.stretch
    turns = np.diff(np.arctan2(around[:, 1], around[:, 0]))
    if not _SWING_DEG[0] <= np.degrees(np.abs(np.angle(np.exp(1j * turns))).sum()) <= _SWING_DEG[1]:
        return []
    spots = np.array([best.centre * size + middle, corners[0], corners[-1]]).tolist()
    return [Swing(*((x, y) for x, y in spots))]


def _fit(corners: NDArray[np.float64], centre: NDArray[np.float64], stretch: NDArray[np.float64]) -> _Fit | None:
    radii = np.hypot(*((corners - centre) @ stretch).T)
    return _Fit(centre, stretch, float(np.abs(radii - 1).max())) if np.isfinite(radii).all() else None


def _quarter(corners: NDArray[np.float64]) -> _Fit | None:
    """Return the quarter of an ellipse from one axis to the other: its centre sees both ends at a right angle."""
    start, end = corners[0], corners[-1]
    middle, half = (start + end) / 2, (end - start) / 2
    bulge = corners[len(corners) // 2] - middle
    across = np.array([-half[1], half[0]]) * -np.sign(half[0] * bulge[1] - half[1] * bulge[0])
    low, high = 0.0, np.pi
    for _ in range(_ROUNDS):
        turns = np.linspace(low, high, _TRIES + 2)[1:-1]
        centres = middle + np.cos(turns)[:, None] * half + np.sin(turns)[:, None] * across
        one, other = start - centres, end - centres
        arms = corners - centres[:, None]
        u = (arms * one[:, None]).sum(axis=2) / (one * one).sum(axis=1)[:, None]
        v = (arms * other[:, None]).sum(axis=2) / (other * other).sum(axis=1)[:, None]
        best = int(np.argmin(np.abs(np.hypot(u, v) - 1).max(axis=1)))
        step = turns[1] - turns[0]
        low, high = max(0.0, turns[best] - step), min(np.pi, turns[best] + step)
    axes = np.stack([one[best] / (one[best] @ one[best]), other[best] / (other[best] @ other[best])], axis=1)
    return _fit(corners, centres[best], axes)


def _circle(corners: NDArray[np.float64]) -> _Fit | None:
    """Return the circle that fits best (Kasa's fit)."""
    x, y = corners.T
    (a, b, c), *_ = np.linalg.lstsq(np.stack([x, y, np.ones_like(x)], axis=1), x * x + y * y, rcond=None)
    square = c + (a * a + b * b) / 4
    return _fit(corners, np.array([a, b]) / 2, np.eye(2) / np.sqrt(square)) if square > 0 else None


def _ellipse(corners: NDArray[np.float64]) -> _Fit | None:
    """Return the ellipse that fits best; None where that is another conic."""
    x, y = corners.T
    terms = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=1)
    a, b, c, d, e, f = np.linalg.svd(terms)[2][-1]
    form = np.array([[a, b / 2], [b / 2, c]])
    if np.linalg.det(form) <= 1e-9:
        return None
    centre = np.linalg.solve(form, [-d / 2, -e / 2])
    rest = centre @ form @ centre - f
    if not rest * (a + c) > 0:
        return None
    return _fit(corners, centre, np.linalg.cholesky(form / rest))


def doorways(
    walls: Sequence[BaseGeometry], doors: Sequence[LineString], swings: Sequence[Swing], scale: float
) -> list[BaseGeometry]:
    """Return a line from jamb to jamb for every door, in drawing units of ``scale`` metres.

    doors: all that is drawn of them, swings included; what touches is one door.
    """
    solid = _Walls.of(walls)
    touch = _TOUCH_M / scale
    found: list[BaseGeometry] = []
    shapes = np.array(doors, dtype=object)
    tree = shapely.STRtree(shapes)
    for centre, start, end in swings:
        found.append(_doorway(solid, tree, LineString((centre, start)), LineString((centre, end)), scale))
    spots = shapely.multipoints([spot for swing in swings for spot in swing]) if swings else None
    clusters = shapely.get_parts(shapely.union_all(shapely.buffer(shapes, touch, quad_segs=2)))
    for cluster in clusters:
        if spots is not None and shapely.distance(cluster, spots) <= touch:
            continue  # the leaf or the frame of a door whose arc has told the doorway
        members = shapely.MultiLineString(shapes[tree.query(cluster, predicate="intersects")].tolist())
        if members.is_empty:
            continue  # beyond what floating point tells apart
        corners = shapely.get_coordinates(shapely.oriented_envelope(members))
        found.append(_middle_line(corners) if len(corners) >= 4 else LineString(corners))
    return found


class _Walls(NamedTuple):
    """Lines of walls, outlines of areas among them, and the areas."""

    edges: BaseGeometry
    areas: shapely.STRtree

    @classmethod
    def of(cls, walls: Sequence[BaseGeometry]) -> "_Walls":
        areas = [wall for wall in walls if wall.geom_type.endswith("Polygon")]
        edges = shapely.MultiLineString(list(outlines(walls)))
        shapely.prepare(edges)
        return cls(edges, shapely.STRtree(areas))

    def distance(self, spots: NDArray[np.object_]) -> NDArray[np.float64]:
        """Return how far points are from walls, 0 within them."""
        away: NDArray[np.float64] = shapely.distance(spots, self.edges)
        away[self.areas.query(spots, predicate="within")[0]] = 0.0
        return away


def _doorway(walls: _Walls, doors: shapely.STRtree, one: LineString, other: LineString, scale: float) -> LineString:
    """Return which of the two ends of a swing is the doorway, and not the open leaf.

    A wall drawn across the door tells it: one line lies in that wall. Else one line bridges the gap between two jambs;
    the open leaf may stand along another wall, but not on it. Where these say nothing, or each another, the leaf is the
    line that is drawn. Else the doorway is the line that is nearer to walls.
    """
    lines = one, other
    spots = [shapely.line_interpolate_point(line, np.linspace(0.0, 1.0, 11), normalized=True) for line in lines]
    away = [walls.distance(along) * scale for along in spots]
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


def is_doorway(opening: BaseGeometry, scale: float) -> bool:
    """Return whether an opening is as wide as doors are."""
    return WIDTHS_M[0] <= door_of(opening).width * scale <= WIDTHS_M[1]
