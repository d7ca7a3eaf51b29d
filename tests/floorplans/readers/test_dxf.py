from collections.abc import Callable
from dataclasses import replace
from math import pi, tan
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely
from ezdxf.units import decode

from pipeline.floorplans.plan import Bounds
from pipeline.floorplans.readers import READERS, dxf_entities, read_plan_file
from pipeline.floorplans.readers import dxf as dxf_module
from pipeline.floorplans.readers.dxf import Dxf
from tests.floorplans.readers.drawing_samples import (
    DOOR,
    OUTLINE,
    PARTITION,
    check_house,
    contains,
    refusal,
)
from tests.floorplans.readers.dxf_samples import OPENING, UNITS, WALL, Sheet, read


@pytest.mark.parametrize("unit", UNITS)
def test_a_house_is_read_in_the_unit_of_its_header(tmp_path, unit):
    plan = read(Sheet(*UNITS[unit]).walls().door().save(tmp_path))
    check_house(plan)
    assert (plan.plan_id, plan.building, plan.environment, plan.source) == ("home", "home", "dxf_plans", "home.dxf")
    assert plan.remarks == (TAKEN,)


def test_binary_drawings_are_read_too(tmp_path):
    path = Sheet().walls().door().save(tmp_path, fmt="bin")
    assert Dxf().sniff(path)
    check_house(read(path))


@pytest.mark.parametrize("version", ["R12", "R2000", "R2018"])
def test_every_version_of_the_format_is_read(tmp_path, version):
    sheet = Sheet().walls().door()
    sheet.document.dxfversion = version
    path = sheet.save(tmp_path)
    check_house(read(path, metres_per_unit=1.0 if version == "R12" else None))


def test_polylines_and_curves_are_walls(tmp_path):
    sheet = Sheet()
    sheet.space.add_lwpolyline(OUTLINE, close=True, dxfattribs=WALL)
    sheet.space.add_polyline2d(PARTITION, dxfattribs=WALL)
    sheet.space.add_circle((7, 2), 0.3, dxfattribs=WALL)
    sheet.space.add_spline([(5, 1), (5.2, 2), (5, 3)], dxfattribs=WALL)
    plan = read(sheet.door().save(tmp_path))
    check_house(plan)
    assert contains(plan, [(7, 2), (5.2, 2), (5.4, 2)]) == [False, False, True]


def test_the_bulge_of_a_polyline_is_a_curve(tmp_path):
    sheet = Sheet()
    sheet.space.add_lwpolyline([(0, 0, 1.0), (4, 0, 0.0), (4, 6, 0.0), (0, 6, 0.0)], format="xyb", dxfattribs=WALL)
    sheet.lines([(0, 0), (0, 6)], **WALL)
    plan = read(sheet.save(tmp_path))
    assert contains(plan, [(2, -1.8), (2, -2.2), (0.2, -1.8)]) == [True, False, False]
    assert plan.free.area == pytest.approx(4 * 6 + pi * 2, rel=0.06)


@pytest.mark.parametrize("thick", [0.1, 0.25])
def test_walls_drawn_by_both_faces_are_filled_and_opened_at_the_door(tmp_path, thick):
    half = thick / 2
    sheet = Sheet().walls(partition=None)
    for low, high in ((0.0, 1.0), (1.9, 4.0)):
        box = [(low, 4 - half), (high, 4 - half), (high, 4 + half), (low, 4 + half)]
        sheet.lines(box, closed=True, **WALL)
    plan = read(sheet.door().save(tmp_path))
    check_house(plan)


def test_a_facade_with_gaps_is_closed(tmp_path):
    sheet = Sheet().lines(PARTITION, **WALL).lines([(2.0, 0.0), *OUTLINE[1:], (0.0, 0.0), (0.5, 0.0)], **WALL)
    check_house(read(sheet.door().save(tmp_path)))


def test_windows_are_walls(tmp_path):
    sheet = Sheet().walls(partition=None).lines([(0, 4), (2.5, 4)], **WALL).lines([(2.5, 4), (4, 4)], layer="A-GLAZ")
    check_house(read(sheet.door().save(tmp_path)))


TAKEN = "layers taken: walls from A-WALL; doors from A-DOOR"

# Doors: (how the house's door is drawn, the partition)
GAP = (((0.0, 4.0), (1.0, 4.0)), ((1.9, 4.0), (4.0, 4.0)))


