import time

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import label

from pipeline.errors import ConfigError, PlanError
from pipeline.floorplans.generators.guided_maze import MazeShape, draw_guided_maze
from pipeline.floorplans.plan import Bounds, Location
from pipeline.grids.occupancy import FREE, OCCUPIED, Point
from pipeline.grids.rasterize import check_doors, inside, pool, rasterize
from pipeline.randomness import stream
from tests.floorplans.samples import KNOWN, cells_of, floor_plan, grid_plan

TOUCH = 1e-6


def inside_slowly(free, rows, cols, resolution, origin):
    """The obvious twin: every cell as a box, a micrometre smaller on each side, covered by the polygon or not."""
    mask = np.zeros((rows, cols), dtype=np.bool_)
    for row in range(rows):
        for col in range(cols):
            x, y = origin.x + col * resolution, origin.y + row * resolution
            low, high = TOUCH, resolution - TOUCH
            mask[row, col] = free.covers(shapely.box(x + low, y + low, x + high, y + high))
    return mask


@st.composite
def floors(draw):
    """Random triangles and rectangles on a lattice, minus one more: slants, holes and edges on the lattice."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    triangles = [shapely.Polygon(rng.uniform(0, 10, (3, 2))) for _ in range(3)]
    corners = np.sort(rng.integers(0, 21, (3, 2, 2)) / 2, axis=1)
    boxes = [shapely.box(*low, *high) for low, high in corners if (high > low).all()]
    return shapely.union_all([*triangles, *boxes[:2]]).difference(
        boxes[-1].buffer(-0.3) if boxes else shapely.Polygon()
    )


@settings(max_examples=60, deadline=None)
@given(floors(), st.sampled_from([0.25, 0.3, 0.5, 0.7]), st.integers(0, 100))
def test_a_cell_is_free_only_if_all_of_it_is(free, resolution, shift):
    size = int(12 / resolution)
    origin = Point(-shift / 100, -0.5)  # never off the lattice by about a micrometre, where either answer is right
    assert np.array_equal(
        inside(free, size, size, resolution, origin), inside_slowly(free, size, size, resolution, origin)
    )


@settings(max_examples=30, deadline=None)
@given(floors(), st.sampled_from([0.25, 0.5]))
def test_turning_the_floor_turns_its_grid(free, resolution):
    size = int(10 / resolution)
    turned = shapely.transform(free, lambda points: np.stack([10 - points[:, 1], points[:, 0]], axis=1))
    straight = inside(free, size, size, resolution, Point(0, 0))
    assert np.array_equal(inside(turned, size, size, resolution, Point(0, 0)), np.rot90(straight, -1))


def test_a_drawn_floor_with_a_pillar():
    free = shapely.box(0, 0, 5, 4).difference(shapely.box(2.4, 1.4, 2.6, 1.6))
    grid = rasterize(floor_plan(free), 1.0)
    assert (grid.origin, grid.resolution) == (Point(-1, -1), 1.0)
    assert np.array_equal(
        grid.cells,
        cells_of(
            (
                "#######",
                "#.....#",
                "#.....#",
                "#..#..#",
                "#.....#",
                "#######",
            )
        ),
    )


def test_a_guided_maze_fills_144_by_188_cells():
    plan = draw_guided_maze(MazeShape(), stream(0, "m"), plan_id="m")
    grid = rasterize(plan, 0.3)
    assert grid.cells.shape == (188, 144)
    # Corridors are 8 and 16 cells wide: nothing is lost at their edges, which lie between cells.
    assert (grid.cells == FREE).sum() * 0.09 == pytest.approx(plan.free.area)


def test_mazes_are_rasterised_in_milliseconds():
    plans = [draw_guided_maze(MazeShape(), stream(0, k), plan_id=str(k)) for k in range(20)]
    began = time.perf_counter()
    for plan in plans:
        rasterize(plan, 0.3)
    assert (time.perf_counter() - began) / len(plans) < 0.04  # 1,500 in less than a minute


blocks = arrays(np.bool_, st.tuples(st.integers(1, 20), st.integers(1, 20)))


@given(blocks, st.integers(1, 4))
def test_a_pooled_cell_is_blocked_if_any_of_its_cells_is(blocked, factor):
    pooled = pool(blocked, factor)
    rows, cols = blocked.shape
    for row, col in np.ndindex(*pooled.shape):
        part = blocked[row * factor : (row + 1) * factor, col * factor : (col + 1) * factor]
        assert pooled[row, col] == (part.any() or part.size < factor**2)
    assert pooled.shape == (-(-rows // factor), -(-cols // factor))


@given(arrays(np.uint8, (12, 17), elements=st.integers(0, 3)), st.integers(1, 3), st.booleans())
def test_a_grid_plan_becomes_free_and_occupied_cells_in_a_closed_ring(cells, factor, drop):
    plan = grid_plan(KNOWN, cells=cells, resolution=0.1, origin=Location(-3.0, 7.0))
    try:
        grid = rasterize(plan, factor * 0.1, drop_clutter=drop)
    except PlanError:
        return
    ring = np.ones(grid.cells.shape, dtype=np.bool_)
    ring[1:-1, 1:-1] = False
    assert set(np.unique(grid.cells)) == {FREE, OCCUPIED}
    assert (grid.cells[ring] == OCCUPIED).all()
    # Every free cell stands on finer cells that are free, at the same place in the world.
    for row, col in np.argwhere(grid.cells == FREE):
        low_row = round((grid.origin.y - plan.origin.y) / 0.1) + row * factor
        low_col = round((grid.origin.x - plan.origin.x) / 0.1) + col * factor
        below = cells[low_row : low_row + factor, low_col : low_col + factor]
        assert below.shape == (factor, factor)
        assert np.isin(below, (FREE, 3) if drop else (FREE,)).all()


def test_unknown_margins_are_cut_away():
    grid = rasterize(grid_plan(KNOWN, resolution=0.5, origin=Location(10.0, 20.0)), 0.5)
    assert np.array_equal(grid.cells, cells_of(("######", "#....#", "#.#..#", "#.####", "######")))
    assert grid.origin == Point(10.5, 20.0)


FLOOR = floor_plan(shapely.box(0, 0, 6, 4))
GRID = grid_plan(KNOWN, resolution=0.1)


@pytest.mark.parametrize(
    ("plan", "resolution", "error", "message"),
    [
        (FLOOR, 0.0, ConfigError, "rasterize.resolution_m = 0: expected metres per cell above 0"),
        (FLOOR, -0.3, ConfigError, "rasterize.resolution_m = -0.3"),
        (FLOOR, float("nan"), ConfigError, "rasterize.resolution_m = nan"),
        (FLOOR, float("inf"), ConfigError, "rasterize.resolution_m = inf"),
        (FLOOR, 0.0002, ConfigError, "would have 20000 x 30000 cells"),
        (FLOOR, 50.0, PlanError, "no cell of 50 m lies inside its free space"),
        (
            GRID,
            0.25,
            ConfigError,
            "has cells of 0.1 m, so only whole multiples of that are possible (0.1, 0.2, 0.3, ...)",
        ),
        (GRID, 0.05, ConfigError, "has cells of 0.1 m"),
        (floor_plan(shapely.Polygon(), bounds=Bounds(0, 0, 6, 4)), 0.3, PlanError, "no cell of 0.3 m lies inside"),
    ],
)
def test_a_wrong_resolution_is_refused(plan, resolution, error, message):
    with pytest.raises(error) as refusal:
        rasterize(plan, resolution)
    assert message in str(refusal.value)


@given(st.floats(0.3, 3.0), st.floats(0, 1))
def test_a_door_of_three_cells_never_closes(width, shift):
    resolution = width / 3
    check_doors("p", width, resolution)
    wall = shapely.union_all(
        [shapely.box(0, 0, 9, 9), shapely.box(9, 3 + shift, 9.5, 3 + shift + width), shapely.box(9.5, 0, 19, 9)]
    )
    grid = rasterize(floor_plan(wall), resolution)
    blocked = grid.cells != FREE
    between = blocked[:, int((9 - grid.origin.x) / resolution) : int((9.5 - grid.origin.x) / resolution) + 1]
    assert not between.all(axis=1).all()
    assert (~between.any(axis=1)).sum() >= 1


def test_a_resolution_that_may_close_a_door_is_refused():
    with pytest.raises(ConfigError) as refusal:
        check_doors("W1-2_7", 0.6, 0.3)
    assert "narrowest door of plan W1-2_7 is 0.60 m, so at most 0.200 surely keeps it open" in str(refusal.value)
    check_doors("no doors", None, 0.3)


@settings(max_examples=300, deadline=None)
@given(
    resolution=st.sampled_from([0.1, 0.3, 0.5]),
    thickness=st.sampled_from([1e-5, 0.001, 0.02, 0.2]),
    bend=st.lists(st.floats(0.5, 7.5), min_size=0, max_size=4),
    on_lattice=st.booleans(),
)
def test_a_wall_thinner_than_a_cell_never_leaks(resolution, thickness, bend, on_lattice):
    across = [round(y / resolution) * resolution if on_lattice else y for y in [3.0, *bend, 5.0]]
    wall = shapely.LineString([*zip(np.linspace(-0.1, 10.1, len(across)), across, strict=True)])
    room = shapely.box(0, 0, 10, 8)
    free = room.difference(wall.buffer(thickness / 2, cap_style="flat", join_style="mitre"))
    above, below = (shapely.Polygon([*wall.coords, (10.1, y), (-0.1, y)]) for y in (9, -1))
    grid = rasterize(floor_plan(free), resolution)
    parts, _ = label(grid.cells == FREE, structure=np.ones((3, 3)))  # eight neighbours
    rows, cols = np.nonzero(parts)
    x, y = (grid.origin[k] + (cells + 0.5) * resolution for k, cells in enumerate((cols, rows)))
    of_above = set(parts[rows, cols][shapely.contains_xy(above, x, y)].tolist())
    of_below = set(parts[rows, cols][shapely.contains_xy(below, x, y)].tolist())
    assert of_above
    assert of_below
    assert not of_above & of_below


@given(blocks, st.integers(2, 4))
def test_pooling_joins_nothing_that_fine_cells_separate(blocked, factor):
    """Two pooled cells that touch lie in one 8-connected part of the fine cells."""
    blocked = np.pad(blocked, ((0, -blocked.shape[0] % factor), (0, -blocked.shape[1] % factor)), constant_values=True)
    fine, _ = label(~blocked, structure=np.ones((3, 3)))
    coarse, count = label(~pool(blocked, factor), structure=np.ones((3, 3)))
    for part in range(1, count + 1):
        spread = np.kron(coarse == part, np.ones((factor, factor), dtype=bool))
        assert len(np.unique(fine[spread])) == 1
