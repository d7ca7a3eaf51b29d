"""Areas of grid cells: marked cells to the polygons around them, and such polygons back to exactly these cells."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.ndimage import label
from shapely.geometry import MultiPolygon, Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Location

Mask: TypeAlias = NDArray[np.bool_]
Area: TypeAlias = Polygon | MultiPolygon

_MOST_CORNERS = 2_000_000  # which take some seconds to follow
_OFF_CORNER = 1e-3  # of a cell: what other tools round off


@dataclass(frozen=True)
class CellRaster:
    """Cells of side ``resolution`` [m]; ``origin`` is the outer corner of cell [0, 0] [m]."""

    resolution: float
    origin: Location
    rows: int
    cols: int

    def area_of(self, marked: Mask) -> MultiPolygon:
        """Return the area of the cells ``marked`` [rows, cols] [m]; outlines have corners only where they turn.

        Cells that touch at a corner alone are parts of their own.

        Raises:
            PlanError: the cells are so scattered that an area says nothing.
        """
        corners = _corners_of(marked)
        if len(corners.vertex) > _MOST_CORNERS:
            raise PlanError(
                f"its areas of cells have {len(corners.vertex):,} corners, at most {_MOST_CORNERS:,} are drawn"
            )
        rings = list(_rings(corners))
        if not rings:
            return MultiPolygon()
        of_ring = np.repeat(np.arange(len(rings)), [len(ring) for ring in rings])
        places = corners.places[np.concatenate(rings)]
        row, col = corners.cells[[ring[0] for ring in rings]].T
        part = label(marked)[0][row, col]
        order = np.lexsort((_areas(places, of_ring) < 0, part))  # of each part, its outline before its holes
        lines = shapely.linearrings(places * self.resolution + list(self.origin), indices=of_ring)
        return MultiPolygon(shapely.polygons(lines[order], indices=part[order] - 1).tolist())

    def cells_in(self, area: Area) -> Mask:
        """Return which cells [rows, cols] lie in ``area`` [m], whose edges run along the cells.

        Raises:
            PlanError: an edge runs across a cell, or beyond the grid.
        """
        rings = shapely.get_rings(shapely.get_parts(area))
        metres, ring = shapely.get_coordinates(rings, return_index=True)
        places = (metres - list(self.origin)) / self.resolution
        corners = np.rint(places)
        along = ring[:-1] == ring[1:]
        slanted = along & (np.diff(corners, axis=0) != 0).all(axis=1)
        if (np.abs(places - corners) > _OFF_CORNER).any() or slanted.any():
            raise PlanError(f"an edge does not run along the cells of {self.resolution:g} m. Draw it along them.")
        if ((corners < 0) | (corners > [self.cols, self.rows])).any():
            raise PlanError(f"it reaches beyond the grid of {self.rows} x {self.cols} cells. Correct shape or origin.")
        x, y = corners.astype(np.int64).T
        upright = along & (np.diff(x, append=x[-1:])[:-1] == 0)
        turns = np.zeros((self.rows + 1, self.cols + 1), dtype=np.uint8)
        for ends in (y[:-1], y[1:]):
            np.bitwise_xor.at(turns, (ends[upright], x[:-1][upright]), 1)
        # Even-odd: an edge at column x turns over all cells to its right in the rows between its ends.
        inside = np.bitwise_xor.accumulate(np.bitwise_xor.accumulate(turns, axis=0), axis=1)
        return inside[:-1, :-1].astype(bool)


class _Corners(NamedTuple):
    """Where the outlines of marked cells turn, followed with the cells to the left.

    places: [corners, 2] x and y [cells]. vertex: one number for each place; two corners may share it. follower: the
    corner that comes next. cells: [corners, 2] row and column of the cell to the left of the side that begins there.
    """

    places: NDArray[np.int64]
    vertex: NDArray[np.int64]
    follower: NDArray[np.int64]
    cells: NDArray[np.int64]


def _corners_of(marked: Mask) -> _Corners:
    """Return the corners of the marked cells, one for each straight run of sides that no other cell adjoins."""
    cols = marked.shape[1]
    around = np.pad(marked, 1)
    row, low, high = _runs(marked & ~around[:-2, 1:-1])
    east = (low, row, high, row, row, low)
    col, low, high = _runs((marked & ~around[1:-1, 2:]).T)
    north = (col + 1, low, col + 1, high, low, col)
    row, low, high = _runs(marked & ~around[2:, 1:-1])
    west = (high, row + 1, low, row + 1, row, high - 1)
    col, low, high = _runs((marked & ~around[1:-1, :-2]).T)
    south = (col, high, col, low, high - 1, col)
    heading = np.repeat(np.arange(4), [len(side[0]) for side in (east, north, west, south)])
    x, y, end_x, end_y, cell_row, cell_col = np.hstack([np.array(side) for side in (east, north, west, south)])
    vertex, end = y * (cols + 1) + x, end_y * (cols + 1) + end_x
    begun = vertex * 4 + heading
    order = np.argsort(begun)
    left, right = end * 4 + (heading + 1) % 4, end * 4 + (heading + 3) % 4
    turns_left = np.isin(left, begun)  # first: where two cells touch at a corner, the outline stays with its own
    follower = order[np.searchsorted(begun[order], np.where(turns_left, left, right))]
    return _Corners(np.column_stack([x, y]), vertex, follower, np.column_stack([cell_row, cell_col]))


def _runs(sides: Mask) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the line, the first and one past the last place of each run of ``sides`` [lines, places]."""
    steps = np.diff(np.pad(sides, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    line, first = np.nonzero(steps == 1)
    return line, first, np.nonzero(steps == -1)[1]


def _rings(corners: _Corners) -> Iterator[list[int]]:
    """Yield the corners of each outline and hole; what meets itself at a corner is cut into simple rings there."""
    follower, vertex = corners.follower.tolist(), corners.vertex.tolist()
    met = bytearray(len(follower))
    for corner in range(len(follower)):
        path: list[int] = []
        place: dict[int, int] = {}
        while not met[corner]:
            met[corner] = True
            begun = place.get(vertex[corner])
            if begun is not None:
                yield path[begun:]
                for passed in path[begun:]:
                    del place[vertex[passed]]
                del path[begun:]
            place[vertex[corner]] = len(path)
            path.append(corner)
            corner = follower[corner]
        if path:
            yield path


def _areas(places: NDArray[np.int64], of_ring: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the area of each ring [cells], below 0 where it runs clockwise around a hole."""
    first = np.flatnonzero(np.diff(of_ring, prepend=-1))
    follower = np.arange(1, len(places) + 1)
    follower[np.append(first[1:], len(places)) - 1] = first
    (x, y), (next_x, next_y) = places.T, places[follower].T
    return np.bincount(of_ring, weights=x * next_y - next_x * y) / 2