def in_block(sheet: Sheet) -> None:
    """A block drawn in its own unit, hinged at its base point, its shapes on layer 0."""
    block = sheet.document.blocks.new("Door-90")
    block.add_line((0, 0), (0, 10))
    block.add_arc((0, 0), 10, 0, 90)
    place = {"xscale": 0.09, "yscale": 0.09, "layer": "SOMETHING"}
    sheet.space.add_blockref("Door-90", (1.0, 4.0), dxfattribs=place)


def in_mirrored_block(sheet: Sheet) -> None:
    """Hinged at the east jamb, by a block put in with a negative scale."""
    block = sheet.document.blocks.new("leaf")
    block.add_arc((0, 0), 1, 0, 90)
    sheet.space.add_blockref("leaf", (1.9, 4.0), dxfattribs=OPENING | {"xscale": -0.9, "yscale": 0.9})


def in_bulge(sheet: Sheet) -> None:
    quarter = tan(pi / 8)
    corners = [(1.9, 4.0, quarter), (1.0, 4.9, 0.0), (1.0, 4.0, 0.0)]
    sheet.space.add_lwpolyline(corners, format="xyb", dxfattribs=OPENING)


def in_box(sheet: Sheet) -> None:
    sheet.lines([(1.0, 3.9), (1.9, 3.9), (1.9, 4.1), (1.0, 4.1)], closed=True, **OPENING)


DOORS: dict[str, Callable[[Sheet], object]] = {
    "leaf and arc": Sheet.door,
    "arc alone": lambda sheet: sheet.arc(DOOR[0], 0, 90),
    "arc into the hall": lambda sheet: sheet.arc(DOOR[0], 270, 360),
    "hinged at the east": lambda sheet: sheet.arc(DOOR[1], 90, 180),
    "from below": lambda sheet: sheet.arc((-1.0, 4.0), 90, 180, extrusion=(0, 0, -1)),
    "block": in_block,
    "mirrored block": in_mirrored_block,
    "bulge": in_bulge,
    "box": in_box,
    "line": lambda sheet: sheet.lines(DOOR, **OPENING),
}


@pytest.mark.parametrize("drawn_across", [False, True], ids=["gap", "wall across"])
@pytest.mark.parametrize("door", DOORS)
def test_a_door_is_opened_however_it_is_drawn(tmp_path, door, drawn_across):
    sheet = Sheet().walls(partition=PARTITION if drawn_across else None)
    for piece in () if drawn_across else GAP:
        sheet.lines(piece, **WALL)
    DOORS[door](sheet)
    check_house(read(sheet.save(tmp_path)))


@pytest.mark.parametrize("away", [0.0, 0.08])
def test_a_leaf_that_stands_open_along_another_wall_is_not_the_doorway(tmp_path, away):
    """The leaf stands against the west wall of the study, or on its line."""
    sheet = Sheet().walls(partition=None).lines([(0.9 + away, 4), (4, 4)], **WALL)
    plan = read(sheet.arc((away, 4.0), 0, 90).lines([(away, 4.0), (away, 4.9)], **OPENING).save(tmp_path))
    (door,) = plan.doors
    assert (door.x, door.y, door.width) == pytest.approx((away + 0.45, 4.0, 0.9), abs=0.01)
    assert contains(plan, [(-0.1, 4.5), (2.0, 4.0)]) == [False, False]


def test_a_leaf_that_reaches_the_wall_of_a_narrow_corridor_is_not_the_doorway(tmp_path):
    """The wall is drawn across the door, and the open leaf bridges the corridor."""
    sheet = Sheet().lines([(0, 0), (8, 0), (8, 5), (0, 5)], closed=True, **WALL).lines([(0, 1), (8, 1)], **WALL)
    sheet.lines([(3, 1), (3, 0.1)], **OPENING).arc((3, 1), 270, 360)
    plan = read(sheet.save(tmp_path))
    assert [(door.x, door.y) for door in plan.doors] == [pytest.approx((3.45, 1.0))]
    assert len(shapely.get_parts(plan.free)) == 1


def test_tags_of_doors_are_no_doors(tmp_path):
    sheet = Sheet().walls().door().lines([(3, 3.8), (3.5, 3.8), (3.5, 4.2), (3, 4.2)], closed=True, layer="A-DOOR-IDEN")
    check_house(read(sheet.save(tmp_path)))


