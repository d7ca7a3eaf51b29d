import time
from functools import partial

import numpy as np
import pytest
import shapely
from scipy.ndimage import distance_transform_edt, label

from pipeline.floorplans import passages
from pipeline.floorplans.cell_areas import CellRaster
from pipeline.floorplans.passages import grid_passage_width, passage_width
from pipeline.floorplans.plan import Location

CENTIMETRE = 0.01


def two_rooms(gap: float, turned_deg: float = 0.0) -> shapely.Polygon:
    """Two rooms of 4 x 4 m with a doorway of ``gap`` [m] between them."""
    rooms = [shapely.box(0, 0, 4, 4), shapely.box(4, 1.5, 4.2, 1.5 + gap), shapely.box(4.2, 0, 8.2, 4)]
    return shapely.affinity.rotate(shapely.union_all(rooms), turned_deg, origin=(0, 0))


def traced(shape: shapely.Polygon) -> shapely.Polygon:
    """Outline the pixels of 1 cm in ``shape``, corners cut as contours do: thousands of short sides."""
    low_x, low_y, high_x, high_y = shape.bounds
    cols, rows = (int(np.ceil(side / CENTIMETRE)) + 2 for side in (high_x - low_x, high_y - low_y))
    x, y = np.meshgrid(np.arange(cols) * CENTIMETRE + low_x, np.arange(rows) * CENTIMETRE + low_y)
    shapely.prepare(shape)
    cells = CellRaster(CENTIMETRE, Location(low_x, low_y), rows, cols)
    outline = shapely.get_parts(cells.area_of(shapely.contains_xy(shape, x, y)))[0]
    corners = shapely.get_coordinates(outline.exterior)
    return shapely.polygons((corners[:-1] + corners[1:]) / 2)


def plainly(free: np.ndarray, resolution: float) -> float | None:
    """`grid_passage_width` without short cuts: all tries, on the whole grid."""
    clearance = distance_transform_edt(np.pad(free, 1)) * resolution

    def reach(width: float) -> int:
        core, count = label(clearance > width / 2)
        if not count:
            return 0
        largest = core == 1 + int(np.argmax(np.bincount(core.ravel())[1:]))
        grown = distance_transform_edt(~largest) * resolution < width / 2 if width else largest
        return int((grown & (clearance > 0)).sum())

    return passages._widest(lambda width: reach(width) >= 0.95 * reach(0.0)) if reach(0.0) else None


@pytest.mark.parametrize("gap", [0.8, 1.0, 2.0])
def test_the_passage_between_two_rooms_is_measured(gap):
    rooms = shapely.union_all([shapely.box(0, 0, 9, 9), shapely.box(9, 4, 10, 4 + gap), shapely.box(10, 0, 19, 9)])
    assert passage_width(rooms) == pytest.approx(gap, abs=0.02)
    finer = np.ones((90, 190), dtype=np.bool_)
    finer[:, 90:100] = False
    finer[40 : 40 + round(gap * 10), 90:100] = True
    assert grid_passage_width(finer, 0.1) == pytest.approx(gap, abs=0.15)


@pytest.mark.parametrize(("turned_deg", "gap"), [(0.0, 1.0), (30.0, 0.9), (45.0, 1.2), (77.0, 0.75)])
def test_a_traced_outline_is_measured_as_if_it_were_moved_at_once(turned_deg, gap):
    floor = traced(two_rooms(gap, turned_deg))
    needed = 0.95 * floor.area
    assert passage_width(floor) == passages._widest(partial(passages._reaches, floor, needed))


def test_a_traced_outline_of_thousands_of_corners_is_measured_in_time():
    floor = traced(shapely.affinity.scale(two_rooms(1.0, 30.0), 3, 3))
    assert shapely.get_num_coordinates(floor) > 8000
    began = time.process_time()
    assert passage_width(floor) is not None
    assert time.process_time() - began < 10  # at once it takes a minute


