import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image
from PIL.PngImagePlugin import PngInfo
from shapely.geometry import box

from pipeline.errors import PlanError
from pipeline.floorplans.plan import CLUTTER, OCCUPIED, Location
from pipeline.floorplans.readers import read_plan_file
from pipeline.floorplans.readers.raster_picture import NOTE
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.writers.picture import RasterPicture
from pipeline.floorplans.writers.writer import Writer
from tests.floorplans.samples import KNOWN, floor_plan, grid_plan

CELLS = arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 3))
PLACES = st.floats(-1e6, 1e6)


@settings(max_examples=60, deadline=None)
@given(CELLS, PLACES, PLACES, st.floats(1e-6, 1e6))
def test_writing_and_reading_keeps_cells_scale_and_place(tmp_path_factory, cells, x, y, resolution):
    writer: Writer = RasterPicture()
    folder = tmp_path_factory.mktemp("picture")
    plan = grid_plan(KNOWN, cells=cells, resolution=resolution, origin=Location(x, y))
    (path,) = writer.write(plan, folder / f"floor{writer.ending}")
    (again,) = read_plan_file(path)
    assert np.array_equal(again.cells, np.where(cells == CLUTTER, OCCUPIED, cells))
    assert (again.resolution, again.origin) == (resolution, plan.origin)
    assert list(folder.iterdir()) == [path]


def test_a_person_sees_three_greys_and_can_read_the_note(tmp_path):
    (path,) = RasterPicture().write(grid_plan(KNOWN, origin=Location(-1.5, 2.0)), tmp_path / "new" / "floor.png")
    with Image.open(path) as opened:
        grey, note = np.asarray(opened), json.loads(opened.info[NOTE])
    assert grey[3].tolist() == [128, 0, 255, 0, 255, 255, 0, 128]  # row 0 is the top
    assert note == {"metres_per_pixel": 0.5, "origin_m": [-1.5, 2.0], "rows": 6, "cols": 8}


def test_a_picture_that_was_scaled_or_cut_asks_for_its_scale_again(tmp_path):
    (path,) = RasterPicture().write(grid_plan(KNOWN), tmp_path / "floor.png")
    with Image.open(path) as opened:
        info = opened.info[NOTE]
        half = opened.resize((4, 3))
    texts = PngInfo()
    texts.add_text(NOTE, info)
    half.save(path, pnginfo=texts)
    with pytest.raises(PlanError, match=r"floor.png: its note of the scale is of a picture of another size"):
        read_plan_file(path)
    assert read_plan_file(path, options=ReadOptions(metres_per_unit=1.0))[0].resolution == 1.0


def test_geometry_is_refused(tmp_path):
    with pytest.raises(PlanError, match=r"plan drawn: is geometry, and raster_picture holds cells alone. Rasterize it"):
        RasterPicture().write(floor_plan(box(0, 0, 1, 1)), tmp_path / "floor.png")
    assert not list(tmp_path.iterdir())
