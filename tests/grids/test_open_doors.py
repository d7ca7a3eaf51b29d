from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.ndimage import label

from pipeline.floorplans.plan import Door
from pipeline.grids.occupancy import FREE, Point
from pipeline.grids.open_doors import cut_window, open_doors
from pipeline.grids.rasterize import pool, rasterize
from tests.floorplans.samples import floor_plan

FACTOR = 3  # a cell is 3 x 3 fine ones; here a fine cell is 1 m, a cell 3 m


def floor_of(*lines):
    """Fine cells, row 0 the lowest line; a dot is floor."""
    return np.array([[letter == "." for letter in line] for line in lines[::-1]])


def cells_of_floor(floor):
    return ~pool(~floor, FACTOR)


def opened_by(floor, *doors):
    """The cells that were opened, as (row, col)."""
    free = cells_of_floor(floor)

    def fine(window):
        return cut_window(floor, window._replace(**{key: value * FACTOR for key, value in window._asdict().items()}))

    kept = open_doors(free, doors, fine, factor=FACTOR, resolution=float(FACTOR), origin=Point(0.0, 0.0))
    assert (kept | free == kept).all()
    return {(int(row), int(col)) for row, col in np.argwhere(kept & ~free)}


# Three cells high, five wide each room; the wall is row 7 of 15. A door of 3 fine cells, over no whole cell.
THIN = floor_of(
    *["." * 15] * 7,
    "####...########",
    *["." * 15] * 7,
)
THICK = floor_of(
    *["." * 15] * 6,
    *["####...########"] * 7,
    *["." * 15] * 8,
)
# The door begins at a wall that goes up from the main one: cell (2, 1) touches the third room, (2, 2) does not.
CORNER = floor_of(
    *["....#.........."] * 7,
    "#####...#######",
    *["." * 15] * 7,
)
# No cell of the door but touches the third room at its left, a corridor of a cell beside it.
TIGHT = floor_of(
    *["...#..#........"] * 7,
    "####..#########",
    *["." * 15] * 7,
)
DIAGONAL = np.abs(np.subtract(*np.mgrid[:18, :18])) > 1
DIAGONAL[6:9, 6:9] = True


@pytest.mark.parametrize(
    ("floor", "door", "opened"),
    [
        (THIN, Door(5.5, 7.5, 3.0), {(2, 1)}),  # of cell 1 one fine cell is wall, of cell 2 two
        (THIN, Door(12.0, 7.5, 3.0), set()),  # marked where there is wall
        (THICK, Door(5.5, 11.5, 3.0), {(3, 1), (2, 1), (4, 1)}),
        (CORNER, Door(6.5, 7.5, 3.0), {(2, 2)}),
        (np.rot90(THIN), Door(7.5, 9.5, 3.0), {(3, 2)}),
        (DIAGONAL, Door(7.5, 7.5, 3.0), None),
    ],
    ids=["thin wall", "no door there", "thick wall", "corner", "turned", "diagonal"],
)
def test_a_door_is_opened_by_the_fewest_cells(floor, door, opened):
    found = opened_by(floor, door)
    sets = smallest_sets(floor, door)
    if opened is None:
        assert found in sets
    else:
        assert found == opened
        assert not sets or found in sets


def test_an_open_door_changes_nothing():
    floor = THIN.copy()
    floor[7, 3:9] = True
    assert opened_by(floor, Door(6.0, 7.5, 6.0)) == set()


def test_a_door_whose_every_cell_would_open_a_wall_stays_shut():
    assert opened_by(TIGHT, Door(5.0, 7.5, 2.0)) == set()


def test_two_doors_in_one_wall_are_both_opened_although_the_rooms_are_joined_by_one():
    floor = THIN.copy()
    floor[7, 10:13] = True  # cells 3 and 4
    assert opened_by(floor, Door(5.5, 7.5, 3.0), Door(11.5, 7.5, 3.0)) == {(2, 1), (2, 3)}


# --- the slow twin


def disc_of(floor, door):
    rows, cols = np.indices(floor.shape)
    return np.hypot(rows + 0.5 - door.y, cols + 0.5 - door.x) <= door.width / 2 * 1.2


def smallest_sets(floor, door, most=2):
    """The obvious twin: try all sets of 1, 2 blocked cells; return those of the first size of which one is right.

    A set is right if it joins the cells on both sides of the door along the floor and no free cell beside an opened
    one is parted from it, on the floor of the 3 x 3 cells around. Empty where none is, [{}] where the door is open.
    """
    free = cells_of_floor(floor)
    whole, _ = label(floor)
    sides, _ = label(floor & ~disc_of(floor, door))
    at_door = set(whole[disc_of(floor, door) & floor].tolist())
    ends = {}
    for row, col in np.argwhere(free).tolist():
        block = sides[row * FACTOR : (row + 1) * FACTOR, col * FACTOR : (col + 1) * FACTOR]
        if block.min() > 0 and whole[row * FACTOR, col * FACTOR] in at_door:
            ends.setdefault(int(block[0, 0]), []).append((row, col))
    if len(ends) != 2:
        return []
    first, second = ends.values()
    near = [
        (row, col)
        for row, col in np.argwhere(~free).tolist()
        if np.hypot((row + 0.5) * FACTOR - door.y, (col + 0.5) * FACTOR - door.x) < door.width + 2 * FACTOR
        and 0 < row < free.shape[0] - 1
        and 0 < col < free.shape[1] - 1
    ]
    for size in range(most + 1):
        right = [set(cells) for cells in combinations(near, size) if is_right(floor, free, cells, first, second)]
        if right:
            return right
    return []