@pytest.mark.parametrize(("step_m", "steps"), [(0.01, 1000), (0.03, 2500), (0.3, 800)])
def test_a_corridor_along_stairs_is_measured_on_cells_in_time(step_m, steps):
    climb = np.repeat(np.arange(steps), 2) * step_m
    stairs = np.column_stack([np.append(climb[1:], steps * step_m), climb])
    began = time.process_time()
    width = passage_width(shapely.Polygon(np.vstack([stairs, np.add(stairs[::-1], (-1.5, 2.0))])))
    assert width == pytest.approx(3.5 / np.sqrt(2), abs=0.2 + step_m)
    assert time.process_time() - began < 10  # moved at once it takes minutes


def test_an_outline_of_very_many_corners_is_measured_in_time():
    around = np.linspace(0, 2 * np.pi, 100_000, endpoint=False)
    circle = shapely.Polygon(np.column_stack([np.cos(around), np.sin(around)]))
    began = time.process_time()
    assert passage_width(circle) == pytest.approx(2.0, abs=0.05)
    assert time.process_time() - began < 5


def test_a_comb_of_thousands_of_teeth_is_measured_in_time():
    teeth = [[x / 100, y] for k in range(10_000) for x, y in ((2 * k, 0), (2 * k, 50), (2 * k + 1, 50), (2 * k + 1, 0))]
    began = time.process_time()
    assert passage_width(shapely.Polygon([*teeth, [200, -5], [0, -5]])) is not None
    assert time.process_time() - began < 5


@pytest.mark.parametrize("seed", range(6))
def test_cells_are_covered_where_their_middle_lies_in_the_floor(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    blobs = [
        shapely.Point(*at).buffer(size)
        for at, size in zip(rng.uniform(0, 9, (9, 2)), rng.uniform(0.3, 2, 9), strict=True)
    ]
    floor = shapely.unary_union(blobs[:6]) - shapely.unary_union(blobs[6:])
    monkeypatch.setattr(passages, "_MOST_CROSSINGS", 1000)
    found = passages._covered(floor, 0.13)
    x, y = (np.arange(count) * 0.13 + 0.065 for count in found.shape[::-1])
    assert np.array_equal(found, shapely.contains_xy(floor, *np.meshgrid(x + floor.bounds[0], y + floor.bounds[1])))


@pytest.mark.parametrize("margin", [(0, 0), (40, 7)])
@pytest.mark.parametrize("seed", range(4))
def test_the_short_cuts_on_cells_change_no_answer(seed, margin):
    rng = np.random.default_rng(seed)
    walls = np.kron(rng.random((6, 8)) < 0.25, np.ones((9, 7), dtype=np.bool_)).astype(np.bool_)
    free = np.pad(~walls, tuple((width, width) for width in margin))
    assert grid_passage_width(free, 0.1) == plainly(free, 0.1)


def test_very_fine_cells_are_looked_at_several_at_a_time(monkeypatch):
    free = np.ones((300, 500), dtype=np.bool_)
    free[:, 240:260] = False
    free[100:190, 240:260] = True  # 0.9 m
    exact = grid_passage_width(free, 0.01)
    monkeypatch.setattr(passages, "_MOST_CELLS", free.size // 9)
    assert grid_passage_width(free, 0.01) == pytest.approx(exact, abs=0.06)
    chessboard = np.indices((300, 500)).sum(axis=0) % 2 == 0
    assert grid_passage_width(chessboard, 0.01) == 0.0


def test_no_floor_has_no_passage():
    assert passage_width(shapely.Polygon()) is None
    assert grid_passage_width(np.zeros((4, 5), dtype=np.bool_), 0.1) is None


def test_an_open_hall_counts_as_eight_metres():
    assert passage_width(shapely.box(0, 0, 30, 20)) == 8.0
    assert grid_passage_width(np.ones((200, 300), dtype=np.bool_), 0.1) == 8.0
