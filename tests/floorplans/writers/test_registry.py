import numpy as np
import pytest

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE
from pipeline.floorplans.readers import READERS, read_plan_file
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.writers import WRITERS
from tests.floorplans.samples import KNOWN, grid_plan

OF_GRIDS = sorted(name for name, writer in WRITERS.items() if writer.needs_cells)


def test_names_are_those_of_the_registry_and_of_a_reader():
    assert list(WRITERS) == ["ros_map_server", "moving_ai", "raster_picture", "plan_geojson"]
    assert all(writer.name == name for name, writer in WRITERS.items())
    assert OF_GRIDS == ["moving_ai", "raster_picture", "ros_map_server"]
    assert set(WRITERS) <= set(READERS)


def test_every_ending_leads_to_one_writer():
    endings = [writer.ending for writer in WRITERS.values()]
    assert len(set(endings)) == len(endings)
    assert all(ending.startswith(".") and ending == ending.lower() for ending in endings)


@pytest.mark.parametrize("name", OF_GRIDS)
def test_what_is_written_is_recognised_and_has_the_same_free_cells(tmp_path, name):
    plan = grid_plan(KNOWN)
    path, *_ = WRITERS[name].write(plan, tmp_path / f"floor{WRITERS[name].ending}")
    assert [reader for reader, known in READERS.items() if known.sniff(path)] == [name]
    options = ReadOptions(metres_per_unit=0.5) if name == "moving_ai" else ReadOptions()
    (again,) = read_plan_file(path, options=options)
    assert np.array_equal(again.cells == FREE, plan.cells == FREE)
    assert again.resolution == plan.resolution


@pytest.mark.parametrize("name", OF_GRIDS)
@pytest.mark.parametrize(
    "cells", [np.full((2, 2), 4, np.uint8), np.zeros((0, 3), np.uint8), np.zeros((2, 2, 2), np.uint8)]
)
def test_cells_that_are_no_plan_are_refused_and_nothing_is_left(tmp_path, name, cells):
    with pytest.raises(PlanError, match=r"plan drawn: expected cells \[rows, cols\] with values up to 3. Repair it."):
        WRITERS[name].write(grid_plan(KNOWN, cells=cells), tmp_path / f"floor{WRITERS[name].ending}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", OF_GRIDS)
def test_a_failed_write_leaves_the_old_file(tmp_path, name):
    writer = WRITERS[name]
    path, *_ = writer.write(grid_plan(KNOWN), tmp_path / f"floor{writer.ending}")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    with pytest.raises(PlanError):
        writer.write(grid_plan(KNOWN, cells=np.full((2, 2), 9, np.uint8)), path)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before