def test_a_house_without_its_door_is_sealed(tmp_path):
    check_house(read(Sheet().walls().save(tmp_path)), width=None)


def test_doors_that_cannot_be_doors_are_left_out_and_said(tmp_path):
    sheet = Sheet().walls().door().lines([(3, 4), (3.2, 4)], **OPENING).arc((5, 0), 0, 90, radius=7)
    plan = read(sheet.save(tmp_path))
    check_house(plan)
    assert plan.remarks == (TAKEN, "2 doors are not 0.4 to 6.0 m wide: left out")


def test_blocks_are_put_where_they_belong(tmp_path):
    """A block of walls on layer 0, turned by a quarter and scaled, within another block."""
    sheet = Sheet()
    inner = sheet.document.blocks.new("inner")
    turned = [(y * 1000, -x * 1000) for x, y in OUTLINE]
    inner.add_lwpolyline(turned, close=True)
    outer = sheet.document.blocks.new("outer")
    outer.add_blockref("inner", (0, 0), dxfattribs={"rotation": 90})
    sheet.space.add_blockref("outer", (0, 0), dxfattribs=WALL | {"xscale": 1e-3, "yscale": 1e-3})
    sheet.lines(PARTITION, **WALL)
    check_house(read(sheet.door().save(tmp_path)))


def test_a_block_in_rows_and_columns_is_put_in_as_often(tmp_path):
    sheet = Sheet().lines([(0, 0), (12, 0), (12, 8), (0, 8)], closed=True, **WALL)
    sheet.document.blocks.new("pillar").add_circle((0, 0), 0.3)
    array = {"column_count": 3, "row_count": 2, "column_spacing": 3.0, "row_spacing": 4.0}
    sheet.space.add_blockref("pillar", (3, 2), dxfattribs=WALL | array)
    plan = read(sheet.save(tmp_path))
    pillars = [(x, y) for x in (3, 6, 9) for y in (2, 6)]
    assert contains(plan, pillars) == [False] * 6
    assert contains(plan, [(x + 1.5, y) for x, y in pillars]) == [True] * 6


def test_blocks_that_hold_themselves_end(tmp_path):
    sheet = Sheet().walls().door()
    loop = sheet.document.blocks.new("loop")
    loop.add_blockref("loop", (0, 0))
    sheet.space.add_blockref("loop", (0, 0), dxfattribs=WALL)
    sheet.space.add_blockref("nowhere", (0, 0), dxfattribs=WALL)
    check_house(read(sheet.save(tmp_path)))


@pytest.mark.parametrize(
    "layer", ["A-WALL-EXTR", "walls", "Wände", "MUR", "Mur porteur", "Murs porteurs", "PAREDES", "Indoor walls"]
)
def test_walls_are_found_by_the_names_of_layers_in_several_languages(tmp_path, layer):
    sheet = Sheet().lines(OUTLINE, closed=True, layer=layer).lines(PARTITION, layer=layer)
    check_house(read(sheet.door().save(tmp_path)))


@pytest.mark.parametrize("layer", ["A-WALL-PATT", "Wall hatch", "A-ANNO-WALL", "A-FURN", "A-WALL-DIMS", "A-WALL-IDEN"])
def test_other_layers_are_no_walls(tmp_path, layer):
    sheet = Sheet().walls().door().lines([(5, 1), (9, 1), (9, 3)], layer=layer)
    assert contains(read(sheet.save(tmp_path)), [(7, 1), (9, 2)]) == [True, True]


def test_layers_that_a_person_names_are_taken_alone(tmp_path):
    sheet = Sheet().lines(OUTLINE, closed=True, layer="E1").lines(PARTITION, layer="e2 inner")
    sheet.lines([(5, 1), (9, 1)], **WALL).arc(DOOR[0], 0, 90, layer="T")
    plan = read(sheet.save(tmp_path), wall_layers=("e1", "E2*"), door_layers=("t",))
    check_house(plan)
    assert contains(plan, [(7, 1)]) == [True]


