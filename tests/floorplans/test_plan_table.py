import numpy as np
import pyarrow.parquet as pq
import pytest

from pipeline.errors import TableError
from pipeline.files import write_sum
from pipeline.floorplans import plan as plans
from pipeline.floorplans.checks import Checked, inspect
from pipeline.floorplans.generators.guided_maze import MazeShape, draw_guided_maze
from pipeline.floorplans.plan import Door
from pipeline.floorplans.store import read_plans, write_plans
from pipeline.grids import occupancy
from pipeline.randomness import stream
from tests.floorplans.samples import KNOWN, grid_plan


def test_plans_come_back_as_they_were_written(tmp_path):
    maze = draw_guided_maze(MazeShape(), stream(0, "m"), plan_id="maze", split="test")
    grid = grid_plan(KNOWN, doors=(Door(1.0, 2.0, 0.9),))
    path = tmp_path / "plans.parquet"
    write_plans(path, [Checked(plan, inspect(plan)) for plan in (maze, grid)])
    (maze_again, report), (grid_again, _) = read_plans(path)
    assert maze_again.free.equals_exact(maze.free, 0)
    assert (maze_again.endpoints, maze_again.split) == (maze.endpoints, "test")
    assert maze_again.bounds == pytest.approx(maze.bounds)
    assert report == inspect(maze)
    assert np.array_equal(grid_again.cells, grid.cells)
    assert (grid_again.doors, grid_again.origin, grid_again.split) == (grid.doors, grid.origin, None)
    assert pq.read_schema(path).field("origin_x_m").metadata == {b"unit": b"m", b"frame": b"world"}


def test_a_missing_or_foreign_table_says_what_to_run(tmp_path):
    with pytest.raises(TableError, match=r"plans.parquet: no such file. Run `dvc repro plans`"):
        read_plans(tmp_path / "plans.parquet")
    (tmp_path / "plans.parquet").write_text("hello")
    with pytest.raises(TableError, match=r"no checksum plans.parquet.sha256 beside it. Run `dvc repro -f plans`"):
        read_plans(tmp_path / "plans.parquet")
    write_sum(tmp_path / "plans.parquet")
    with pytest.raises(TableError, match="not a readable parquet file"):
        read_plans(tmp_path / "plans.parquet")


def test_the_values_of_plan_cells_are_those_of_the_occupancy_grid():
    for name in ("FREE", "OCCUPIED", "UNKNOWN"):
        assert getattr(plans, name) == getattr(occupancy, name)
