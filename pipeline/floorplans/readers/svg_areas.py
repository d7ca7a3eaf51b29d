"""Outlines as areas: filled by the nonzero or the even-odd rule of SVG, or drawn with a pen."""

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.errors import PlanError
from pipeline.floorplans.readers.svg_paint import Pen
from pipeline.floorplans.walls import Area, as_area, check_crossings, check_outline

_MOST_MEETINGS = 100_000  # of the sides of one shape, by the boxes around them
_MOST_LOOKS = 20_000_000
_RAYS_AT_ONCE = 200


def filled(rings: Sequence[NDArray[np.float64]], *, nonzero: bool, name: str) -> tuple[Area, bool]:
    """Return the area within ``rings`` [corners, xy], and whether one of them crosses itself.

    nonzero: a spot is inside where the rings turn around it at all, SVG's default; else where they do so an odd
    number of times. Every face of the rings' lines is asked once.

    Raises:
        PlanError: a scribble, whose faces would take minutes to find; ``name`` says of what.
    """
    polygons = [shapely.polygons(np.concatenate([ring, ring[:1]])) for ring in rings]
    if len(rings) == 1:
        check_outline(polygons[0], name)
        if polygons[0].is_valid:
            return polygons[0], False
    sides = _sides(rings)
    lines = shapely.linestrings(sides)
    check_crossings(lines, name, most=_MOST_MEETINGS + 10 * len(lines), besides=3 * len(lines))
    crossed = not shapely.is_valid(polygons).all()
    turned = shapely.is_ccw(shapely.get_exterior_ring(polygons))
    if nonzero and not crossed and (turned.all() or not turned.any()):  # all turn the same way: nothing cancels
        return as_area(shapely.union_all(polygons)), False
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all(lines)]))
    turns = _turns(shapely.get_coordinates(shapely.point_on_surface(faces)), sides, name)
    inside = faces[turns != 0 if nonzero else turns % 2 != 0]
    return (as_area(shapely.union_all(inside)) if len(inside) else Polygon()), bool(crossed)


def drawn(line: NDArray[np.float64], pen: Pen, *, closed: bool, name: str) -> BaseGeometry:
    """Return what ``pen`` covers along ``line`` [corners, xy].

    Raises:
        PlanError: a scribble.
    """
    reach = (pen.width or 0.0) / 2
    if len(line) > 2:
        low, high = np.minimum(line[:-1], line[1:]) - reach, np.maximum(line[:-1], line[1:]) + reach
        covered = shapely.box(*low.T, *high.T)
        check_crossings(covered, name, most=_MOST_MEETINGS + 10 * len(covered), besides=3 * len(covered))
    path = shapely.linearrings(line) if closed and len(line) > 2 else shapely.linestrings(line)
    return shapely.buffer(path, reach, cap_style=pen.cap, join_style=pen.join, mitre_limit=pen.mitre_limit)


def _sides(rings: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the sides of ``rings`` [sides, ends, xy]."""
    return np.concatenate([np.stack([ring, np.roll(ring, -1, axis=0)], axis=1) for ring in rings])


def _turns(spots: NDArray[np.float64], sides: NDArray[np.float64], name: str) -> NDArray[np.int64]:
    """Return how many times the rings of ``sides`` turn around each spot [spots].

    A side that crosses the ray from a spot to the right adds a turn where it rises, and takes one where it falls.

    Raises:
        PlanError: a scribble.
    """
    right = sides[..., 0].max() + 1.0
    ends = np.stack([np.full(len(spots), right), spots[:, 1]], axis=1)
    rays = shapely.linestrings(np.stack([spots, ends], axis=1))
    tree = shapely.STRtree(shapely.linestrings(sides))
    turns, looked = np.zeros(len(spots), dtype=np.int64), 0
    for start in range(0, len(spots), _RAYS_AT_ONCE):
        ray, side = tree.query(rays[start : start + _RAYS_AT_ONCE])
        looked += len(ray)
        if looked > _MOST_LOOKS:
            raise PlanError(f"{name}: an outline crosses itself far too often. Simplify the drawing.")
        (x, y), ((x0, y0), (x1, y1)) = spots[start + ray].T, sides[side].transpose(1, 2, 0)
        left = (x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)
        rises, falls = (y0 <= y) & (y < y1) & (left > 0), (y1 <= y) & (y < y0) & (left < 0)
        turns += np.bincount(start + ray[rises], minlength=len(spots)) - np.bincount(
            start + ray[falls], minlength=len(spots)
        )
    return turns
