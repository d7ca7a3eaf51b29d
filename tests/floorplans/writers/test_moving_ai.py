from math import inf, isinf, nan, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from shapely.geometry import box

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, GridPlan, Layer, Location
from pipeline.floorplans.readers import read_plan_file
from pipeline.floorplans.readers.moving_ai import PASSABLE, TERRAIN, Scenario, read_scenarios
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.writers.moving_ai import MovingAi, write_scenarios
from pipeline.floorplans.writers.writer import Writer
from tests.floorplans.samples import KNOWN, floor_plan, grid_plan
from tests.floorplans.scenario_lengths import lengths_on

SHAPES = st.tuples(st.integers(1, 9), st.integers(1, 9))
CELLS = arrays(np.uint8, SHAPES, elements=st.integers(0, 3))
GROUND = ("....", ".@@.", "...@")  # the first line is the top; the corner of the walls is not cut


def read(path) -> GridPlan:
    (plan,) = read_plan_file(path, options=ReadOptions(metres_per_unit=0.5))
    return plan


def terrain(plan: GridPlan) -> list[list[str]]:
    layer = plan.layers["terrain"]
    return [[layer.labels[value] for value in row] for row in layer.values.tolist()]


def octile_lengths(cells: np.ndarray) -> np.ndarray:
    """Shortest lengths between all cells [cells, row by row], written down from the rules of the benchmark."""
    free = np.pad(cells == FREE, 1)
    rows, cols = free.shape
    edges = []
    for row, col in np.argwhere(free):
        for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
            if free[row + down, col + right] and free[row + down, col] and free[row, col + right]:
                edges.append((row * cols + col, (row + down) * cols + col + right, sqrt(abs(down) + abs(right))))
    starts, ends, lengths = zip(*edges, strict=True) if edges else ((), (), ())
    graph = coo_array((np.array(lengths, dtype=float), (starts, ends)), shape=(rows * cols, rows * cols))
    inside = np.arange(rows * cols).reshape(rows, cols)[1:-1, 1:-1].ravel()
    return dijkstra(graph.tocsr(), directed=False, indices=inside)[:, inside]


@settings(max_examples=60, deadline=None)
@given(CELLS)
def test_writing_and_reading_keeps_what_is_passable(tmp_path_factory, cells):
    writer: Writer = MovingAi()
    folder = tmp_path_factory.mktemp("map")
    plan = grid_plan(KNOWN, cells=cells, resolution=0.07, origin=Location(3.0, 4.0))
    (path,) = writer.write(plan, folder / f"floor{writer.ending}")
    again = read(path)
    assert np.array_equal(again.cells, np.where(cells == FREE, FREE, OCCUPIED))
    assert (again.resolution, again.origin) == (0.5, (0.0, 0.0))  # the format has neither
    assert list(folder.iterdir()) == [path]


def test_each_kind_of_cell_has_its_letter(tmp_path):
    (path,) = MovingAi().write(grid_plan(KNOWN), tmp_path / "new" / "floor.map")
    lines = ["OOOOOOOO", "O@@@@@@O", "O@....@O", "O@.T..@O", "O@.@@@@O", "O@@@OOOO"]
    assert path.read_bytes().decode("ascii") == "\n".join(["type octile", "height 6", "width 8", "map", *lines, ""])


@settings(max_examples=60, deadline=None)
@given(arrays("U1", SHAPES, elements=st.sampled_from(list(TERRAIN))))
def test_terrain_is_kept(tmp_path_factory, letters):
    folder = tmp_path_factory.mktemp("map")
    drawn = "\n".join("".join(row) for row in letters)
    (folder / "a.map").write_text(f"type octile\nheight {len(letters)}\nwidth {letters.shape[1]}\nmap\n{drawn}\n")
    first = read(folder / "a.map")
    again = read(MovingAi().write(first, folder / "b.map")[0])
    assert np.array_equal(again.cells, np.isin(letters[::-1], list(PASSABLE), invert=True))
    assert np.array_equal(again.cells, first.cells)
    assert terrain(again) == terrain(first) == [[TERRAIN[letter] for letter in row] for row in letters[::-1]]


