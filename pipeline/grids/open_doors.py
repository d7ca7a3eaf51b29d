"""Marked doors that close on the way to the grid are opened again, by the fewest cells and through nothing else.

A free cell lies wholly on free floor, so a door narrower than a few cells may vanish between them. Around each marked
door the floor is looked at on finer cells. A disc over the door parts that floor into its sides; where the grid does
not join them, the cheapest way through the doorway is found, a blocked cell costing one. A cell may be opened only if
every free cell beside it, corners included, is joined to the doorway on the floor within the 3 x 3 cells around: so no
wall is opened, whatever stands near the door.
"""

import heapq
from collections.abc import Callable, Iterable, Sequence
from math import ceil, floor
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, label

from pipeline.floorplans.plan import Door
from pipeline.grids.occupancy import Point

Mask = NDArray[np.bool_]
Labels = NDArray[np.int32]
Node: TypeAlias = tuple[int, int, int]
"""A cell (row, col) and the number of a connected piece of floor in it."""

DEEPEST_M = 1.2  # of a doorway, beyond half its width: thick walls
_CROSS = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], dtype=np.bool_)
_MARGIN = 0.2  # of the width of a door by which its disc reaches over the jambs


class Window(NamedTuple):
    """Cells of a grid: ``rows`` from ``row`` on, ``cols`` from ``col`` on; it may reach beyond the grid."""

    row: int
    col: int
    rows: int
    cols: int


class _Disc(NamedTuple):
    """Middle and radius in cells, from the outer corner of the grid."""

    x: float
    y: float
    radius: float


FineFloor: TypeAlias = Callable[[Window], Mask]
"""Return the free floor of a window on cells ``factor`` times finer: [rows * factor, cols * factor] bool."""


def open_doors(
    free: Mask, doors: Iterable[Door], fine: FineFloor, *, factor: int, resolution: float, origin: Point
) -> Mask:
    """Return ``free`` [rows, cols] with the cells that keep ``doors`` open; doors that are open change nothing.

    fine: the floor itself, on cells ``factor`` times finer. resolution: side of a cell [m]. origin: outer corner of
    ``free[0, 0]`` [m]. The result depends on the order of the doors only where two of them share cells.
    """
    kept = free.copy()
    discs = [_disc_over(door, resolution, origin) for door in doors]
    for disc in discs:
        for row, col in _opened_at(kept, disc, discs, fine, factor, deepest=disc.radius + DEEPEST_M / resolution):
            kept[row, col] = True
    return kept


def _disc_over(door: Door, resolution: float, origin: Point) -> _Disc:
    """Return a disc that reaches over both jambs of a door, in cells."""
    radius = door.width / resolution / 2 * (1 + _MARGIN)
    return _Disc((door.x - origin.x) / resolution, (door.y - origin.y) / resolution, radius)


def _opened_at(
    free: Mask, disc: _Disc, discs: Sequence[_Disc], fine: FineFloor, factor: int, *, deepest: float
) -> list[tuple[int, int]]:
    """Return the cells to open at a door; the window around it grows until it shows both sides of a thick wall."""
    depth = disc.radius + 1.5
    while True:
        half = ceil(depth)
        window = Window(floor(disc.y) - half, floor(disc.x) - half, 2 * half + 1, 2 * half + 1)
        near = [each for each in discs if max(abs(each.x - disc.x), abs(each.y - disc.y)) < 2 * half + each.radius]
        over, every = (_covered(some, window, factor) for some in ([disc], near))
        opened = _opened(cut_window(free, window), fine(window), factor, over, every)
        if opened is not None or depth >= deepest:
            return [(window.row + row, window.col + col) for row, col in opened or ()]
        depth = min(depth + 1.0, deepest)


def _covered(discs: Sequence[_Disc], window: Window, factor: int) -> Mask:
    """Return the fine cells of a window whose middle lies in one of the discs."""
    y = window.row + (np.arange(window.rows * factor) + 0.5)[:, None] / factor
    x = window.col + (np.arange(window.cols * factor) + 0.5)[None, :] / factor
    covered = np.zeros((y.size, x.size), dtype=np.bool_)
    for disc in discs:
        covered |= (y - disc.y) ** 2 + (x - disc.x) ** 2 <= disc.radius**2
    return covered