def is_right(floor, free, opened, first, second):
    usable = floor & np.kron(free, np.ones((FACTOR, FACTOR), dtype=bool))
    for row, col in opened:
        rows, cols = (slice((k - 1) * FACTOR, (k + 2) * FACTOR) for k in (row, col))
        parts, _ = label(floor[rows, cols])
        beside = {
            int(parts[r * FACTOR, c * FACTOR]) for r in range(3) for c in range(3) if free[row - 1 + r, col - 1 + c]
        }
        if len(beside) > 1:
            return False
        own = np.zeros(parts.shape, dtype=bool)
        own[FACTOR : 2 * FACTOR, FACTOR : 2 * FACTOR] = True
        usable[rows, cols] |= own & (parts > 0) & (np.isin(parts, list(beside)) if beside else True)
    joined, _ = label(usable)
    return bool(
        {int(joined[r * FACTOR, c * FACTOR]) for r, c in first}
        & {int(joined[r * FACTOR, c * FACTOR]) for r, c in second}
    )


@st.composite
def worlds(draw):
    """Two rooms with a wall at any angle and a door in it, perhaps a third room without one that ends at the door."""
    size = 30
    rows, cols = np.indices((size, size)) + 0.5
    angle = draw(st.sampled_from([0.0, 0.3, 0.6, 0.785, 1.2, 1.57]))
    x, y = draw(st.integers(24, 36)) / 2, draw(st.integers(24, 36)) / 2
    along = (cols - x) * np.cos(angle) + (rows - y) * np.sin(angle)
    across = (rows - y) * np.cos(angle) - (cols - x) * np.sin(angle)
    width = draw(st.integers(5, 12)) / 2
    wall = np.abs(across) <= draw(st.sampled_from([0.75, 1.5, 2.5]))
    floor = ~(wall & (np.abs(along) > width / 2))
    if draw(st.booleans()):
        beyond = width / 2 + 1.0 + draw(st.integers(0, 4)) / 2
        floor &= ~((np.abs(along + beyond) <= 0.75) & (across > 0))
    floor[[0, -1], :] = floor[:, [0, -1]] = False
    return floor, Door(x, y, width)


@settings(max_examples=150, deadline=None)
@given(worlds())
def test_opened_cells_are_as_few_as_those_of_the_twin_and_no_wall_is_opened(world):
    floor, door = world
    found = opened_by(floor, door)
    sets = smallest_sets(floor, door)
    assume(sets or not found)
    if sets:
        assert len(found) == len(sets[0])
        assert found in sets
    after = cells_of_floor(floor)
    for cell in found:
        after[cell] = True
    # What the floor keeps apart stays apart: cells of one part of the grid lie on one part of the floor.
    parts, _ = label(floor)
    grid, count = label(after, structure=np.ones((3, 3)))
    for number in range(1, count + 1):
        cells = np.argwhere((grid == number) & cells_of_floor(floor))
        assert len({int(parts[row * FACTOR, col * FACTOR]) for row, col in cells}) <= 1


# --- with geometry


def two_rooms(angle_deg, width, wall, shift=0.0):
    """Two rooms of 6 x 4 m, a wall between them and a door in its middle, all turned about the door."""
    free = shapely.union_all(
        [
            shapely.box(-3 + shift, wall / 2, 3 + shift, 4),
            shapely.box(-3 + shift, -4, 3 + shift, -wall / 2),
            shapely.box(-width / 2, -wall / 2 - 0.01, width / 2, wall / 2 + 0.01),
        ]
    )
    turned = shapely.affinity.rotate(free, angle_deg, origin=(0, 0))
    return shapely.affinity.translate(turned, 7.13 + shift, 6.41), Door(7.13 + shift, 6.41, width)


@settings(max_examples=80, deadline=None)
@given(
    st.floats(0, 90),
    st.sampled_from([0.35, 0.5, 0.63, 0.77, 0.95]),
    st.sampled_from([0.02, 0.1, 0.3, 0.6]),
    st.floats(0, 0.3),
    st.sampled_from([0.3, 0.5]),
)
def test_a_marked_door_at_any_angle_joins_its_rooms(angle, width, wall, shift, resolution):
    free, door = two_rooms(angle, width, wall, shift)
    plan = floor_plan(free, doors=(door,))
    before, after = rasterize(plan, resolution), rasterize(plan, resolution, doors_from_m=0.3)
    assert before.origin == after.origin
    parts, _ = label(after.cells == FREE)
    sizes = np.sort(np.bincount(parts.ravel())[1:])[::-1]
    assert sizes[0] > 0.9 * sizes.sum()
    # Without the mark nothing changes, nor where the door is narrower than what is asked for.
    assert np.array_equal(before.cells, rasterize(floor_plan(free), resolution, doors_from_m=0.3).cells)
    assert np.array_equal(before.cells, rasterize(plan, resolution, doors_from_m=width + 0.01).cells)
    opened = np.argwhere(before.cells != after.cells)
    assert len(opened) <= np.ceil((wall + 2 * resolution) / resolution) * 2