def test_what_is_no_line_is_left_out_and_said(tmp_path):
    sheet = Sheet().walls().door()
    sheet.space.add_text("W1", dxfattribs=WALL)
    sheet.space.add_text("W2", dxfattribs=WALL)
    sheet.space.add_point((1, 1), dxfattribs=OPENING)
    sheet.space.add_text("a remark", dxfattribs={"layer": "NOTES"})
    sheet.space.add_line((0, 0), (1e12, 0), dxfattribs=WALL)
    plan = read(sheet.save(tmp_path))
    check_house(plan)
    assert plan.remarks == (
        f"{TAKEN}; not from NOTES",
        "layer A-WALL holds 2 TEXT, which are not read",
        "layer A-DOOR holds 1 POINT, which is not read",
        "layer A-WALL holds 1 LINE, which is damaged",
    )


def test_walls_are_as_thick_as_asked(tmp_path):
    path = Sheet(*UNITS["mm"]).walls().save(tmp_path)
    thin, thick = read(path, wall_m=0.1), read(path, wall_m=0.3)
    assert contains(thin, [(0.1, 2)]) == [True]
    assert contains(thick, [(0.1, 2)]) == [False]


# The scale
@pytest.mark.parametrize("insunits", [0, 99, -1])
def test_a_drawing_without_unit_is_refused_with_a_proposal(tmp_path, insunits):
    path = Sheet(insunits, 1000.0).walls().door().save(tmp_path)
    text = refusal(Dxf(), path)
    assert "the file does not say how many metres a unit of it has. Set plans.read.metres_per_unit." in text
    assert "Its doors are 900 units wide: 0.9 m at 0.001." in text
    check_house(read(path, metres_per_unit=0.001))


METRES = {  # of the codes of $INSUNITS, by hand
    1: 0.0254,
    2: 0.3048,
    3: 1609.344,
    4: 0.001,
    5: 0.01,
    6: 1,
    7: 1000,
    8: 2.54e-8,
    9: 2.54e-5,
    10: 0.9144,
    11: 1e-10,
    12: 1e-9,
    13: 1e-6,
    14: 0.1,
    15: 10,
    16: 100,
    17: 1e9,
    18: 1.495978707e11,
    19: 9.4607304725808e15,
    20: 3.0856775814913673e16,
    21: 0.3048006096012192,
    22: 0.0254000508001016,
    23: 0.9144018288036576,
    24: 1609.3472186944375,
}


@pytest.mark.parametrize("code", [code for code, metres in METRES.items() if 1e-7 < metres < 1e4])
def test_every_unit_of_the_header_is_known(tmp_path, code):
    check_house(read(Sheet(code, 1 / METRES[code]).walls().door().save(tmp_path)))


@pytest.mark.parametrize("code", METRES)
def test_units_that_no_building_is_drawn_in_are_known_too(code):
    document = ezdxf.new()
    document.header["$INSUNITS"] = code
    assert dxf_module._stated_scale(document) == pytest.approx(METRES[code], rel=1e-12)


@pytest.mark.parametrize("origin", [(568_053.4, 5_774_347.2), (3_568_053.4, 5_774_347.2), (500_000.0, 9_999_900.0)])
@pytest.mark.parametrize("unit", ["mm", "m"])
def test_drawings_in_the_coordinates_of_a_country_are_read(tmp_path, origin, unit):
    """UTM, Gauss-Krueger, and UTM just south of the equator, whose northings are the largest there are."""
    plan = read(Sheet(*UNITS[unit], origin=origin).walls().door().save(tmp_path))
    east, north = origin
    low_x, low_y, high_x, high_y = plan.bounds
    (door,) = plan.doors
    check_house(
        replace(
            plan,
            free=shapely.transform(plan.free, lambda points: points - origin),
            bounds=Bounds(low_x - east, low_y - north, high_x - east, high_y - north),
            doors=(door._replace(x=door.x - east, y=door.y - north),),
        )
    )
    assert plan.remarks == (TAKEN,)


def test_names_of_layers_that_a_person_gave_in_vain_are_said(tmp_path):
    plan = read(Sheet().walls().door().save(tmp_path), wall_layers=("a-wall", "W9"), door_layers=("LEAVES",))
    assert plan.remarks == (
        "layers taken: walls from A-WALL; doors from none; not from A-DOOR",
        "no layer of walls is called W9; it has A-DOOR, A-WALL",
        "no layer of doors is called LEAVES; it has A-DOOR, A-WALL",
    )


