"""A car that follows a path by arcs of constant curvature, as the robots of the papers do (LSP's RC car).

Of 65 arcs, driven as the car stands or after turning round at double cost, it takes the one from which the rest of the
way looks shortest, among those that stay in space seen to be free and come back to the path further on. Where there is
none, it turns on the spot in short strokes back and forth: the shorter the strokes, the less room they need, and in the
limit they need none and their arcs add up to the turning radius times the angle. It then drives straight to the next
cell of the path. Each command thus leaves fewer cells of the path ahead, so the car arrives wherever a walk does.

The car's centre may be anywhere in a cell; like all planning here, it takes the cell for where it stands, both for its
radius and for what it sees.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.grids.distances import NOWHERE, Indices, Status, wide
from pipeline.grids.partial_map import CLEAR, PartialMap
from pipeline.planning.seen import Pose
from pipeline.simulation.motion import touched_at
from pipeline.simulation.protocols import Move
from pipeline.simulation.world import World

_SPACING = 0.05  # between two points of an arc [cells]; each answers for the square around it, so that none is missed
_SHORTEST = 1.5  # of an arc [cells]: a shorter one hardly leaves its cell
_HEADING = 0.5  # how much of the cost of turning on the spot a heading off the path is reckoned at
_FULL = 2.0 * np.pi


class Car(NamedTuple):
    """A car-like robot.

    turning_radius_m: of its tightest arc [m]. primitives: number of arcs, from full left to full right.
    """

    turning_radius_m: float
    primitives: int = 65

    @property
    def undercut(self) -> float:
        """Cutting corners and going at any angle saves less than half of an 8-connected way around the same corners."""
        return 0.5

    def follow(self, path: Indices, map_: PartialMap, pose: Pose, world: World, length: float) -> Move:
        """Drive one arc of ``length`` [cells], or half of it, or straight to the next cell."""
        radius, reach = self.turning_radius_m / world.grid.resolution, max(length, _SHORTEST)
        status, stand = map_.status, (pose.row + pose.north, pose.col + pose.east)
        turned, curvature, part, onward, joined = choose_arc(
            path, status, *stand, pose.heading, reach, radius, self.primitives
        )
        if onward < 0:
            return self._straight(path, map_, pose, world, radius)
        heading = pose.heading + (np.pi if turned else 0.0)
        way = arc(*stand, heading, curvature, part)
        cells = cells_of(way, status.shape[1])
        free = free_points(world.blocked, way)
        if free < len(way):
            return self._stopped(path, map_, pose, world, way, free, turned * about(reach, radius))
        end = _pose_at(way[-1], heading + curvature * part)
        passed = cells[np.flatnonzero(np.diff(cells)) + 1]
        rest = path[onward:] if joined else np.append(cells[-1:], path[onward:])
        return Move(end, part + turned * about(reach, radius), passed, rest.astype(np.int32), NOWHERE, way)

    def turn(self, pose: Pose, heading: float, resolution: float) -> Move:
        """Turn on the spot in strokes: the turning radius times the angle."""
        cost = self.turning_radius_m / resolution * abs(_turned(heading - pose.heading))
        return Move(pose._replace(heading=heading % _FULL), cost, NOWHERE, NOWHERE, NOWHERE, _standing(pose))

    def _straight(self, path: Indices, map_: PartialMap, pose: Pose, world: World, radius: float) -> Move:
        """Turn to the next cell of ``path`` and drive to its centre, which lies in free space with all between."""
        cols = map_.status.shape[1]
        (row, col), (to_row, to_col) = divmod(int(path[0]), cols), divmod(int(path[1]), cols)
        corners = np.array([path[1], row * cols + to_col, to_row * cols + col], dtype=np.int32)
        if (map_.status.ravel()[corners] != CLEAR).any():
            return Move(pose, 0.0, NOWHERE, path, NOWHERE, _standing(pose))
        if world.blocked.ravel()[corners].any():
            touched = touched_at(map_, world.grid.cells, world.disk, corners)
            return Move(pose, 0.0, NOWHERE, path, touched, _standing(pose))
        stand = _standing(pose)[0]
        north, east = to_row - stand[0], to_col - stand[1]
        heading, ahead = float(np.arctan2(north, east)), float(np.hypot(north, east))
        share = np.linspace(0.0, 1.0, int(np.ceil(ahead)) + 1)[:, None]
        way = stand + share * np.array([north, east])
        cost = ahead + radius * abs(_turned(heading - pose.heading))
        return Move(Pose(to_row, to_col, heading % _FULL), cost, path[1:2], path[1:], NOWHERE, way)

    def _stopped(
        self,
        path: Indices,
        map_: PartialMap,
        pose: Pose,
        world: World,
        way: NDArray[np.float64],
        free: int,
        cost: float,
    ) -> Move:
        """Return how far the car came along ``way`` when an obstacle that hid stopped it after ``free`` points."""
        cols = map_.status.shape[1]
        touched = touched_at(map_, world.grid.cells, world.disk, squares_of(way[free : free + 1], cols))
        if free < 2:
            return Move(pose, 0.0, NOWHERE, path, touched, _standing(pose))
        driven = way[:free]
        north, east = driven[-1] - driven[-2]
        cells = cells_of(driven, cols)
        passed = cells[np.flatnonzero(np.diff(cells)) + 1]
        end = _pose_at(driven[-1], float(np.arctan2(north, east)))
        return Move(end, cost + (free - 1) * _SPACING, passed, NOWHERE, touched, driven)


@njit(cache=True, nogil=True)
def choose_arc(
    path: Indices,
    status: Status,
    row: float,
    col: float,
    heading: float,
    reach: float,
    radius: float,
    primitives: int,
) -> tuple[bool, float, float, int, bool]:
    """Return the best arc from (row, col) [cells] facing ``heading``.

    Returns whether the car turns round first, the arc's curvature [1 / cells], its length [cells], the place in
    ``path`` at which it goes on, -1 where driving straight to the next cell is better or no arc can be driven, and
    whether the arc ends in that very cell rather than beside it.
    """
    cols = status.shape[1]
    last = min(path.size - 1, int(np.ceil(reach)) + 4)
    along = np.zeros(last + 1)
    for k in range(1, last + 1):
        step = abs(wide(path[k]) - path[k - 1])
        along[k] = along[k - 1] + (1.0 if step in (1, cols) else np.sqrt(2.0))
    to_row, to_col = path[1] // cols, path[1] % cols
    ahead = np.arctan2(to_row - row, to_col - col)
    best = radius * abs(_turned(ahead - heading)) + np.hypot(to_row - row, to_col - col) - along[1]
    best += _off(path, cols, 1, last, float(to_row), float(to_col), ahead, radius)
    found = (False, 0.0, 0.0, -1, False)
    round_about = about(reach, radius)
    for turn in range(2):
        facing = heading + turn * np.pi
        for k in range(primitives):
            curvature = (2.0 * k / (primitives - 1) - 1.0) / radius
            for half in range(2):
                length = reach / (1.0 + half)
                cost = length + turn * round_about
                if cost - along[last] >= best or not _arc_is_clear(status, row, col, facing, curvature, length):
                    continue
                end_row, end_col = arc_end(row, col, facing, curvature, length)
                onward, joined = _rejoin(path, status, last, int(np.floor(end_row + 0.5)), int(np.floor(end_col + 0.5)))
                if onward < 0:
                    continue
                then = min(onward + 1, last) if joined else onward
                link = np.hypot(path[then] // cols - end_row, path[then] % cols - end_col)
                score = cost + link - along[then]
                score += _off(path, cols, onward, last, end_row, end_col, facing + curvature * length, radius)
                if score < best - 1e-9:
                    best, found = score, (turn == 1, curvature, length, onward, joined)
    return found


@njit(cache=True, nogil=True)
def about(reach: float, radius: float) -> float:
    """Return what turning round costs [cells]: twice a primitive, as in the papers, or strokes where they cost less."""
    return min(2.0 * reach, np.pi * radius)


@njit(cache=True, nogil=True)
def _off(
    path: Indices, cols: int, place: int, last: int, row: float, col: float, heading: float, radius: float
) -> float:
    """Return what it costs to face on along ``path`` from (row, col) near its cell ``place``, 0 at its end."""
    onward = min(place + 2, last)
    north, east = path[onward] // cols - row, path[onward] % cols - col
    if np.hypot(north, east) < 0.75:
        return 0.0
    return float(_HEADING * radius * abs(_turned(np.arctan2(north, east) - heading)))


@njit(cache=True, nogil=True)
def _rejoin(path: Indices, status: Status, last: int, row: int, col: int) -> tuple[int, bool]:
    """Return where ``path`` goes on from cell (row, col), -1 for nowhere ahead, and whether the cell is on it.

    From a cell beside the path, one move through free space leads back to it.
    """
    cols = status.shape[1]
    if row * cols + col == path[0]:
        return -1, False
    for k in range(last, 0, -1):
        there_row, there_col = path[k] // cols, path[k] % cols
        if there_row == row and there_col == col:
            return k, True
        if k >= 2 and abs(there_row - row) <= 1 and abs(there_col - col) <= 1:
            free = status[there_row, there_col] == CLEAR
            if free and status[row, there_col] == CLEAR and status[there_row, col] == CLEAR:
                return k, False
    return -1, False


@njit(cache=True, nogil=True)
def arc_end(row: float, col: float, heading: float, curvature: float, length: float) -> tuple[float, float]:
    """Return (row, col) [cells] at the end of an arc; curvature above 0 turns to the left."""
    if abs(curvature) < 1e-9:
        return row + length * np.sin(heading), col + length * np.cos(heading)
    end = heading + curvature * length
    return row + (np.cos(heading) - np.cos(end)) / curvature, col + (np.sin(end) - np.sin(heading)) / curvature


@njit(cache=True, nogil=True)
def _arc_is_clear(status: Status, row: float, col: float, heading: float, curvature: float, length: float) -> bool:
    """Return whether all cells that an arc enters are CLEAR: a square around each of its points covers it wholly."""
    rows, cols = status.shape
    points, near = int(np.ceil(length / _SPACING)), 0.5 * _SPACING
    for k in range(points, -1, -1):  # the far end is the likelier to lie in a wall
        r, c = arc_end(row, col, heading, curvature, length * k / points)
        low, high = int(np.floor(r - near + 0.5)), int(np.floor(r + near + 0.5))
        left, right = int(np.floor(c - near + 0.5)), int(np.floor(c + near + 0.5))
        if low < 0 or left < 0 or high >= rows or right >= cols:
            return False
        if k == 0:
            continue  # it stands there
        if status[low, left] != CLEAR or status[low, right] != CLEAR:
            return False
        if status[high, left] != CLEAR or status[high, right] != CLEAR:
            return False
    return True


@njit(cache=True, nogil=True)
def arc(row: float, col: float, heading: float, curvature: float, length: float) -> NDArray[np.float64]:
    """Return points of an arc, its ends among them: [k, 2] (row, col) in cells."""
    points = int(np.ceil(length / _SPACING))
    way = np.empty((points + 1, 2))
    for k in range(points + 1):
        way[k, 0], way[k, 1] = arc_end(row, col, heading, curvature, length * k / points)
    return way


@njit(cache=True, nogil=True)
def squares_of(points: NDArray[np.float64], cols: int) -> Indices:
    """Return the flat cells under the corners of the square around each of ``points``: [4 k]."""
    near = 0.5 * _SPACING
    cells = np.empty(4 * points.shape[0], dtype=np.int32)
    for k in range(points.shape[0]):
        for corner in range(4):
            row = int(np.floor(points[k, 0] + (near if corner < 2 else -near) + 0.5))
            col = int(np.floor(points[k, 1] + (near if corner % 2 else -near) + 0.5))
            cells[4 * k + corner] = row * cols + col
    return cells


@njit(cache=True, nogil=True)
def free_points(blocked: Status, way: NDArray[np.float64]) -> int:
    """Return how many points of ``way`` the car passes before the square around one enters a ``blocked`` cell."""
    cells, flat = squares_of(way, blocked.shape[1]), blocked.ravel()
    for k in range(4, cells.size):  # it stands at the first
        if flat[cells[k]]:
            return k // 4
    return int(way.shape[0])


@njit(cache=True, nogil=True)
def cells_of(way: NDArray[np.float64], cols: int) -> Indices:
    """Return the flat cell that holds each point of ``way``."""
    cells = np.empty(way.shape[0], dtype=np.int32)
    for k in range(cells.size):
        cells[k] = int(np.floor(way[k, 0] + 0.5)) * cols + int(np.floor(way[k, 1] + 0.5))
    return cells


@njit(cache=True, nogil=True)
def _turned(angle: float) -> float:
    """Return ``angle`` within half a circle of 0."""
    return (angle + np.pi) % _FULL - np.pi


def _pose_at(point: NDArray[np.float64], heading: float) -> Pose:
    row, col = (int(np.floor(value + 0.5)) for value in point)
    return Pose(row, col, heading % _FULL, float(point[1]) - col, float(point[0]) - row)


def _standing(pose: Pose) -> NDArray[np.float64]:
    return np.array([[pose.row + pose.north, pose.col + pose.east]])