def test_cells_count_more_than_their_terrain(tmp_path):
    cells = np.array([[0, 1, 0, 1]], dtype=np.uint8)
    names = {0: "water", 1: "swamp", 2: "carpet"}
    layer = Layer(np.array([[0, 1, 1, 2]], dtype=np.uint16), names)
    (path,) = MovingAi().write(grid_plan(KNOWN, cells=cells, layers={"terrain": layer}), tmp_path / "a.map")
    assert path.read_text().splitlines()[-1] == ".@S@"


def test_geometry_is_refused(tmp_path):
    with pytest.raises(PlanError, match=r"plan drawn: is geometry, and moving_ai holds cells alone. Rasterize it"):
        MovingAi().write(floor_plan(box(0, 0, 1, 1)), tmp_path / "floor.map")
    assert not list(tmp_path.iterdir())


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.uint8, SHAPES, elements=st.sampled_from([0, 0, 0, 1, 3])).filter(lambda cells: (cells == FREE).any()),
    st.data(),
)
def test_scenarios_are_kept_and_their_lengths_are_those_of_the_benchmark(tmp_path_factory, cells, data):
    folder = tmp_path_factory.mktemp("map")
    plan = read(MovingAi().write(grid_plan(KNOWN, cells=cells), folder / "a.map")[0])
    rows, cols = cells.shape
    ends = st.sampled_from([(int(col), rows - 1 - int(row)) for row, col in np.argwhere(cells == FREE)])
    pairs = data.draw(st.lists(st.tuples(ends, ends), max_size=5))
    drawn = [Scenario(bucket, start, goal, 0.0) for bucket, (start, goal) in enumerate(pairs)]
    ours = lengths_on(plan, drawn)
    theirs = octile_lengths(cells)
    at = [[(rows - 1 - row) * cols + col for col, row in pair] for pair in pairs]
    assert ours == pytest.approx([theirs[start, goal] for start, goal in at], abs=1e-5)
    reachable = [
        scenario._replace(octile=length) for scenario, length in zip(drawn, ours, strict=True) if not isinf(length)
    ]
    write_scenarios(folder / "a.map.scen", plan, "a.map", reachable)
    again = read_scenarios(folder / "a.map.scen")
    assert [scenario._replace(octile=0.0) for scenario in again] == [s._replace(octile=0.0) for s in reachable]
    assert [s.octile for s in again] == pytest.approx([s.octile for s in reachable], abs=1e-8)


def ground() -> GridPlan:
    return grid_plan(tuple(line.replace("@", "#") for line in GROUND))


def test_a_line_is_as_the_benchmark_has_it(tmp_path):
    path = tmp_path / "new" / "a.map.scen"
    scenario = Scenario(1, (0, 0), (2, 2), 2 + 2)
    write_scenarios(path, ground(), "sets/a b.map", [scenario])
    assert path.read_bytes() == b"version 1\n1\tsets/a b.map\t4\t3\t0\t0\t2\t2\t4.00000000\n"
    assert read_scenarios(path) == [scenario]
    assert lengths_on(ground(), [scenario]) == pytest.approx([4.0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start": (1, 1)}, "scenario 2: column 1, row 1 from the top is no free cell."),
        ({"goal": (3, 2)}, "column 3, row 2 from the top is no free cell."),
        ({"goal": (4, 0)}, "column 4, row 0 from the top"),
        ({"goal": (0, 3)}, "column 0, row 3 from the top"),
        ({"goal": (0, -1)}, "column 0, row -1 from the top"),
        ({"start": (-1, 0)}, "column -1, row 0 from the top"),
        ({"octile": inf}, "scenario 2: a length of inf, expected one of a path."),
        ({"octile": nan}, "a length of nan"),
        ({"octile": -1.0}, "a length of -1.0"),
    ],
)
def test_a_scenario_that_is_none_is_refused(tmp_path, change, message):
    path, good = tmp_path / "a.map.scen", Scenario(0, (0, 0), (3, 0), 3.0)
    with pytest.raises(PlanError) as refusal:
        write_scenarios(path, ground(), "a.map", [good, good._replace(**change)])
    assert str(refusal.value).startswith(f"{path}: scenario 2: ")
    assert message in str(refusal.value)
    assert not path.exists()


@pytest.mark.parametrize("name", ["", "a\tb.map", "a\nb.map"])
def test_a_name_that_would_break_the_table_is_refused(tmp_path, name):
    with pytest.raises(PlanError, match="is no name of a map, expected plain letters"):
        write_scenarios(tmp_path / "a.scen", ground(), name, [])
