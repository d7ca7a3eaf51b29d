"""How wide the passages of a floor are: the widest robot that still gets nearly everywhere, found by trying widths."""

from collections.abc import Callable
from functools import partial
from math import ceil, inf, nextafter, sqrt
from typing import TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label, maximum_filter
from shapely.geometry import MultiPolygon, Polygon

Area: TypeAlias = Polygon | MultiPolygon
Mask: TypeAlias = NDArray[np.bool_]

_REACH = 0.95  # share of the floor that must stay within reach
_WIDEST_M = 8.0  # wider passages are not told apart
_PRECISION_M = 0.01
_MANY_TURNS, _SHORT_M = 300, 0.03  # half right ones, between sides so short: the contour of pixels
_TURN, _RIGHT_TURN = 0.2, 1.0  # least angles [rad] of half a right turn and of a right one, with some play
_MANY_STAIRS, _STAIR_M = 1_000, 0.5  # right turns between sides so short: moved at once they take minutes
_MOST_CORNERS = 20_000
_STAIR_CELLS = 400_000
_MOST_CROSSINGS = 4_000_000  # of sides with rows, at a time
_SIDES_A_STEP = 1.5
_MOST_STEPS = 200
_CLEAR = 0.02  # what steps say of a reach this close to the one that is needed is not trusted
_JUST_BELOW = 1 - 1e-12
_MOST_CELLS = 6_000_000  # of more, several are looked at as one: scans have pixels far smaller than any robot
_LARGE = 30_000  # cells in a row, whose square no longer fits 32 bits
_CLOSED_M = 1e-6  # a passage as wide as the robot is closed; in steps, rounding would leave some of them open


def passage_width(free: Area) -> float | None:
    """Return the width of the widest robot that still reaches 95 % of the floor a point reaches [m], to 1 cm.

    A doorway to less than 5 % of the floor is not seen, and passages above 8 m count as 8 m. None without a floor.
    """
    needed = _REACH * _largest_part(free).area
    if needed == 0:
        return None
    if _is_staircase(free):
        return _passage_width_on_cells(free)
    side = _side_of_contour(free)
    return _widest(partial(_reaches, free, needed) if side is None else _step_by_step(free, needed, side))


def grid_passage_width(free: Mask, resolution: float) -> float | None:
    """Return the same as `passage_width`, for free cells [rows, cols] of ``resolution`` [m]."""
    if not free.any():
        return None
    rows, cols = (np.flatnonzero(free.any(axis=axis)) for axis in (1, 0))
    floor = free[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]  # the rest changes nothing, and is most of a laser map
    if floor.size > _MOST_CELLS:
        several = ceil(sqrt(floor.size / _MOST_CELLS))
        floor, resolution = _pooled(floor, several), resolution * several
        if not floor.any():
            return 0.0
    floor = np.pad(floor, 1)
    clearance = _squared_distances(floor)
    needed = _REACH * np.count_nonzero(_largest_patch(floor))

    def reaches(width: float) -> bool:
        core = _largest_patch(clearance >= _first_square(nextafter(width / 2, inf), resolution))
        radius = width / 2 / resolution
        # Squares within and around the disc that is the robot are moved far faster, and decide most of the tries.
        if _reached(core, floor, int(radius / sqrt(2) * _JUST_BELOW)) >= needed:
            return True
        if _reached(core, floor, ceil(radius)) < needed:
            return False
        within = _squared_distances(~core) < _first_square(width / 2, resolution)
        return bool(np.count_nonzero(within & floor) >= needed)

    return _widest(reaches)


def _widest(reaches: Callable[[float], bool]) -> float:
    """Bisect for the largest width [m] that ``reaches`` enough of the floor; a wider robot never reaches more."""
    low, high = 0.0, _WIDEST_M
    while high - low > _PRECISION_M:
        middle = (low + high) / 2
        low, high = (middle, high) if reaches(middle) else (low, middle)
    return round(high, 2) if high == _WIDEST_M else round(low, 2)


def _reaches(free: Area, needed: float, width: float) -> bool:
    """Return whether a robot of ``width`` [m] reaches the area ``needed`` [m2] of the largest part it can be in."""
    core = _largest_part(_moved(free, -width / 2))
    return bool(core.area >= needed or _moved(core, width / 2).area >= needed)


def _is_staircase(free: Area) -> bool:
    """Return whether an outline crosses itself too often, when moved, to be measured as it is."""
    length, turn = _sides(free)
    right = int(np.count_nonzero(turn > _RIGHT_TURN))
    stairs = right > _MANY_STAIRS and 2 * right > len(turn) and float(np.median(length)) < _STAIR_M
    return stairs or len(length) > _MOST_CORNERS


def _passage_width_on_cells(free: Area) -> float | None:
    """Return the width of the passages [m], to the side of a cell: 1 cm, or more where that made too many of them."""
    low_x, low_y, high_x, high_y = free.bounds
    cell = max(_PRECISION_M, sqrt((high_x - low_x) * (high_y - low_y) / _STAIR_CELLS))
    return grid_passage_width(_covered(free, cell), cell)