def cut_window(free: Mask, window: Window) -> Mask:
    """Return the cells of a window, [rows, cols]; what lies beyond the grid is not free."""
    cut = np.zeros((window.rows, window.cols), dtype=np.bool_)
    rows = slice(max(0, window.row), max(0, window.row + window.rows))
    cols = slice(max(0, window.col), max(0, window.col + window.cols))
    part = free[rows, cols]
    row, col = max(0, -window.row), max(0, -window.col)
    cut[row : row + part.shape[0], col : col + part.shape[1]] = part
    return cut


def _opened(free: Mask, floor_: Mask, factor: int, disc: Mask, discs: Mask) -> list[tuple[int, int]] | None:
    """Return the cells to open at one door; empty where it is open; None where fewer than two sides have a free cell.

    free: [size, size]. floor_: [size * factor, size * factor]; so are disc, over this door, and discs, over any door.
    Where another door beside it joins the rooms as well, both part them; a way through that one is a way around.
    """
    around = np.zeros_like(free)
    ends = _ends(free, floor_, factor, disc, disc)
    if len(np.unique(ends)) < 3:
        ends = _ends(free, floor_, factor, disc, discs)
        near = binary_dilation(_any(disc, factor), structure=np.ones((3, 3)))
        around = _any(discs & ~disc, factor) & ~near
    numbers = np.unique(ends[ends > 0]).tolist()
    if len(numbers) < 2:
        return None
    first = int(np.argmax(np.bincount(ends[ends > 0])))
    now = free.copy()
    for other in numbers:
        if other != first:
            for cell in _cheapest(now, around, floor_, factor, ends == first, ends == other):
                now[cell] = True
    return [(int(row), int(col)) for row, col in np.argwhere(now & ~free)]


def _ends(free: Mask, floor_: Mask, factor: int, disc: Mask, parting: Mask) -> Labels:
    """Return for each free cell the side of the door it lies on, 0 for all others: [size, size].

    The sides are the pieces into which ``parting`` divides the floor that runs through the door, those beside ``disc``.
    """
    whole: Labels = label(floor_)[0]
    through = floor_ & np.isin(whole, np.setdiff1d(whole[disc], [0]))
    sides: Labels = label(through & ~parting)[0]
    beside = np.setdiff1d(sides[binary_dilation(through & disc, structure=_CROSS)], [0])
    blocks = _blocks(np.where(np.isin(sides, beside), sides, 0), factor)
    return np.where(free & (blocks.min(axis=(1, 3)) > 0), blocks.max(axis=(1, 3)), 0).astype(np.int32)


