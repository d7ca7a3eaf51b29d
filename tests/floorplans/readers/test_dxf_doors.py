"""Doors whose swing is no arc: stretched blocks, splines, chains of short lines."""

from collections.abc import Callable

import numpy as np
import pytest

from tests.floorplans.readers.drawing_samples import check_house, contains
from tests.floorplans.readers.dxf_samples import OPENING, UNITS, WALL, Sheet, read

ROOM = [(0.0, 0.0), (8.0, 0.0), (8.0, 5.0), (0.0, 5.0)]


def room(*unit) -> Sheet:
    """Two rooms, the partition along x = 3 drawn across the door."""
    return Sheet(*unit).lines(ROOM, closed=True, **WALL).lines([(3, 0), (3, 5)], **WALL)


def swing_of(sheet: Sheet, kind: str) -> None:
    """A block of a door hinged at its base: leaf along y, closed along x, of 1 unit."""
    block = sheet.document.blocks.new("D")
    block.add_line((0, 0), (0, 1))
    spots = [(np.cos(turn), np.sin(turn)) for turn in np.radians(np.linspace(0, 90, 9))]
    if kind == "arc":
        block.add_arc((0, 0), 1, 0, 90)
    elif kind == "bulge":
        block.add_lwpolyline([(1, 0, np.tan(np.pi / 8)), (0, 1, 0.0)], format="xyb")
    elif kind == "chain":
        block.add_lwpolyline(spots)
    elif kind == "chain in space":
        block.add_polyline3d(spots)
    elif kind == "leaf and chain":
        block.add_lwpolyline([(0, 0), *reversed(spots)])
    else:
        block.add_open_spline([(1, 0), (1, 0.5523), (0.5523, 1), (0, 1)])


KINDS = ["arc", "bulge", "chain", "chain in space", "leaf and chain", "spline"]