def _covered(free: Area, cell: float) -> Mask:
    """Return the cells of the side ``cell`` [m] whose middle lies in ``free``: [rows, cols], over its bounds.

    A side of the outline turns all cells to its right over, in each row whose middle line it meets. (Asking for every
    cell whether it lies within takes minutes where thousands of sides run past each row.)
    """
    low_x, low_y, high_x, high_y = free.bounds
    rows, cols = (ceil((high - low) / cell) for low, high in ((low_y, high_y), (low_x, high_x)))
    corners, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(free)), return_index=True)
    x, y = ((corners - (low_x, low_y)) / cell - 0.5).T
    sides = np.stack([x[:-1], y[:-1], x[1:], y[1:]])[:, ring[:-1] == ring[1:]]
    turns = np.zeros(rows * (cols + 1), dtype=np.int64)
    for part in np.array_split(sides, ceil(sides.shape[1] * rows / _MOST_CROSSINGS), axis=1):
        x0, y0, x1, y1 = part
        first, stop = (np.ceil(end(y0, y1)).astype(np.int64).clip(0, rows) for end in (np.minimum, np.maximum))
        count = stop - first
        side = np.repeat(np.arange(count.size), count)
        row = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count - first, count)
        met = x0[side] + (row - y0[side]) * ((x1 - x0)[side] / (y1 - y0)[side])
        turns += np.bincount(row * (cols + 1) + np.ceil(met).astype(np.int64).clip(0, cols), minlength=turns.size)
    return np.asarray(turns.reshape(rows, -1).cumsum(axis=1)[:, :cols] % 2 == 1)


def _side_of_contour(free: Area) -> float | None:
    """Return how long most sides of the contour of pixels are [m], along and across them; None for other outlines."""
    length, turn = _sides(free)
    right = int(np.count_nonzero(turn > _RIGHT_TURN))
    half = int(np.count_nonzero(turn > _TURN)) - right
    side = float(np.median(length))
    return side if half > max(_MANY_TURNS, 2 * right) and side < _SHORT_M else None


def _sides(free: Area) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the length of each side of an outline [m], and the angle of each turn between two [rad], 0 to pi."""
    sides = np.diff(shapely.get_coordinates(free), axis=0)
    heading = np.arctan2(sides[:, 1], sides[:, 0])
    return np.hypot(*sides.T), np.abs((np.diff(heading) + np.pi) % (2 * np.pi) - np.pi)


def _step_by_step(free: Area, needed: float, side: float) -> Callable[[float], bool]:
    """Return `_reaches` for a floor whose outline is a contour of pixels with sides of the length ``side`` [m].

    Moved at once, such an outline crosses itself thousands of times, which takes seconds; moved again and again by
    about the length of its sides it hardly does. Its corners come out a little different then, so that only clear
    answers are taken.
    """
    step = max(_SIDES_A_STEP * side, _WIDEST_M / 2 / _MOST_STEPS)
    cores = {0: free}  # after 1, 2, 4, 8 and so on steps: every try begins at the nearest of them

    def reaches(width: float) -> bool:
        steps = int(width / 2 / step)
        begun = max(done for done in cores if done <= steps)
        narrow = cores[begun]
        for done in range(begun + 1, steps + 1):
            narrow = _moved(narrow, -step)
            if done.bit_count() == 1:
                cores[done] = narrow
        core = _largest_part(_moved(narrow, steps * step - width / 2 - _CLOSED_M, step))
        reach = _moved(core, width / 2, step).area
        if abs(reach - needed) < _CLEAR * needed:
            return _reaches(free, needed, width)
        return bool(reach >= needed)

    return reaches


def _moved(shape: Area, by_m: float, step_m: float = _WIDEST_M) -> Area:
    """Return ``shape`` grown by ``by_m`` [m], or shrunk where that is negative, in steps of at most ``step_m``."""
    steps = ceil(abs(by_m) / step_m)
    with np.errstate(all="ignore"):  # GEOS divides by zero where sides are parallel, and notices itself
        for _ in range(steps):
            shape = shapely.buffer(shape, by_m / steps, join_style="mitre")
    return shape


def _largest_part(shape: Area) -> Polygon:
    parts = shapely.get_parts(shape)
    return parts[int(np.argmax(shapely.area(parts)))] if len(parts) else Polygon()


def _largest_patch(marked: Mask) -> Mask:
    """Return the largest connected patch of ``marked`` cells [rows, cols]; none where none is marked."""
    patches, count = label(marked)
    return patches == 1 + int(np.argmax(np.bincount(patches.ravel())[1:])) if count else np.zeros_like(marked)


def _pooled(free: Mask, several: int) -> Mask:
    """Return one cell for ``several`` x ``several``: free where all of them are."""
    padded = np.pad(free, [(0, -length % several) for length in free.shape])
    rows, cols = (length // several for length in padded.shape)
    return np.asarray(padded.reshape(rows, several, cols, several).all(axis=(1, 3)))


def _reached(core: Mask, floor: Mask, half_side: int) -> int:
    """Return how many cells of the ``floor`` lie within ``half_side`` cells, along both axes, of one of ``core``."""
    covered = maximum_filter(core.view(np.uint8), size=2 * half_side + 1, mode="constant").view(np.bool_)
    return int(np.count_nonzero(covered & floor))


def _squared_distances(inside: Mask) -> NDArray[np.signedinteger]:
    """Return the square of the distance of each cell to the nearest one that is not ``inside`` [cells]."""
    nearest = distance_transform_edt(inside, return_distances=False, return_indices=True)
    rows, cols = nearest if max(inside.shape) < _LARGE else nearest.astype(np.int64)
    rows -= np.arange(inside.shape[0])[:, None]
    cols -= np.arange(inside.shape[1])
    rows *= rows
    cols *= cols
    squares: NDArray[np.signedinteger] = np.add(rows, cols, out=rows)
    return squares


def _first_square(distance_m: float, resolution: float) -> int:
    """Return the least whole number that is the square of a distance in cells not below ``distance_m`` [m]."""
    square = int((distance_m / resolution) ** 2) + 2
    while square > 0 and sqrt(square - 1) * resolution >= distance_m:
        square -= 1
    return square
