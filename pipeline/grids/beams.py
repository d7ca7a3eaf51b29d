"""The beams of a lidar as a tree of cells: what many beams have in common is walked only once.

Beams start at a cell's centre and visit every cell they cross, in order (Amanatides and Woo 1987), so nothing is
stepped over. A beam through the exact corner of four cells enters the neighbour in x first, and thus never slips
between two obstacles that touch in a corner. As a robot always stands at a cell's centre, the cells of a beam relative
to it are the same in every place; beams next to each other share their first cells, so all of them together form a
tree, and a thousand beams cost hardly more than the cells they see.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class BeamTree(NamedTuple):
    """All cells of all beams within ``max_range``, parents before children, beam by beam.

    way: [nodes, 2] int32: a node's flat cell minus the robot's, and the next node that is not behind this one.
    end: [nodes, 4] int32: the beams through a node are the first number and on, up to but not the second; then the
        number of rows and of columns between the node and the robot.
    pace: [beams, 2] float64, length of a beam [cells] for one cell along x and along y.
    max_range: [cells].
    """

    way: NDArray[np.int32]
    end: NDArray[np.int32]
    pace: NDArray[np.float64]
    max_range: float


def beam_directions(beams: int) -> NDArray[np.float64]:
    """Return unit vectors (x, y) of ``beams`` directions counter-clockwise from the x axis: [beams, 2]."""
    angles = 2.0 * np.pi * np.arange(beams) / beams
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


@lru_cache(maxsize=8)
def beam_tree(beams: int, max_range: float, cols: int) -> BeamTree:
    """Return the tree of ``beams`` evenly spaced beams of ``max_range`` [cells] on grids of ``cols`` columns.

    The last few are kept: trials come plan by plan.
    """
    return plant_beams(beam_directions(beams), max_range, cols)


def plant_beams(directions: NDArray[np.float64], max_range: float, cols: int) -> BeamTree:
    """Return the tree of beams along ``directions``, [beams, 2] unit vectors (x, y) in order of their angle."""
    pace = np.full(directions.shape, np.inf)
    np.divide(1.0, np.abs(directions), out=pace, where=directions != 0.0)
    nodes = int(np.ceil(max_range * np.abs(directions).sum(axis=1) + 2.0).sum())
    way, end = np.empty((nodes, 2), dtype=np.int32), np.empty((nodes, 4), dtype=np.int32)
    count = _grow(directions, pace, max_range, cols, way, end)
    return BeamTree(way[:count].copy(), end[:count].copy(), pace, max_range)


@njit(cache=True, nogil=True)
def _grow(
    directions: NDArray[np.float64],
    pace: NDArray[np.float64],
    max_range: float,
    cols: int,
    way: NDArray[np.int32],
    end: NDArray[np.int32],
) -> int:
    """Fill ``way`` and ``end`` of a BeamTree and return the number of nodes."""
    line = np.empty(way.shape[0], dtype=np.int32)  # the nodes of the beam before
    length, count = 0, 0
    for beam in range(directions.shape[0]):
        step_x = 1 if directions[beam, 0] > 0.0 else -1
        step_y = 1 if directions[beam, 1] > 0.0 else -1
        next_x, next_y = 0.5 * pace[beam, 0], 0.5 * pace[beam, 1]
        row, col, depth = 0, 0, 0
        shared = True  # so far the beam runs through the cells of the beam before
        while min(next_x, next_y) < max_range:
            if next_x <= next_y:
                next_x += pace[beam, 0]
                col += step_x
            else:
                next_y += pace[beam, 1]
                row += step_y
            if shared and depth < length and way[line[depth], 0] == row * cols + col:
                depth += 1
                continue
            if shared:
                _close(line[depth:length], way, end, count, beam)
                shared = False
            line[depth] = count
            way[count, 0] = row * cols + col
            end[count, 0], end[count, 2], end[count, 3] = beam, abs(row), abs(col)
            count += 1
            depth += 1
        if shared:
            _close(line[depth:length], way, end, count, beam)
        length = depth
    _close(line[:length], way, end, count, directions.shape[0])
    return count


@njit(cache=True, nogil=True)
def _close(nodes: NDArray[np.int32], way: NDArray[np.int32], end: NDArray[np.int32], count: int, beam: int) -> None:
    """End ``nodes``: ``beam`` does not run through them, and node ``count`` is not behind them."""
    for node in nodes:
        way[node, 1], end[node, 1] = count, beam