def test_blocks_of_doors_are_named_as_taken(tmp_path):
    sheet = Sheet().walls()
    in_block(sheet)
    assert read(sheet.save(tmp_path)).remarks == ("layers taken: walls from A-WALL; doors from block Door-90",)


def test_without_doors_there_is_no_proposal(tmp_path):
    text = refusal(Dxf(), Sheet(0).walls().save(tmp_path))
    assert text.endswith("Set plans.read.metres_per_unit.")


def test_a_person_overrules_the_header_and_the_plan_says_so(tmp_path):
    path = Sheet(6, 1000.0).walls().door().save(tmp_path)
    plan = read(path, metres_per_unit=0.001)
    check_house(plan)
    assert plan.remarks == (TAKEN, "the header states 1 m per unit, 0.001 m was asked for and taken")
    assert read(Sheet().walls().door().save(tmp_path), metres_per_unit=1.0).remarks == (TAKEN,)


# What is refused
def test_a_drawing_without_wall_layers_says_which_it_has(tmp_path):
    path = Sheet().lines(OUTLINE, closed=True, layer="E1").lines(PARTITION, layer="E2").save(tmp_path)
    text = refusal(Dxf(), path)
    assert "no wall on layers named for walls (wall, Wand, mur, pared, muro); it has E1, E2. Name" in text
    assert "it has E1, E2. Name the layers of the walls in plans.read.wall_layers." in text
    assert "no wall on layers W9; it has E1, E2" in refusal(Dxf(), path, wall_layers=("W9",))
    assert "it has none" in refusal(Dxf(), Sheet().save(tmp_path, "empty.dxf"))


BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (Path.unlink, "not a readable DXF file"),
    "empty": (lambda path: path.write_bytes(b""), "DXF"),
    "text": (lambda path: path.write_text("hello\nthere\n"), "DXF"),
    "bytes": (lambda path: path.write_bytes(bytes(range(256)) * 20), "DXF"),
    "start of a binary": (lambda path: path.write_bytes(b"AutoCAD Binary DXF\r\n\x1a\x00\x01"), "damaged DXF"),
    "tag for a number": (lambda path: path.write_text("  0\nSECTION\nx\nHEADER\n"), "damaged DXF"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_damaged_file_gives_one_clear_error(tmp_path, case):
    damage, message = BAD[case]
    path = Sheet().walls().door().save(tmp_path)
    damage(path)
    assert message in refusal(Dxf(), path)


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7, 0.9, 0.99])
@pytest.mark.parametrize("fmt", ["asc", "bin"])
def test_a_truncated_file_is_refused_whole(tmp_path, share, fmt):
    path = Sheet().walls().door().save(tmp_path, fmt=fmt)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    assert "damaged DXF" in refusal(Dxf(), path)


def test_too_large_a_drawing_is_refused(tmp_path, monkeypatch):
    path = Sheet().walls().door().save(tmp_path)
    monkeypatch.setattr(dxf_entities, "MOST_ENTITIES", 5)
    assert "more than 5 entities with those of blocks. Simplify the drawing." in refusal(Dxf(), path)
    monkeypatch.setattr(dxf_module, "_MOST_BYTES", 100)
    assert "more than 100 bytes, at most that many are read. Simplify it." in refusal(Dxf(), path)


def test_a_drawing_is_known_by_its_first_section(tmp_path):
    path = Sheet().walls().door().save(tmp_path, "drawing.txt")
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["dxf"]
    assert not Dxf().accompanies(path)
    check_house(read_plan_file(path)[0])
    path.write_text("999\nmade by hand\n" + path.read_text())
    assert Dxf().sniff(path)
    check_house(read(path))


@pytest.mark.parametrize("content", [b"", b"0\n", b"<svg></svg>", b'{"a": 0}', b"0 SECTION", b"\xff\x00" * 50])
def test_other_files_are_no_drawing(tmp_path, content):
    (tmp_path / "other.dxf").write_bytes(content)
    assert not Dxf().sniff(tmp_path / "other.dxf")
    assert not Dxf().sniff(tmp_path / "absent.dxf")
    assert not Dxf().sniff(tmp_path)


def test_the_units_of_these_tests_are_those_of_the_format():
    assert [decode(code) for code, _ in UNITS.values()] == list(UNITS)
    assert np.isfinite([size for _, size in UNITS.values()]).all()
    assert shapely.Polygon(OUTLINE).area == 60.0
