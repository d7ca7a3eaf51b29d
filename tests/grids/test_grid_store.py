import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pipeline.errors import TableError
from pipeline.files import write_table
from pipeline.grids.occupancy import Cell
from pipeline.grids.store import (
    PAIRS,
    GridRecord,
    Pair,
    read_packed_worlds,
    read_pairs,
    read_worlds,
    write_pairs,
    write_worlds,
)
from pipeline.tables import Table
from tests.worlds import TWO_ROOMS, draw

WORLD = draw(*TWO_ROOMS, resolution=0.5)
RECORDS = [GridRecord(name, "b", "mazes", split, WORLD.grid, 0.3) for name, split in (("p", "train"), ("q", "test"))]
PAIR = Pair("q/0", "q", "b", "mazes", "test", Cell(4, 2), Cell(4, 10), 5.25)


def test_worlds_and_pairs_come_back_as_they_were_written(tmp_path):
    write_worlds(tmp_path, RECORDS)
    write_pairs(tmp_path, [PAIR])
    (record,) = read_worlds(tmp_path, "test")
    assert record._replace(grid=None) == RECORDS[1]._replace(grid=None)
    assert np.array_equal(record.grid.cells, WORLD.grid.cells)
    assert record.grid[1:] == WORLD.grid[1:]
    assert [world.plan_id for world in read_worlds(tmp_path)] == ["p", "q"]
    assert read_pairs(tmp_path, "test") == [PAIR]
    assert read_pairs(tmp_path, "train") == []
    assert isinstance(read_pairs(tmp_path)[0].start, Cell)


def test_maps_made_for_another_robot_are_refused(tmp_path):
    write_worlds(tmp_path, RECORDS)
    assert len(read_packed_worlds(tmp_path, robot_radius_m=0.3)) == 2
    with pytest.raises(TableError, match=r"'p' was made for robot\.radius_m = 0\.3, this run has 0\.25"):
        read_packed_worlds(tmp_path, robot_radius_m=0.25)


def test_a_table_of_another_version_says_what_to_run(tmp_path):
    write_pairs(tmp_path, [PAIR])
    table = pq.read_table(tmp_path / "pairs.parquet")
    newer = Table("pairs", 2, list(PAIRS.schema), stage="rasterize").schema
    write_table(tmp_path / "pairs.parquet", pa.Table.from_pylist(table.to_pylist(), schema=newer))
    with pytest.raises(
        TableError, match=r"holds table 'pairs' version 2, this code reads table 'pairs' version 1. Run"
    ):
        read_pairs(tmp_path, "test")
    with pytest.raises(TableError, match=r"grids.parquet: no such file"):
        read_worlds(tmp_path, "test")


def test_a_misspelt_split_is_a_bug_not_an_empty_list(tmp_path):
    write_pairs(tmp_path, [PAIR])
    with pytest.raises(ValueError, match="split = tets"):
        read_pairs(tmp_path, "tets")
