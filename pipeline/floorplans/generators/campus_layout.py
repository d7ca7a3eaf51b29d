"""Where the corridors of a campus floor run, and which rows of rooms lie beside them.

All boxes are bounded by the middles of walls; half a wall comes off each side when free floor is made of them.
"""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

LEAST_DEPTH_M = 2.2  # a shallower gap beside a corridor stays solid
_FILL_M = 3.0  # a row this close to what lies behind it reaches back to it


class Box(NamedTuple):
    """An axis-parallel box [m]."""

    min_x: float
    min_y: float
    max_x: float
    max_y: float


class Hall(NamedTuple):
    """A straight corridor.

    axis: 0 runs along x, 1 along y. start, stop: along it; low, high: across it [m]. below, above: depth of the rows
    of rooms on its two sides [m]. before, after: how far those rows reach beyond its two ends [m].
    """

    axis: int
    start: float
    stop: float
    low: float
    high: float
    below: float
    above: float
    before: float
    after: float

    @property
    def box(self) -> Box:
        """The corridor as a box."""
        return oriented(self.axis, self.start, self.stop, self.low, self.high)


class Row(NamedTuple):
    """A row of rooms beside a corridor.

    hall: place of the corridor. axis: as the corridor's. start, stop: extent of the row along it; first, last: the part
    of it that touches the corridor [m]. near, far: across it, the wall to the corridor and the one behind [m].
    """

    hall: int
    axis: int
    start: float
    stop: float
    first: float
    last: float
    near: float
    far: float

    @property
    def box(self) -> Box:
        """The row as a box."""
        return oriented(self.axis, self.start, self.stop, min(self.near, self.far), max(self.near, self.far))


class Sizes(NamedTuple):
    """What was drawn for one floor [m]: outer lengths, corridor width, depth of rows, and how far rows pass ends."""

    length: float
    width: float
    corridor: float
    depth: Callable[[], float]
    end: float


def oriented(axis: int, start: float, stop: float, low: float, high: float) -> Box:
    """Return the box from ``start`` to ``stop`` along ``axis`` and from ``low`` to ``high`` across it."""
    return Box(start, low, stop, high) if axis == 0 else Box(low, start, high, stop)


def lay_halls(layout: str, sizes: Sizes, rng: np.random.Generator) -> list[Hall]:
    """Return the corridors of a floor of this layout (one of LAYOUTS); ``rng`` is consumed."""
    return _LAYOUTS[layout](sizes, rng)


def _slab(sizes: Sizes, rng: np.random.Generator) -> list[Hall]:
    return [_along(0, 0.0, sizes.length, 0.0, sizes)]


def _ell(sizes: Sizes, rng: np.random.Generator) -> list[Hall]:
    foot = _along(0, 0.0, sizes.length, 0.0, sizes)
    wing = _along(1, 0.0, sizes.width, sizes.length - sizes.corridor, sizes)
    return [foot._replace(after=wing.above), wing._replace(before=0.0)]


def _u(sizes: Sizes, rng: np.random.Generator) -> list[Hall]:
    foot, right = _ell(sizes, rng)
    left = _along(1, 0.0, sizes.width * rng.uniform(0.6, 1.0), 0.0, sizes)
    return [foot._replace(before=left.below), left._replace(before=0.0), right]


def _ring(sizes: Sizes, rng: np.random.Generator) -> list[Hall]:
    """Return a loop around a court, or around a core of rooms where the court would be narrow."""
    gap = max(sizes.width - 2 * sizes.corridor, 7.0)
    far = gap + sizes.corridor
    left, right = (_along(1, 0.0, far + sizes.corridor, x, sizes) for x in (0.0, sizes.length - sizes.corridor))
    foot, head = (
        _along(0, 0.0, sizes.length, y, sizes)._replace(before=left.below, after=right.above) for y in (0.0, far)
    )
    if gap < 20:  # a core: one row fills it, or two back to back
        split = gap if gap < 9 else gap * rng.uniform(0.35, 0.65)
        foot, head = foot._replace(above=split), head._replace(below=gap - split)
    halls = [foot, head, left._replace(before=0.0, after=0.0), right._replace(before=0.0, after=0.0)]
    if sizes.length > 45 and rng.random() < 0.6:
        x = sizes.length * rng.uniform(0.35, 0.65)
        halls.append(_along(1, 0.0, far + sizes.corridor, x, sizes)._replace(before=0.0, after=0.0))
    return halls


def _comb(sizes: Sizes, rng: np.random.Generator) -> list[Hall]:
    """Return a spine with wings to one side or to both."""
    spine = _along(0, 0.0, sizes.length, 0.0, sizes)
    halls = [spine]
    count = 1 + int(sizes.length > 40) + int(sizes.length > 65)
    pitch = sizes.length / count
    both = rng.random() < 0.4
    for k in range(count):
        x = pitch * (k + rng.uniform(0.3, 0.7))
        reach = sizes.width * rng.uniform(0.5, 0.9)
        halls.append(_along(1, 0.0, reach, x, sizes)._replace(before=0.0))
        if both and rng.random() < 0.7:
            reach = sizes.width * rng.uniform(0.3, 0.7)
            halls.append(_along(1, -reach, sizes.corridor, x, sizes)._replace(after=0.0))
    return halls


