"""Polylines of DXF drawings that have a width: walls drawn with one wide line, in drawing units.

Every piece is an area of its own, and so is every corner: a scribble is then found by the boxes that meet, before
anything is combined. What ezdxf offers for it (`ezdxf.render.trace`) draws pieces that grow narrower too long.
"""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

_STEPS = 8  # of an arc, per quarter turn
_MITRE_LIMIT = 5.0  # a corner that would reach further is cut off
_SPLINE_FRAME = 16  # flag of a vertex that is not on the line


class _Pieces(NamedTuple):
    """Straight pieces: corners (n + 1, 2), widths at start and end of each piece (n, 2)."""

    corners: NDArray[np.float64]
    widths: NDArray[np.float64]


def widest(entity: Any) -> float:
    """Return the greatest width of a LWPOLYLINE or POLYLINE, 0 of one in space."""
    return max((max(start, end) for _, _, start, end, _ in _vertices(entity)), default=0.0)


def wide_shapes(entity: Any, thinnest: float) -> list[BaseGeometry]:
    """Return the areas of a wide polyline, corners mitred; pieces no wider than ``thinnest`` are lines."""
    corners, widths = _pieces(entity)
    wide = widths.max(axis=1) > thinnest
    closed = bool((corners[0] == corners[-1]).all()) and len(widths) > 2
    sides = _sides(corners, widths)
    lines = shapely.linestrings(np.stack([corners[:-1][~wide], corners[1:][~wide]], axis=1))
    found = [*shapely.polygons(sides[wide]), *lines]
    met = np.flatnonzero(wide & np.roll(wide, 1))  # the pieces that begin at a corner of wide ones
    met = met if closed else met[met > 0]
    same = np.ptp(np.concatenate([widths[met - 1], widths[met]], axis=1), axis=1) == 0
    middles = (corners[:-1] + corners[1:]) / 2
    bent = shapely.linestrings(np.stack([middles[met - 1], corners[:-1][met], middles[met]], axis=1)[same])
    half = widths[met, 0][same] / 2
    found += [*shapely.buffer(bent, half, cap_style="flat", join_style="mitre", mitre_limit=_MITRE_LIMIT)]
    ends = np.concatenate([sides[met - 1][:, 1:3], sides[met][:, [0, 3]]], axis=1)[~same]
    found += [*shapely.convex_hull(shapely.multipoints(ends))]
    return [shape for shape in found if not shape.is_empty and (shape.geom_type != "Polygon" or shape.area > 0)]


def _sides(corners: NDArray[np.float64], widths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the corners (n, 4, 2) of each piece: left of its start, left of its end, right of its end and start."""
    way = np.diff(corners, axis=0)
    left = np.stack([-way[:, 1], way[:, 0]], axis=1) / np.hypot(*way.T)[:, None] / 2
    start, end = left * widths[:, :1], left * widths[:, 1:]
    return np.stack([corners[:-1] + start, corners[1:] + end, corners[1:] - end, corners[:-1] - start], axis=1)


def _vertices(entity: Any) -> list[tuple[float, float, float, float, float]]:
    """Return x, y, width at start and end of the piece that follows, and its bulge, as in the file."""
    if entity.dxftype() == "LWPOLYLINE":
        const = float(entity.dxf.get("const_width", 0.0))
        return [
            (x, y, *((const, const) if const > 0 else (start, end)), bulge)
            for x, y, start, end, bulge in entity.get_points()
        ]
    if not entity.is_2d_polyline:
        return []
    default = entity.dxf.get("default_start_width", 0.0), entity.dxf.get("default_end_width", 0.0)
    return [
        (
            *(vertex.dxf.location.x, vertex.dxf.location.y),
            *(vertex.dxf.get("start_width", default[0]), vertex.dxf.get("end_width", default[1])),
            vertex.dxf.get("bulge", 0.0),
        )
        for vertex in entity.vertices
        if not vertex.dxf.get("flags", 0) & _SPLINE_FRAME
    ]


def _pieces(entity: Any) -> _Pieces:
    """Return the straight pieces of a polyline in world coordinates, arcs as short ones; none is without length."""
    rows = np.array(_vertices(entity), dtype=float)
    if entity.is_closed:
        rows = np.concatenate([rows, rows[:1]])
    spots = rows[:, 0] + 1j * rows[:, 1]
    away = np.append(spots[1:] != spots[:-1], True)
    rows, spots = rows[away], spots[away]
    if rows[:-1, 4].any():
        spots, widths = _bent(rows, spots)
    else:
        widths = rows[:-1, 2:4]
    to_world = entity.ocs().to_wcs
    corners = np.array([to_world((spot.real, spot.imag, 0.0)).vec2 for spot in spots.tolist()])
    return _Pieces(corners, widths)


def _bent(
    rows: NDArray[np.float64], spots: NDArray[np.complex128]
) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
    """Return the corners and widths of pieces with their arcs cut into short ones."""
    chains, widths = [], []
    for k, (start, end) in enumerate(pairwise(spots)):
        share = np.linspace(0.0, 1.0, _steps(rows[k, 4]) + 1)
        chains.append(_along(start, end, rows[k, 4], share)[:-1])
        at = rows[k, 2] + share * (rows[k, 3] - rows[k, 2])
        widths.append(np.stack([at[:-1], at[1:]], axis=1))
    return np.concatenate([*chains, spots[-1:]]), np.concatenate(widths)


def _steps(bulge: float) -> int:
    return max(1, int(np.ceil(4 * abs(np.arctan(bulge)) / (np.pi / 2) * _STEPS)))


def _along(start: complex, end: complex, bulge: float, share: NDArray[np.float64]) -> NDArray[np.complex128]:
    """Return points of a piece; the bulge is the tangent of a quarter of its turn."""
    if bulge == 0:
        return np.asarray(start + share * (end - start), dtype=np.complex128)
    centre = (start + end) / 2 + 1j * (end - start) * (1 - bulge * bulge) / (4 * bulge)
    turn = 4 * np.arctan(bulge) * share
    return np.asarray(centre + (start - centre) * np.exp(1j * turn), dtype=np.complex128)
