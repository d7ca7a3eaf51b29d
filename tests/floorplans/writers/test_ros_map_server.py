import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image
from shapely.geometry import box

from pipeline.errors import PlanError
from pipeline.floorplans.plan import CLUTTER, OCCUPIED, Location
from pipeline.floorplans.readers import READERS, read_plan_file
from pipeline.floorplans.writers.ros_map_server import RosMapServer
from pipeline.floorplans.writers.writer import Writer
from tests.floorplans.samples import KNOWN, floor_plan, grid_plan

CELLS = arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 3))
FINITE = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=60, deadline=None)
@given(CELLS, FINITE, FINITE, st.floats(1e-6, 1e6))
def test_writing_and_reading_keeps_cells_scale_and_place(tmp_path_factory, cells, x, y, resolution):
    writer: Writer = RosMapServer()
    folder = tmp_path_factory.mktemp("map")
    plan = grid_plan(KNOWN, cells=cells, resolution=resolution, origin=Location(x, y))
    path, picture = writer.write(plan, folder / f"floor{writer.ending}")
    (again,) = read_plan_file(path)
    assert np.array_equal(again.cells, np.where(cells == CLUTTER, OCCUPIED, cells))
    assert (again.resolution, again.origin) == (resolution, plan.origin)
    assert sorted(folder.iterdir()) == [picture, path]


def test_the_files_are_as_other_programs_expect_them(tmp_path):
    path, picture = RosMapServer().write(grid_plan(KNOWN, origin=Location(-1.5, 2.0)), tmp_path / "new" / "floor.yaml")
    header = yaml.safe_load(path.read_text())
    assert header["image"] == picture.name == "floor.pgm"
    assert (header["resolution"], header["origin"], header["negate"]) == (0.5, [-1.5, 2.0, 0.0], 0)
    assert 0 < header["free_thresh"] < 1 - 205 / 255 < header["occupied_thresh"] < 1
    assert picture.read_bytes().startswith(b"P5")
    with Image.open(picture) as opened:
        grey = np.asarray(opened)
    assert grey.dtype == np.uint8
    assert grey[0].tolist() == [205] * 8  # the first line of the drawing is the top
    assert grey[3].tolist() == [205, 0, 254, 0, 254, 254, 0, 205]


def test_numpy_numbers_are_written_as_plain_ones(tmp_path):
    plan = grid_plan(KNOWN, resolution=np.float64(0.1), origin=Location(np.float32(1.5), np.float64(-0.1)))
    (again,) = read_plan_file(RosMapServer().write(plan, tmp_path / "floor.yaml")[0])
    assert (again.resolution, again.origin) == (0.1, (1.5, -0.1))


def test_a_second_map_replaces_the_first(tmp_path):
    for cells in (np.zeros((2, 3), np.uint8), np.ones((3, 2), np.uint8)):
        path, _ = RosMapServer().write(grid_plan(KNOWN, cells=cells), tmp_path / "floor.yaml")
        assert np.array_equal(read_plan_file(path)[0].cells, cells)


def test_two_maps_in_a_folder_keep_their_pictures(tmp_path):
    for number in range(2):
        RosMapServer().write(grid_plan(KNOWN, cells=np.full((2, 2), number, np.uint8)), tmp_path / f"{number}.yaml")
    assert [int(read_plan_file(tmp_path / f"{number}.yaml")[0].cells[0, 0]) for number in range(2)] == [0, 1]
    assert all(READERS["raster_picture"].accompanies(tmp_path / f"{number}.pgm") for number in range(2))


def test_geometry_is_refused(tmp_path):
    with pytest.raises(PlanError, match=r"plan drawn: is geometry, and ros_map_server holds cells alone. Rasterize it"):
        RosMapServer().write(floor_plan(box(0, 0, 1, 1)), tmp_path / "floor.yaml")
    assert not list(tmp_path.iterdir())
