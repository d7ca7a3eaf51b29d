import numpy as np
import shapely

from pipeline.floorplans.plan import FREE, OCCUPIED, UNKNOWN
from pipeline.reports.plan_looks import FLOOR, FURNITURE, TINTS, UNSEEN, WALL, parts_of, shades_of, tint
from tests.floorplans.samples import KNOWN, cells_of, floor_plan, grid_plan

THREE_PARTS = (
    "###########",
    "#..#....#.#",
    "#..#....#.#",
    "###########",
)


def test_every_kind_of_cell_has_its_colour_and_row_0_stays_the_lowest():
    shades = shades_of(grid_plan(KNOWN))
    cells = cells_of(KNOWN)
    colours = {FREE: FLOOR, OCCUPIED: WALL, UNKNOWN: UNSEEN, 3: FURNITURE}
    assert {value: {tuple(pixel) for pixel in shades[cells == value].tolist()} for value in colours} == {
        value: {colour} for value, colour in colours.items()
    }
    assert (cells == 3).sum() == 1


def test_only_the_largest_part_of_the_floor_is_white_and_the_others_differ():
    shades = shades_of(grid_plan(THREE_PARTS))
    assert tuple(shades[1, 5]) == FLOOR  # 8 cells
    assert tuple(shades[1, 1]) == TINTS[0]  # 4 cells
    assert tuple(shades[1, 9]) == TINTS[1]  # 2 cells


def test_geometry_is_ranked_by_area_as_well():
    parts = parts_of(floor_plan(shapely.union_all([shapely.box(0, 0, 1, 1), shapely.box(2, 0, 6, 4)])))
    assert [part.area for part in parts] == [16.0, 1.0]


def test_there_is_a_tint_for_any_number_of_parts():
    assert tint(0) == FLOOR
    assert tint(len(TINTS) + 1) == tint(1) == TINTS[0]


def test_tints_are_told_from_floor_wall_and_unknown():
    colours = np.array([*TINTS, FLOOR, WALL, UNSEEN], dtype=int)
    apart = np.abs(colours[:, None] - colours[None]).sum(axis=2)
    assert apart[~np.eye(len(colours), dtype=bool)].min() >= 20