def _aitch(sizes: Sizes, rng: np.random.Generator) -> list[Hall]:
    """Return two parallel corridors with a bridge between them."""
    y = sizes.width * rng.uniform(0.3, 0.7)
    sides = [_along(1, 0.0, sizes.width, x, sizes) for x in (0.0, sizes.length - sizes.corridor)]
    return [_along(0, 0.0, sizes.length, y, sizes)._replace(before=0.0, after=0.0), *sides]


_LAYOUTS = {"slab": _slab, "ell": _ell, "u": _u, "ring": _ring, "comb": _comb, "aitch": _aitch}
LAYOUTS = tuple(_LAYOUTS)


def _along(axis: int, start: float, stop: float, low: float, sizes: Sizes) -> Hall:
    below, above = sizes.depth(), sizes.depth()
    return Hall(axis, start, stop, low, low + sizes.corridor, below, above, sizes.end, sizes.end)


def find_caps(halls: Sequence[Hall]) -> list[tuple[int, Box]]:
    """Return the place of a corridor and the box beyond its end, for each end that leads nowhere."""
    boxes = [hall.box for hall in halls]
    caps = []
    for place, hall in enumerate(halls):
        for near, far in ((hall.start, hall.start - hall.before), (hall.stop, hall.stop + hall.after)):
            if abs(far - near) < LEAST_DEPTH_M:
                continue
            middle = (hall.low + hall.high) / 2
            inside = oriented(hall.axis, near, near, middle, middle)
            joined = any(_holds(box, inside.min_x, inside.min_y) for k, box in enumerate(boxes) if k != place)
            if not joined:
                caps.append((place, oriented(hall.axis, min(near, far), max(near, far), hall.low, hall.high)))
    return caps


def lay_rows(halls: Sequence[Hall], caps: Sequence[Box]) -> list[Row]:
    """Return the rows of rooms beside ``halls``, none over another; the first corridors have the first choice."""
    taken = [*(hall.box for hall in halls), *caps]
    rows = []
    for place, hall in enumerate(halls):
        for near, depth, sign in ((hall.low, hall.below, -1), (hall.high, hall.above, 1)):
            for row in _rows_beside(place, hall, near, depth, sign, taken):
                rows.append(row)
                taken.append(row.box)
    return rows


def _rows_beside(place: int, hall: Hall, near: float, depth: float, sign: int, taken: Sequence[Box]) -> list[Row]:
    """Return the rows along one side, cut where something stands in the way and as deep as there is room."""
    lower, upper = hall.start - hall.before, hall.stop + hall.after
    spans = [_along_axis(box, hall.axis) for box in taken]
    cuts = {lower, hall.start, hall.stop, upper} | {u for low, high, _, _ in spans for u in (low, high)}
    edges = sorted(u for u in cuts if lower <= u <= upper)
    rows: list[Row] = []
    for start, stop in pairwise(edges):
        if stop - start < 1e-6:
            continue
        gaps = [
            (v0 - near) if sign > 0 else (near - v1)
            for low, high, v0, v1 in spans
            if low < stop - 1e-6 and high > start + 1e-6 and _beyond(v0, v1, near, sign)
        ]
        room = min([max(0.0, gap) for gap in gaps], default=np.inf)
        reach = room if room - depth < _FILL_M else depth
        if reach < LEAST_DEPTH_M:
            continue
        far = near + sign * reach
        touches = start >= hall.start - 1e-6 and stop <= hall.stop + 1e-6
        last = rows[-1] if rows else None
        if last is not None and abs(last.stop - start) < 1e-6 and abs(last.far - far) < 1e-6:
            grown = last._replace(stop=stop)
            if touches:
                grown = grown._replace(first=min(last.first, start), last=max(last.last, stop))
            rows[-1] = grown
        else:
            first, final = (start, stop) if touches else (np.inf, -np.inf)
            rows.append(Row(place, hall.axis, start, stop, first, final, near, far))
    return [row for row in rows if row.last - row.first > LEAST_DEPTH_M]


def _beyond(v0: float, v1: float, near: float, sign: int) -> bool:
    """Return whether something from ``v0`` to ``v1`` lies, at least in part, on the side ``sign`` of ``near``."""
    return v1 > near + 1e-6 if sign > 0 else v0 < near - 1e-6


def _along_axis(box: Box, axis: int) -> tuple[float, float, float, float]:
    """Return (start, stop, low, high) of the box, seen along ``axis``."""
    x, y = (box.min_x, box.max_x), (box.min_y, box.max_y)
    return (*x, *y) if axis == 0 else (*y, *x)


def _holds(box: Box, x: float, y: float) -> bool:
    return box.min_x - 1e-6 <= x <= box.max_x + 1e-6 and box.min_y - 1e-6 <= y <= box.max_y + 1e-6
