"""KTH campus floors: ``<floor>.npz`` with a drawing and the number of the room of each cell, 0.1 m per cell.

``occ_map`` is a picture (254 free, 0 wall) and ``valid_space`` holds the room number, 0 outside every room. Row 0 is
the top, so rows are turned over; origin is (0, 0).

Each room is drawn with its own wall faces. The cavity between two faces is white too, as is the ground around the
building, and both run into the doorways: a small robot could drive inside the walls. So the rooms decide what is
inside. A cell outside every room is free only as part of a doorway: on a straight line along x or y, over free cells,
from one room to another, at most 2 m long. All else is OCCUPIED, the ground around the building too: the drawing
shows nothing of it, the MIT floors have it so, and an entrance that leads out of the drawing is then closed.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import find_objects, label

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, Door, FloorPlan, GridPlan, Layer, Location
from pipeline.floorplans.readers.npz import holds_layer, load_layers
from pipeline.floorplans.readers.reader import ReadOptions

RESOLUTION_M = 0.1  # not in the files: upstream draws 10 pixels per metre
_LAYERS = ("occ_map", "valid_space")
_DARKEST_FREE = 128
_MOST_CELLS = 10_000_000  # 1 km x 100 m
_LONGEST_DOORWAY_M = 2.0  # the thickest wall with a door in it; the real floors have 1.8
_WIDEST_LEAF_M = 2.5  # wider openings are taken for passages without a door leaf

Mask = NDArray[np.bool_]
Numbers = NDArray[np.int32]


@dataclass(frozen=True)
class KthCampusGrids:
    """Reader of the npz floors. Nothing is ever unpickled."""

    name: str = "kth_campus_grids"
    patterns: tuple[str, ...] = ("*.npz",)
    uses: tuple[str, ...] = ("paper",)

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a zip archive that holds the room numbers."""
        return holds_layer(path, "valid_space")

    def accompanies(self, path: Path) -> bool:
        """Return False: a floor is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the file; see `Reader.read`. The format states its scale: no option is used."""
        drawn_free, numbers = _load(path)
        doorways, doors = _doorways(np.where(drawn_free, numbers, 0), drawn_free & (numbers == 0))
        free = drawn_free & ((numbers > 0) | doorways)
        closed_m2 = np.count_nonzero(drawn_free & ~free) * RESOLUTION_M**2
        said = f"{closed_m2:.1f} m2 drawn free are inside walls or outside the building and were closed"
        yield GridPlan(
            plan_id=path.stem,
            building=f"KTH-{path.stem.partition('_')[0]}",
            floor=path.stem,
            environment="kth_floors",
            source=path.name,
            cells=np.where(free, FREE, OCCUPIED).astype(np.uint8),
            resolution=RESOLUTION_M,
            origin=Location(0.0, 0.0),
            doors=doors,
            layers={"rooms": Layer(numbers.astype(np.uint16), {})},
            remarks=(said,) if closed_m2 > 0 else (),
        )


def _load(path: Path) -> tuple[Mask, Numbers]:
    """Return the free cells of the drawing and the room numbers, row 0 the lowest."""
    layers = load_layers(path, _LAYERS)
    drawing, rooms = (layers[name] for name in _LAYERS)
    if drawing.ndim != 2 or drawing.size == 0 or rooms.shape != drawing.shape:
        raise PlanError(
            f"{path}: occ_map is {drawing.shape} and valid_space {rooms.shape}; "
            "expected two grids of one shape [rows, cols] with at least one cell."
        )
    if drawing.size > _MOST_CELLS:
        raise PlanError(f"{path}: {drawing.size:,} cells, at most {_MOST_CELLS:,} are read. Cut the floor in parts.")
    if drawing.dtype.kind not in "ui" or rooms.dtype.kind not in "ui":
        raise PlanError(
            f"{path}: expected whole numbers in occ_map and valid_space, got {drawing.dtype}, {rooms.dtype}."
        )
    if not 0 <= int(rooms.min()) <= int(rooms.max()) <= np.iinfo(np.uint16).max:
        raise PlanError(f"{path}: valid_space holds {rooms.min()} to {rooms.max()}, expected room numbers up to 65535.")
    return drawing[::-1].astype(np.int64) >= _DARKEST_FREE, np.ascontiguousarray(rooms[::-1]).astype(np.int32)


def _doorways(rooms: Numbers, gaps: Mask) -> tuple[Mask, tuple[Door, ...]]:
    """Return the cells of ``gaps`` [rows, cols] that lead straight from room to room, and one door per opening.

    rooms: [rows, cols] room number of the free cells, 0 elsewhere. gaps: free cells of no room.
    """
    cross_x, touch_x = _crossings(rooms, gaps)
    cross_y, touch_y = (cells.T for cells in _crossings(rooms.T, gaps.T))
    along_x, along_y = cross_x | touch_x, cross_y | touch_y
    openings, _ = label(along_x | along_y, structure=np.ones((3, 3)))
    doors = []
    for number, (rows, cols) in enumerate(find_objects(openings), start=1):
        patch = openings[rows, cols] == number
        to_x, to_y = bool((patch & along_x[rows, cols]).any()), bool((patch & along_y[rows, cols]).any())
        bare = not (patch & (cross_x | cross_y)[rows, cols]).any()
        doors.append(_door(rows, cols, to_x, to_y, 0.5 if bare else 0.0))
    return cross_x | cross_y, tuple(doors)


def _crossings(rooms: Numbers, gaps: Mask) -> tuple[Mask, Mask]:
    """Return, for ways along the rows alone, the gap cells crossed and the cells left of a border without a wall."""
    cols = np.arange(rooms.shape[1])
    left = np.maximum.accumulate(np.where(gaps, 0, cols), axis=1)
    right = np.minimum.accumulate(np.where(gaps, rooms.shape[1] - 1, cols)[:, ::-1], axis=1)[:, ::-1]
    from_room, to_room = np.take_along_axis(rooms, left, axis=1), np.take_along_axis(rooms, right, axis=1)
    short = right - left - 1 <= round(_LONGEST_DOORWAY_M / RESOLUTION_M)
    crossed = gaps & short & (from_room > 0) & (to_room > 0) & (from_room != to_room)
    touching = np.zeros_like(gaps)
    touching[:, :-1] = (rooms[:, :-1] > 0) & (rooms[:, 1:] > 0) & (rooms[:, :-1] != rooms[:, 1:])
    return crossed, touching


def _door(rows: slice, cols: slice, to_x: bool, to_y: bool, shift: float) -> Door:
    """Return the door in a window of cells that is crossed along x, along y, or along both (an oblique opening).

    shift: from the middle of the cells before a bare border to the border itself [cells].
    """
    high, wide = rows.stop - rows.start, cols.stop - cols.start
    across = np.hypot(high, wide) if to_x and to_y else high if to_x else wide
    width = round(float(across) * RESOLUTION_M, 3)
    x = (cols.start + cols.stop) / 2 + shift * to_x
    y = (rows.start + rows.stop) / 2 + shift * to_y
    return Door(x * RESOLUTION_M, y * RESOLUTION_M, width, leaf=width <= _WIDEST_LEAF_M)