@pytest.mark.parametrize("unit", ["m", "mm"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_stretched_swing_is_a_swing(tmp_path, kind, unit):
    """Turned by a quarter at (3, 2): the doorway runs up the partition to y = 2 + 1.1, the leaf to x = 3 - 0.7."""
    sheet = room(*UNITS[unit])
    swing_of(sheet, kind)
    (at,) = sheet.at([(3, 2)])
    place = {"xscale": 1.1 * sheet.unit, "yscale": 0.7 * sheet.unit, "rotation": 90}
    sheet.space.add_blockref("D", at, dxfattribs=OPENING | place)
    plan = read(sheet.save(tmp_path))
    (door,) = plan.doors
    assert (door.x, door.y, door.width) == pytest.approx((3.0, 2.55, 1.1), abs=0.01)
    assert contains(plan, [(3, 2.1), (3, 3.0), (3, 1.9), (3, 3.2)]) == [True, True, False, False]


@pytest.mark.parametrize("kind", KINDS)
def test_a_stretched_swing_may_be_mirrored_and_turned(tmp_path, kind):
    """Hinged at (3, 2) and closed downwards to y = 2 - 0.8; the leaf of 1.2 m stands open to the east."""
    sheet = room()
    swing_of(sheet, kind)
    place = {"xscale": -0.8, "yscale": -1.2, "rotation": 90}
    sheet.space.add_blockref("D", (3, 2), dxfattribs=OPENING | place)
    (door,) = read(sheet.save(tmp_path)).doors
    assert (door.x, door.y, door.width) == pytest.approx((3.0, 1.6, 0.8), abs=0.01)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stretch", [0.4, 1.0, 2.5])
def test_the_doorway_in_a_gap_is_as_wide_as_the_stretch_says(tmp_path, kind, stretch):
    """The wall has a gap from (1, 4) to (1.9, 4), which the block spans; its leaf is stretched."""
    sheet = Sheet().walls(partition=None)
    for piece in (((0.0, 4.0), (1.0, 4.0)), ((1.9, 4.0), (4.0, 4.0))):
        sheet.lines(piece, **WALL)
    swing_of(sheet, kind)
    sheet.space.add_blockref("D", (1, 4), dxfattribs=OPENING | {"xscale": 0.9, "yscale": 0.9 * stretch})
    check_house(read(sheet.save(tmp_path)))


def oval(sheet: Sheet) -> None:
    sheet.space.add_ellipse((3, 2), (0, 1.1), 0.7 / 1.1, 0, np.pi / 2, dxfattribs=OPENING)


def chain_in_millimetres(sheet: Sheet) -> None:
    """Its corners are rounded, as in many exports; six pieces."""
    turns = np.radians(np.linspace(0, 90, 7))
    corners = np.stack([3 - 0.7 * np.sin(turns), 2 + 1.1 * np.cos(turns)], axis=1)
    sheet.space.add_lwpolyline(np.round(corners, 3), dxfattribs=OPENING)


def spline_through_points(sheet: Sheet) -> None:
    turns = np.radians(np.linspace(0, 90, 6))
    sheet.space.add_spline([(3 - 0.7 * np.sin(turn), 2 + 1.1 * np.cos(turn)) for turn in turns], dxfattribs=OPENING)


def chain_of_r12(sheet: Sheet) -> None:
    turns = np.radians(np.linspace(0, 90, 13))
    corners = np.stack([3 - 0.7 * np.sin(turns), 2 + 1.1 * np.cos(turns)], axis=1)
    sheet.space.add_polyline2d(corners, dxfattribs=OPENING)


@pytest.mark.parametrize("draw", [oval, chain_in_millimetres, spline_through_points, chain_of_r12])
def test_a_stretched_swing_is_known_without_block_and_leaf(tmp_path, draw: Callable[[Sheet], None]):
    sheet = room()
    draw(sheet)
    (door,) = read(sheet.save(tmp_path)).doors
    assert (door.x, door.y, door.width) == pytest.approx((3.0, 2.55, 1.1), abs=0.02)


@pytest.mark.parametrize("degrees", [45, 60, 120, 180])
def test_round_chains_may_turn_less_or_more_than_a_quarter(tmp_path, degrees):
    """From the partition at (3, 3) about the hinge (3, 2)."""
    turns = np.radians(np.linspace(90, 90 + degrees, 3 + degrees // 10))
    sheet = room()
    sheet.space.add_lwpolyline([(3 + np.cos(turn), 2 + np.sin(turn)) for turn in turns], dxfattribs=OPENING)
    sheet.space.add_line((3, 2), (3 + np.cos(turns[-1]), 2 + np.sin(turns[-1])), dxfattribs=OPENING)
    (door,) = read(sheet.save(tmp_path)).doors
    x, y = (3.0, 2.5) if degrees != 180 else (3.0, pytest.approx(2.5, abs=1.01))
    assert (door.x, door.y, door.width) == (pytest.approx(x, abs=0.01), pytest.approx(y), pytest.approx(1.0, abs=0.01))


@pytest.mark.parametrize(("degrees", "stretch"), [(60, 0.6), (60, 1.5), (120, 0.5), (120, 1.6), (180, 0.7)])
def test_stretched_chains_may_turn_less_or_more_than_a_quarter(tmp_path, degrees, stretch):
    """The leaf is closed along the partition, from (3, 2) to (3, 3); the stretch is across."""
    turns = np.radians(np.linspace(90, 90 + degrees, 8 + degrees // 10))
    sheet = room()
    corners = [(3 + stretch * np.cos(turn), 2 + np.sin(turn)) for turn in turns]
    sheet.space.add_lwpolyline(corners, dxfattribs=OPENING)
    sheet.space.add_line((3, 2), corners[-1], dxfattribs=OPENING)
    sheet.lines([(3, 2), (3, 1)], layer="A-WALL-2")  # the wall goes on: a half turn is open against it
    (door,) = read(sheet.save(tmp_path)).doors
    assert (door.x, door.width) == pytest.approx((3.0, 1.0), abs=0.01)
    assert door.y == pytest.approx(2.5, abs=0.01 if degrees != 180 else 1.01)


def test_what_is_not_round_is_no_swing(tmp_path):
    """A frame, a step and a zigzag: each door is as wide as its box is long."""
    sheet = Sheet().lines([(0, 0), (20, 0), (20, 5), (0, 5)], closed=True, **WALL).lines([(0, 2), (20, 2)], **WALL)
    sheet.space.add_lwpolyline([(2, 1.9), (3, 1.9), (3, 2.1), (2, 2.1)], close=True, dxfattribs=OPENING)
    sheet.space.add_lwpolyline([(6, 2), (6.3, 2), (6.3, 2.1), (7.2, 2.1)], dxfattribs=OPENING)
    zigzag = [(11 + 0.1 * k, 2 + 0.05 * (k % 2)) for k in range(10)]
    sheet.space.add_lwpolyline(zigzag, dxfattribs=OPENING)
    doors = sorted(read(sheet.save(tmp_path)).doors)
    assert [door.x for door in doors] == pytest.approx([2.5, 6.6, 11.45], abs=0.02)
    assert [door.width for door in doors] == pytest.approx([1.0, 1.2, 0.9], abs=0.03)


def test_a_leaf_of_areas_is_one_door(tmp_path):
    """A filled leaf, and its swing."""
    sheet = room().arc((3.0, 2.0), 90, 180)
    sheet.space.add_solid([(2.1, 2.0), (3.0, 2.0), (2.1, 2.04), (3.0, 2.04)], dxfattribs=OPENING)
    (door,) = read(sheet.save(tmp_path)).doors
    assert (door.x, door.y, door.width) == pytest.approx((3.0, 2.45, 0.9), abs=0.01)


@pytest.mark.parametrize("thick", [0.1, 0.4])
def test_a_door_is_cut_through_a_wall_that_is_an_area(tmp_path, thick):
    """The wall is one wide line drawn across; the leaf stands open, across it."""
    sheet = Sheet().lines(ROOM, closed=True, **WALL)
    sheet.space.add_lwpolyline([(3, 0), (3, 5)], dxfattribs=WALL | {"const_width": thick})
    sheet.lines([(3, 2), (2.1, 2)], **OPENING).arc((3.0, 2.0), 90, 180)
    plan = read(sheet.save(tmp_path))
    (door,) = plan.doors
    assert (door.x, door.y, door.width) == pytest.approx((3.0, 2.45, 0.9), abs=0.01)
    assert contains(plan, [(3, 2.05), (3, 2.85), (3, 1.95), (3, 2.95)]) == [True, True, False, False]
