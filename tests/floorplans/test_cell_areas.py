import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from shapely.geometry import MultiPolygon, Polygon, box

from pipeline.errors import PlanError
from pipeline.floorplans import cell_areas
from pipeline.floorplans.cell_areas import CellRaster
from pipeline.floorplans.plan import Location

MASKS = arrays(np.bool_, st.tuples(st.integers(1, 12), st.integers(1, 12)))


def raster(marked, resolution=1.0, origin=(0.0, 0.0)):
    return CellRaster(resolution, Location(*origin), *marked.shape)


@settings(max_examples=100, deadline=None)
@given(MASKS)
def test_areas_are_the_union_of_the_cells(marked):
    area = raster(marked).area_of(marked)
    cells = [box(col, row, col + 1, row + 1) for row, col in np.argwhere(marked)]
    assert area.is_valid
    assert area.equals(shapely.union_all(cells)) or not cells
    assert area.area == marked.sum()


@settings(max_examples=50, deadline=None)
@given(MASKS, st.floats(0.01, 1.0), st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))
def test_cells_come_back(marked, resolution, x, y):
    cells = raster(marked, resolution, (x, y))
    assert np.array_equal(cells.cells_in(cells.area_of(marked)), marked)


def test_outlines_turn_at_every_corner_and_holes_stay():
    marked = np.ones((5, 7), dtype=bool)
    marked[1:3, 2:5] = False
    (part,) = raster(marked, 0.5, (10.0, 20.0)).area_of(marked).geoms
    assert part.equals(box(10, 20, 13.5, 22.5) - box(11, 20.5, 12.5, 21.5))
    assert len(part.exterior.coords) == 5
    assert part.exterior.is_ccw


def test_cells_that_touch_at_a_corner_are_parts_of_their_own():
    assert len(raster(np.eye(3, dtype=bool)).area_of(np.eye(3, dtype=bool)).geoms) == 3


def test_nothing_marked_is_an_empty_area():
    nothing = np.zeros((2, 3), dtype=bool)
    assert raster(nothing).area_of(nothing).is_empty
    assert not raster(nothing).cells_in(MultiPolygon()).any()


@pytest.mark.parametrize(
    ("area", "said"),
    [
        (Polygon([(0, 0), (2, 0), (0, 2)]), "an edge does not run along the cells of 1 m. Draw it"),
        (box(0, 0, 1.5, 1), "an edge does not run along the cells"),
        (box(0, 0, 1, 4), "beyond the grid of 3 x 3 cells. Correct"),
        (box(-1, 0, 1, 1), "beyond the grid"),
    ],
)
def test_areas_off_the_cells_are_refused(area, said):
    with pytest.raises(PlanError, match=said):
        CellRaster(1.0, Location(0, 0), 3, 3).cells_in(area)


def test_rounded_coordinates_are_read():
    cells = CellRaster(0.05, Location(3.1, -7.3), 3, 3)
    marked = np.eye(3, dtype=bool)
    rounded = shapely.transform(cells.area_of(marked), lambda corners: np.round(corners, 5))
    assert np.array_equal(cells.cells_in(rounded), marked)


def test_scattered_cells_are_refused(monkeypatch):
    monkeypatch.setattr(cell_areas, "_MOST_CORNERS", 10)
    with pytest.raises(PlanError, match="have 12 corners, at most 10"):
        raster(np.eye(3, dtype=bool)).area_of(np.eye(3, dtype=bool))
