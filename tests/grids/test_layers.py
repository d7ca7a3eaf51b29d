"""Rooms, doors and layers of a plan on the cells of its grid, by hand."""

from pathlib import Path

import numpy as np
import pytest
from shapely.geometry import box

from pipeline.errors import TrialError
from pipeline.floorplans.plan import Bounds, Door, FloorPlan, GridPlan, Layer, Location, Room
from pipeline.grids.layers import layers_of
from pipeline.grids.rasterize import rasterize
from pipeline.grids.store import GRIDS, GridRecord, read_worlds, write_worlds
from pipeline.simulation.ground import Ground
from pipeline.simulation.world import make_world
from tests.worlds import draw

GIVEN = {"plan_id": "p", "building": "b", "floor": "0", "environment": "drawn", "source": "hand"}


def test_rooms_and_doors_of_a_drawing() -> None:
    # A hall of 6 x 3 m with a closet of 2 x 1 m in its upper right corner, which the outline of the hall holds too.
    plan = FloorPlan(
        **GIVEN,
        free=box(0, 0, 6, 3),
        bounds=Bounds(0, 0, 6, 3),
        rooms=(Room(box(4, 2, 6, 3), "CLOSET"), Room(box(0, 0, 6, 3), "HALL")),
        doors=(Door(4.5, 1.5, 1.0), Door(0.0, 1.5, 0.8)),
    )
    grid = rasterize(plan, 1.0)
    found = layers_of(plan, grid)
    assert found["rooms"].dtype == np.int32 and found["doors"].dtype == np.uint8
    assert found["rooms"].tolist() == [  # row 0 is the lowest; the closed ring lies outside
        [-1, -1, -1, -1, -1, -1, -1, -1],
        [-1, 1, 1, 1, 1, 1, 1, -1],
        [-1, 1, 1, 1, 1, 1, 1, -1],
        [-1, 1, 1, 1, 1, 0, 0, -1],
        [-1, -1, -1, -1, -1, -1, -1, -1],
    ]
    # The first door lies on the middle of a cell, the second on the edge between the wall and the hall: within 0.4 m
    # of it lies no middle of a cell, so that the cell which holds it alone is marked.
    assert np.argwhere(found["doors"]).tolist() == [[2, 1], [2, 5]]


def test_layers_of_a_grid_plan_are_taken_at_the_middles_of_coarser_cells() -> None:
    values = np.arange(4 * 9, dtype=np.uint16).reshape(4, 9) % 7
    cells = np.zeros((4, 9), dtype=np.uint8)
    plan = GridPlan(
        **GIVEN,
        cells=cells,
        resolution=0.1,
        origin=Location(2.0, -1.0),
        layers={"terrain": Layer(values, {}), "rooms": Layer((values > 2).astype(np.uint16), {1: "KITCHEN"})},
    )
    grid = rasterize(plan, 0.3)
    found = layers_of(plan, grid)
    assert grid.cells.shape == found["terrain"].shape == (3, 5)  # the second row of coarse cells is cut off: no ring
    assert found["terrain"][1].tolist() == [-1, *(int(values[1, col]) for col in (1, 4, 7)), -1]
    assert found["terrain"][1].tolist() == [-1, 3, 6, 2, -1]
    assert found["rooms"][1].tolist() == [-1, 0, 0, -1, -1]
    assert not found["doors"].any()


def test_layers_come_back_as_they_were_written_and_reach_the_world(tmp_path: Path) -> None:
    plan = FloorPlan(**GIVEN, free=box(0, 0, 5, 2), bounds=Bounds(0, 0, 5, 2), rooms=(Room(box(0, 0, 2, 2), "A"),))
    grid = rasterize(plan, 0.5)
    layers = layers_of(plan, grid)
    write_worlds(tmp_path, [GridRecord("p", "b", "drawn", "test", grid, 0.0, layers=layers)])
    (record,) = read_worlds(tmp_path)
    assert set(record.layers) == {"rooms", "doors"}
    for name, values in layers.items():
        assert record.layers[name].dtype == values.dtype
        assert np.array_equal(Ground(record).world.layer(name), values)


def test_a_table_of_before_layers_is_read(tmp_path: Path) -> None:
    plan = FloorPlan(**GIVEN, free=box(0, 0, 5, 2), bounds=Bounds(0, 0, 5, 2))
    grid = rasterize(plan, 0.5)
    path = write_worlds(tmp_path, [GridRecord("p", "b", "drawn", "test", grid, 0.0)])
    older = GRIDS.read(path).drop_columns(["layers"])
    stamp = {b"hinterland": b'{"table": "grids", "version": 2}'}
    type(GRIDS)("grids", 2, list(older.schema), stage="rasterize").write(path, older.replace_schema_metadata(stamp))
    (record,) = read_worlds(tmp_path)
    assert np.array_equal(record.grid.cells, grid.cells) and not record.layers


@pytest.mark.parametrize("shape", [(3, 4), (4, 4, 1)])
def test_a_layer_of_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(TrialError, match=r"house: layer 'rooms' is .*, the grid \(4, 4\)"):
        make_world("house", draw("####", "#..#", "#..#", "####").grid, 0.0, {"rooms": np.zeros(shape, np.int32)})
