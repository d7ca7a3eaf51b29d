from math import inf, nan

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.openings import doors_from
from pipeline.floorplans.plan import Bounds, Door, Location, polygon_from
from tests.floorplans.samples import KNOWN, cells_of, floor_plan, grid_plan

TWO_PARTS = (
    "#########",
    "#....#..#",
    "#....#..#",
    "#....#..#",
    "#########",
)
ROOM = shapely.box(0, 0, 6, 4)


def test_components_are_counted_and_a_sealed_room_is_reported():
    report = inspect(grid_plan(TWO_PARTS, resolution=1.0))
    assert report.free_components == 2
    assert report.largest_free_share == pytest.approx(12 / 18)
    assert any("only 67% of the free floor" in warning for warning in report.warnings)
    assert (report.width_m, report.height_m) == (9.0, 5.0)


def test_geometry_is_measured_the_same_way():
    both = shapely.union_all([ROOM, shapely.box(7, 0, 9, 4)])
    report = inspect(floor_plan(both))
    assert report.free_components == 2
    assert report.largest_free_share == pytest.approx(0.75)


def test_marked_doors_come_before_estimates_and_splinters_do_not_count():
    doors = (Door(1, 1, 0.1), Door(2, 2, 0.9), Door(3, 3, 1.4))
    report = inspect(floor_plan(ROOM, doors=doors))
    assert report.narrowest_door_m == 0.9
    assert any("1 of 3 marked doors" in warning for warning in report.warnings)


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 30), st.integers(0, 5), st.floats(0, 3.1))
def test_the_width_of_a_door_does_not_depend_on_its_angle(width, thickness, angle):
    rows, cols = np.mgrid[0:90, 0:90] - 45.0
    along, across = cols * np.cos(angle) + rows * np.sin(angle), rows * np.cos(angle) - cols * np.sin(angle)
    marked = (np.abs(along) <= 8 + width / 2) & (np.abs(across) <= 1 + thickness / 2)
    (door,) = doors_from(marked, 0.1, Location(0.0, 0.0))
    assert door.width == pytest.approx(0.1 * (2 * (8 + width / 2)), abs=0.35)
    assert (door.x, door.y) == pytest.approx((4.55, 4.55), abs=0.1)


BAD = {
    "NaN bounds": (floor_plan(ROOM, bounds=Bounds(0, 0, nan, 4)), "not a finite number"),
    "NaN corner": (
        floor_plan(shapely.Polygon([(0, 0), (6, nan), (6, 4)]), bounds=Bounds(0, 0, 6, 4)),
        "not a finite number",
    ),
    "infinite": (floor_plan(ROOM, bounds=Bounds(0, 0, inf, 4)), "not a finite number"),
    "NaN resolution": (grid_plan(KNOWN, resolution=nan), "not a finite number"),
    "resolution 0": (grid_plan(KNOWN, resolution=0.0), "resolution 0 m per cell, expected 0.01 to 1"),
    "resolution -1": (grid_plan(KNOWN, resolution=-1.0), "resolution -1 m per cell"),
    "in centimetres": (floor_plan(shapely.box(0, 0, 6000, 4000)), "the plan is 6000 m wide, expected 2 to 2000 m"),
    "tiny": (floor_plan(shapely.box(0, 0, 6, 1)), "the plan is 1 m high"),
    "empty geometry": (floor_plan(shapely.Polygon(), bounds=Bounds(0, 0, 6, 4)), "the plan is empty"),
    "empty grid": (grid_plan(("####", "####", "####", "####"), resolution=1.0), "the plan is empty"),
    "no cells": (grid_plan(KNOWN, cells=np.zeros((0, 0), dtype=np.uint8)), "the plan is 0 m wide"),
    "crossing outline": (floor_plan(shapely.Polygon([(0, 0), (6, 4), (6, 0), (0, 4)])), "Self-intersection"),
    "odd cells": (grid_plan(KNOWN, cells=cells_of(KNOWN) + 9), "cells hold 12"),
    "start in a wall": (
        floor_plan(ROOM, endpoints=(Location(9, 9), Location(1, 1))),
        "the start (9, 9) m is not on free",
    ),
    "goal in a wall": (
        floor_plan(ROOM, endpoints=(Location(1, 1), Location(0, -1))),
        "the goal (0, -1) m is not on free",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_an_impossible_plan_is_refused_by_name(case):
    plan, message = BAD[case]
    with pytest.raises(PlanError) as refusal:
        inspect(plan)
    assert message in str(refusal.value)
    assert "drawn" in str(refusal.value)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(0, 0), (1, nan), (1, 1)], "a corner is not a finite number"),
        ([(0, 0), (1, 1)], "at least 3 corners, got 2"),
        ([(0, 0), (6, 4), (6, 0), (0, 4)], "Self-intersection"),
    ],
)
def test_a_polygon_is_checked_where_it_is_made(points, message):
    with pytest.raises(PlanError, match=message):
        polygon_from(points, name="plan x")


def test_a_house_on_white_paper_is_warned_of_and_one_with_an_open_side_is_not():
    paper = ("........", ".######.", ".#....#.", ".#....#.", ".##.###.", "........")
    open_side = ("########", "#......#", "#......#", "#......#", "........")
    (warning,) = inspect(grid_plan(paper, resolution=1.0)).warnings
    assert warning == (
        "100% of the border is free: if that is paper around the house and no floor, say plans.read.paper=true"
    )
    assert inspect(grid_plan(open_side, resolution=1.0)).warnings == ()


def test_what_a_reader_remarks_is_no_warning():
    assert inspect(floor_plan(ROOM, remarks=("an outline was repaired",))).warnings == ()
