"""What a view would show: unseen cells within the sensor's reach, by their bearing.

Rays go from the centre of the viewpoint's cell through all that is not known to be an obstacle, unseen space included,
up to the sensor's reach (Gonzalez-Banos and Latombe 2002, section 4). Each unseen cell they cross counts once, in the
sector of its centre's bearing; for a field of view the sum over a window of sectors gives the gain, and the best window
the heading.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.beams import beam_directions, beam_tree
from pipeline.grids.distances import Indices
from pipeline.grids.occupancy import OCCUPIED, UNKNOWN, Cells
from pipeline.simulation.lidar import ALL_AROUND
from pipeline.simulation.protocols import Sensor

SECTORS = 72
"""Sector k holds the bearings from k x 5 degrees on, 0 along +x, counter-clockwise."""

Counts = NDArray[np.int64]


class Rays(NamedTuple):
    """Rays of a full circle as a tree of cells, parents before children.

    past: [nodes] int32, the next node that is not behind this one. offsets: [nodes, 2] int32, rows and columns from the
    viewpoint. sectors: [nodes] int32, of the cell's centre.
    """

    past: NDArray[np.int32]
    offsets: NDArray[np.int32]
    sectors: NDArray[np.int32]


class View(NamedTuple):
    """The best look from a place. unseen: cells. heading: [rad], None for a sensor that sees all around."""

    unseen: int
    heading: float | None


@lru_cache(maxsize=8)
def rays_of(beams: int, reach: float, cols: int) -> Rays:
    """Return ``beams`` evenly spaced rays of length ``reach`` [cells] on grids of ``cols`` columns."""
    tree = beam_tree(beams, reach, cols)
    signs = np.where(beam_directions(beams) > 0.0, 1, -1)[tree.end[:, 0]]
    offsets = np.stack([tree.end[:, 2] * signs[:, 1], tree.end[:, 3] * signs[:, 0]], axis=1)
    bearings = np.arctan2(offsets[:, 0], offsets[:, 1]) % ALL_AROUND
    sectors = np.floor(bearings / ALL_AROUND * SECTORS + 1e-9).astype(np.int32) % SECTORS
    return Rays(tree.way[:, 1].copy(), offsets.astype(np.int32), sectors)


class Lookout:
    """Weighs views in one trial's map, for its sensor.

    known: [rows, cols] what the robot knows, read as it grows. opaque: [rows, cols], what stops a ray where OCCUPIED:
    the same map, or the truth for whoever may know it. resolution: side of a cell [m].
    """

    def __init__(self, sensor: Sensor, beams: int, known: Cells, opaque: Cells, resolution: float) -> None:
        """Make room."""
        self._known, self._opaque = known, opaque
        reach = sensor.reach_m / resolution
        self._rays = rays_of(beams, reach, known.shape[1])
        self._around = sensor.field_of_view >= ALL_AROUND
        self._width = max(1, int(sensor.field_of_view / ALL_AROUND * SECTORS + 1e-9))
        self._stamps, self._stamp = np.zeros(known.size, dtype=np.int32), 0
        share = 1.0 if self._around else self._width / SECTORS
        self.most = int(np.pi * (reach + 1.0) * ((reach + 1.0) * share + 2.0)) + 2
        """No view shows more cells."""

    def sectors(self, cell: int) -> Counts:
        """Return the unseen cells in view of the flat ``cell``, sector by sector: [SECTORS] int64."""
        self._stamp += 1
        row, col = divmod(cell, self._known.shape[1])
        return count_unseen(self._known, self._opaque, row, col, *self._rays, self._stamps, self._stamp)

    def view(self, cell: int) -> View:
        """Return the best look from the flat ``cell``."""
        return self.best(self.sectors(cell))

    def seen_from(self, cell: int, heading: float | None) -> int:
        """Return the unseen cells in view of the flat ``cell`` along ``heading``, which a `View` gave."""
        counts = self.sectors(cell)
        if heading is None:
            return int(counts.sum())
        first = round(heading / ALL_AROUND * SECTORS - self._width / 2.0)
        return int(np.take(counts, range(first, first + self._width), mode="wrap").sum())

    def best(self, counts: Counts) -> View:
        """Return the best look that ``counts`` allow: of equal windows the first."""
        if self._around:
            return View(int(counts.sum()), None)
        first, unseen = best_window(counts, self._width)
        return View(unseen, (first + self._width / 2.0) / SECTORS * ALL_AROUND % ALL_AROUND)


@njit(cache=True, nogil=True)
def count_unseen(
    known: Cells,
    opaque: Cells,
    row: int,
    col: int,
    past: NDArray[np.int32],
    offsets: NDArray[np.int32],
    sectors: NDArray[np.int32],
    stamps: Indices,
    stamp: int,
) -> Counts:
    """Return how many UNKNOWN cells of ``known`` the rays from (row, col) cross, by sector: [SECTORS] int64.

    A ray ends before a cell that ``opaque`` has as OCCUPIED, and before the outermost ring.
    stamps: [cells] int32, none of them ``stamp``; which then marks the cells that were counted.
    """
    rows, cols = known.shape
    counts = np.zeros(SECTORS, dtype=np.int64)
    node = 0
    while node < past.size:
        there, across = row + offsets[node, 0], col + offsets[node, 1]
        inside = 0 < there < rows - 1 and 0 < across < cols - 1
        if not inside or opaque[there, across] == OCCUPIED:
            node = past[node]
            continue
        if known[there, across] == UNKNOWN:
            cell = there * cols + across
            if stamps[cell] != stamp:
                stamps[cell] = stamp
                counts[sectors[node]] += 1
        node += 1
    return counts


@njit(cache=True, nogil=True)
def best_window(counts: Counts, width: int) -> tuple[int, int]:
    """Return the first sector of the ``width`` neighbouring ones with the largest sum, and that sum."""
    total = 0
    for k in range(width):
        total += counts[k]
    best, most = 0, total
    for first in range(1, counts.size):
        total += counts[(first + width - 1) % counts.size] - counts[first - 1]
        if total > most:
            best, most = first, total
    return best, most
