"""Exact range scans on a grid and their insertion into a partial map.

Beams start at a cell's centre and visit every cell they cross, in order (Amanatides and Woo 1987), so nothing is
stepped over. A beam through the exact corner of four cells enters the neighbour in x first, and thus never slips
between two obstacles that touch in a corner. Casting and insertion share the same arithmetic, and a scan says which
cell it hit: at a corner two cells are entered at one distance, so the range alone does not tell.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN, Cells
from pipeline.grids.partial_map import BLOCKED, CLEAR, UNSEEN

Ranges = NDArray[np.float64]
NOTHING = -1


class Scan(NamedTuple):
    """What the beams met.

    ranges: [beams] float64, distance to the first cell that is not FREE [cells]; the maximum where nothing was met.
    hits: [beams] int32, flat index of that cell, NOTHING where nothing was met.
    """

    ranges: Ranges
    hits: NDArray[np.int32]


def beam_directions(beams: int) -> NDArray[np.float64]:
    """Return unit vectors (x, y) of ``beams`` directions counter-clockwise from the x axis: [beams, 2]."""
    angles = 2.0 * np.pi * np.arange(beams) / beams
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


@njit(cache=True, nogil=True)
def cast_rays(cells: Cells, row: int, col: int, directions: NDArray[np.float64], max_range: float) -> Scan:
    """Return what beams from the centre of (row, col) meet within ``max_range`` [cells].

    ``cells`` needs a closed outermost ring.
    """
    ranges = np.empty(directions.shape[0])
    hits = np.full(directions.shape[0], NOTHING, dtype=np.int32)
    for beam in range(directions.shape[0]):
        dx, dy = directions[beam, 0], directions[beam, 1]
        step_x = 1 if dx > 0 else -1
        step_y = 1 if dy > 0 else -1
        delta_x = 1.0 / abs(dx) if dx != 0.0 else np.inf
        delta_y = 1.0 / abs(dy) if dy != 0.0 else np.inf
        next_x, next_y = 0.5 * delta_x, 0.5 * delta_y
        r, c = row, col
        while True:
            if next_x <= next_y:
                travelled = next_x
                next_x += delta_x
                c += step_x
            else:
                travelled = next_y
                next_y += delta_y
                r += step_y
            if travelled >= max_range:
                ranges[beam] = max_range
                break
            if cells[r, c] != FREE:
                # Where the beam enters the cell, from its place alone: no rounding gathers along the way.
                ranges[beam] = max((abs(c - col) - 0.5) * delta_x, (abs(r - row) - 0.5) * delta_y)
                hits[beam] = r * cells.shape[1] + c
                break
    return Scan(ranges, hits)


@njit(cache=True, nogil=True)
def insert_scan(
    known: Cells,
    status: Cells,
    row: int,
    col: int,
    directions: NDArray[np.float64],
    scan: Scan,
    disk: NDArray[np.int32],
) -> int:
    """Write a scan of ``cast_rays`` into ``known`` and ``status`` in place; return the number of newly seen cells.

    disk: [k, 2] int32 offsets that an obstacle blocks for the robot's centre (``disk_offsets``).
    """
    cols = known.shape[1]
    seen, room = known.ravel(), status.ravel()  # views: indexing flat arrays is what keeps this loop fast
    fresh = 0
    home = row * cols + col
    if seen[home] == UNKNOWN:
        seen[home] = FREE
        fresh += 1
        if room[home] == UNSEEN:
            room[home] = CLEAR
    for beam in range(directions.shape[0]):
        dx, dy = directions[beam, 0], directions[beam, 1]
        step_x, step_y = 1 if dx > 0 else -1, 1 if dy > 0 else -1
        delta_x = 1.0 / abs(dx) if dx != 0.0 else np.inf
        delta_y = 1.0 / abs(dy) if dy != 0.0 else np.inf
        next_x, next_y = 0.5 * delta_x, 0.5 * delta_y
        reach, hit = scan.ranges[beam], scan.hits[beam]
        step_row = step_y * cols
        cell = home
        while True:
            if next_x <= next_y:
                travelled = next_x
                next_x += delta_x
                cell += step_x
            else:
                travelled = next_y
                next_y += delta_y
                cell += step_row
            if cell == hit:
                if seen[cell] != OCCUPIED:
                    seen[cell] = OCCUPIED
                    fresh += 1
                    block_around(status, cell // cols, cell % cols, disk)
                break
            if hit == NOTHING and travelled >= reach:
                break
            if seen[cell] == UNKNOWN:
                seen[cell] = FREE
                fresh += 1
                if room[cell] == UNSEEN:
                    room[cell] = CLEAR
    return fresh


@njit(cache=True, nogil=True)
def block_around(status: Cells, row: int, col: int, disk: NDArray[np.int32]) -> None:
    """Mark in ``status`` where an obstacle at (row, col) keeps the robot's centre away."""
    rows, cols = status.shape
    for k in range(disk.shape[0]):
        r, c = row + disk[k, 0], col + disk[k, 1]
        if 0 <= r < rows and 0 <= c < cols:
            status[r, c] = BLOCKED