def _blocks(fine: NDArray[Any], factor: int) -> NDArray[Any]:
    """Return fine cells as [rows, factor, cols, factor]."""
    return fine.reshape(fine.shape[0] // factor, factor, fine.shape[1] // factor, factor)


def _any(fine: Mask, factor: int) -> Mask:
    """Return the cells of which some fine cell is set."""
    return np.asarray(_blocks(fine, factor).any(axis=(1, 3)), dtype=np.bool_)


def _cheapest(free: Mask, shut: Mask, floor_: Mask, factor: int, starts: Mask, goals: Mask) -> list[tuple[int, int]]:
    """Return the fewest blocked cells that join ``starts`` to ``goals`` along the floor outside ``shut``, if any do."""
    joined: Labels = label(free & ~shut)[0]  # free cells are wholly floor: side by side they are joined
    if np.intersect1d(joined[starts], joined[goals]).any():
        return []  # as most doors are
    pieces = _pieces(floor_, factor)
    sound: dict[Node, bool] = {}

    def enter(node: Node) -> tuple[int, int] | None:
        """Return the price of a cell: cells opened, and floor missing in it; None where it must stay shut."""
        row, col, piece = node
        if shut[row, col]:
            return None
        if free[row, col]:
            return 0, 0
        if node not in sound:
            sound[node] = _opens_no_wall(free, floor_, pieces, factor, node)
        if not sound[node]:
            return None
        block = pieces[row * factor : (row + 1) * factor, col * factor : (col + 1) * factor]
        return 1, int(factor**2 - np.count_nonzero(block == piece))

    queue: list[tuple[int, int, int, Node, Node | None]] = []
    for row, col in np.argwhere(starts).tolist():
        node = (row, col, int(pieces[row * factor, col * factor]))
        heapq.heappush(queue, (0, 0, 0, node, None))
    came: dict[Node, Node | None] = {}
    while queue:
        count, missing, steps, node, before = heapq.heappop(queue)
        if node in came:
            continue
        came[node] = before
        if goals[node[0], node[1]]:
            return _blocked_on_way(came, node, free)
        for other in _beside(pieces, factor, node):
            if other not in came and (price := enter(other)) is not None:
                heapq.heappush(queue, (count + price[0], missing + price[1], steps + 1, other, node))
    return []


def _pieces(floor_: Mask, factor: int) -> Labels:
    """Return the floor with the connected pieces of each cell numbered, from 1 on: [size * factor, size * factor]."""
    rows, cols = (count // factor for count in floor_.shape)
    apart = np.zeros((rows, factor + 1, cols, factor + 1), dtype=np.bool_)  # a gap behind each cell keeps pieces in it
    apart[:, :factor, :, :factor] = _blocks(floor_, factor)
    pieces: Labels = label(apart.reshape(rows * (factor + 1), cols * (factor + 1)))[0]
    kept = pieces.reshape(apart.shape)[:, :factor, :, :factor]
    return np.ascontiguousarray(kept).reshape(floor_.shape).astype(np.int32)


def _beside(pieces: Labels, factor: int, node: Node) -> set[Node]:
    """Return the pieces of floor in the four cells beside a cell that touch its own piece along the edge."""
    row, col, piece = node
    low_y, low_x = row * factor, col * factor
    high_y, high_x = low_y + factor - 1, low_x + factor - 1
    rows, cols = slice(low_y, high_y + 1), slice(low_x, high_x + 1)
    edges = (
        (row - 1, col, pieces[low_y, cols], (low_y - 1, cols)),
        (row + 1, col, pieces[high_y, cols], (high_y + 1, cols)),
        (row, col - 1, pieces[rows, low_x], (rows, low_x - 1)),
        (row, col + 1, pieces[rows, high_x], (rows, high_x + 1)),
    )
    size = len(pieces) // factor
    found = set()
    for there_row, there_col, own, place in edges:
        if 0 <= there_row < size and 0 <= there_col < size:
            other = pieces[place]
            found |= {(there_row, there_col, int(each)) for each in np.unique(other[(own == piece) & (other > 0)])}
    return found


def _opens_no_wall(free: Mask, floor_: Mask, pieces: Labels, factor: int, node: Node) -> bool:
    """Return whether all free cells around a blocked one are joined to its piece of floor within the 3 x 3 cells."""
    row, col, piece = node
    size = len(free)
    if not (0 < row < size - 1 and 0 < col < size - 1):
        return False
    block = (slice((row - 1) * factor, (row + 2) * factor), slice((col - 1) * factor, (col + 2) * factor))
    parts: Labels = label(floor_[block])[0]
    own = np.zeros(parts.shape, dtype=np.bool_)
    own[factor : 2 * factor, factor : 2 * factor] = (
        pieces[row * factor : (row + 1) * factor, col * factor : (col + 1) * factor] == piece
    )
    mine = parts[own][0]
    corners = parts[::factor, ::factor]  # one fine cell of each: a free cell is wholly floor
    around = free[row - 1 : row + 2, col - 1 : col + 2]
    return bool((corners[around] == mine).all())


def _blocked_on_way(came: dict[Node, Node | None], last: Node, free: Mask) -> list[tuple[int, int]]:
    way: list[tuple[int, int]] = []
    node: Node | None = last
    while node is not None:
        if not free[node[0], node[1]]:
            way.append((node[0], node[1]))
        node = came[node]
    return way[::-1]
