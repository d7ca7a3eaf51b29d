"""Widths, areas, multilines and meshes as walls: each sheet is a hall of 8 x 5 m with something in it."""

from collections.abc import Callable
from math import pi

import pytest
from ezdxf.render import MeshBuilder

from pipeline.floorplans.readers import dxf_shapes
from pipeline.floorplans.readers.dxf import Dxf
from tests.floorplans.readers.drawing_samples import contains, refusal
from tests.floorplans.readers.dxf_samples import OPENING, UNITS, WALL, Sheet, read

HALL = [(0.0, 0.0), (8.0, 0.0), (8.0, 5.0), (0.0, 5.0)]
FREE_M2 = 7.9 * 4.9  # within walls of 0.1 m


def hall(*unit) -> Sheet:
    return Sheet(*unit).lines(HALL, closed=True, **WALL)


def taken(plan) -> float:
    """How much of the free floor is missing [m2]."""
    return FREE_M2 - plan.free.area


# Widths of polylines
@pytest.mark.parametrize("unit", ["mm", "m", "ft"])
@pytest.mark.parametrize("how", ["const", "each", "R12", "block"])
def test_a_polyline_is_as_wide_as_it_says(tmp_path, unit, how):
    """From (1, 2) to (4, 2), 0.6 m wide."""
    sheet = hall(*UNITS[unit])
    width = 0.6 * sheet.unit
    (x, y), (far, _) = sheet.at([(1, 2), (4, 2)])
    if how == "const":
        sheet.space.add_lwpolyline([(x, y), (far, y)], dxfattribs=WALL | {"const_width": width})
    elif how == "each":
        sheet.space.add_lwpolyline([(x, y, width, width), (far, y)], format="xyse", dxfattribs=WALL)
    elif how == "R12":
        both = {"default_start_width": width, "default_end_width": width}
        sheet.space.add_polyline2d([(x, y), (far, y)], dxfattribs=WALL | both)
    else:
        block = sheet.document.blocks.new("thick")
        block.add_lwpolyline([(0, 0), (10, 0)], dxfattribs={"const_width": 2.0})
        scale = {"xscale": 0.3 * sheet.unit, "yscale": 0.3 * sheet.unit}
        sheet.space.add_blockref("thick", (x, y), dxfattribs=WALL | scale)
    plan = read(sheet.save(tmp_path))
    assert (
        contains(plan, [(2, 2.28), (2, 1.72), (2, 2.32), (2, 1.68), (0.98, 2), (4.02, 2)]) == [False] * 2 + [True] * 4
    )
    assert taken(plan) == pytest.approx(3 * 0.6, abs=1e-6)


def test_a_polyline_may_grow_from_its_start_to_its_end(tmp_path):
    """A wedge: 0.2 m wide at x = 1, 1.0 m at x = 5, then a line of a pen to x = 7."""
    sheet = hall()
    points = [(1, 2, 0.2, 1.0), (5, 2, 0.0, 0.0), (7, 2, 0.0, 0.0)]
    sheet.space.add_lwpolyline(points, format="xyse", dxfattribs=WALL)
    plan = read(sheet.save(tmp_path))
    assert contains(plan, [(1.5, 2.2), (4.5, 2.4), (4.5, 2.5), (6, 2.04), (6, 2.07)]) == [
        True,
        False,
        True,
        False,
        True,
    ]
    assert taken(plan) == pytest.approx(4 * (0.2 + 1.0) / 2 + 2.05 * 0.1, abs=0.02)


def test_the_corners_of_a_wide_polyline_are_mitred(tmp_path):
    sheet = Sheet()
    sheet.space.add_lwpolyline(HALL, close=True, dxfattribs=WALL | {"const_width": 0.8})
    plan = read(sheet.save(tmp_path))
    assert plan.bounds == pytest.approx((-0.4, -0.4, 8.4, 5.4))
    assert plan.free.area == pytest.approx((8 - 0.8) * (5 - 0.8))


def test_a_wide_arc_is_a_ring(tmp_path):
    """Half a ring of radius 1 m about (4, 2), 0.4 m wide."""
    sheet = hall()
    sheet.space.add_lwpolyline([(5, 2, 1.0), (3, 2, 0.0)], format="xyb", dxfattribs=WALL | {"const_width": 0.4})
    plan = read(sheet.save(tmp_path))
    assert contains(plan, [(4, 3.15), (4, 2.85), (4, 3.25), (4, 2.75), (4, 1)]) == [False, False, True, True, True]
    assert taken(plan) == pytest.approx(pi * (1.2**2 - 0.8**2) / 2, rel=0.02)


def test_a_pen_is_no_width(tmp_path):
    sheet = hall(*UNITS["mm"])
    sheet.space.add_lwpolyline([(1000, 2000), (4000, 2000)], dxfattribs=WALL | {"const_width": 0.35})
    assert taken(read(sheet.save(tmp_path))) == pytest.approx(3.1 * 0.1, abs=1e-6)


# Areas
def solid(sheet: Sheet) -> None:
    sheet.space.add_solid([(2, 1), (5, 1), (2, 3), (5, 3)], dxfattribs=WALL)  # its third corner is opposite


def trace(sheet: Sheet) -> None:
    sheet.space.add_trace([(2, 1), (5, 1), (2, 3), (5, 3)], dxfattribs=WALL)


def face(sheet: Sheet) -> None:
    sheet.space.add_3dface([(2, 1, 7), (5, 1, 7), (5, 3, 7), (2, 3, 7)], dxfattribs=WALL)


def hatch(sheet: Sheet) -> None:
    area = sheet.space.add_hatch(dxfattribs=WALL)
    area.paths.add_polyline_path([(2, 1), (5, 1), (5, 3), (2, 3)], is_closed=True)


def pattern_of_edges(sheet: Sheet) -> None:
    area = sheet.space.add_hatch(dxfattribs=WALL)
    area.set_pattern_fill("ANSI31")
    edges = area.paths.add_edge_path()
    corners = [(2, 1), (5, 1), (5, 3), (2, 3)]
    for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
        edges.add_line(start, end)


def mpolygon(sheet: Sheet) -> None:
    area = sheet.space.add_mpolygon(dxfattribs=WALL)
    area.paths.add_polyline_path([(2, 1), (5, 1), (5, 3), (2, 3)], is_closed=True)


def mesh_of(faces) -> MeshBuilder:
    mesh = MeshBuilder()
    for corners in faces:
        mesh.add_face(corners)
    return mesh


def mesh(sheet: Sheet) -> None:
    faces = [[(2, 1, 0), (5, 1, 0), (5, 3, 0), (2, 3, 0)], [(2, 1, 0), (5, 1, 0), (5, 1, 3), (2, 1, 3)]]
    mesh_of(faces).render_polyface(sheet.space, dxfattribs=WALL)


def mirrored_solid(sheet: Sheet) -> None:
    corners = [(-2, 1), (-5, 1), (-2, 3), (-5, 3)]
    sheet.space.add_solid(corners, dxfattribs=WALL | {"extrusion": (0, 0, -1)})


def stretched_solid(sheet: Sheet) -> None:
    sheet.document.blocks.new("one").add_solid([(0, 0), (1, 0), (0, 1), (1, 1)])
    sheet.space.add_blockref("one", (2, 1), dxfattribs=WALL | {"xscale": 3, "yscale": 2})


def multiline(sheet: Sheet) -> None:
    line = sheet.space.add_mline([(2, 2), (5, 2)], dxfattribs=WALL)
    line.set_scale_factor(2.0)
    line.set_justification(1)


AREAS: list[Callable[[Sheet], None]] = [
    *(solid, trace, face, hatch, pattern_of_edges, mpolygon, mesh, mirrored_solid, stretched_solid, multiline)
]


@pytest.mark.parametrize("draw", AREAS)
def test_areas_are_walls(tmp_path, draw):
    """Each is a block of 3 x 2 m at (2, 1)."""
    sheet = hall()
    draw(sheet)
    plan = read(sheet.save(tmp_path))
    assert contains(plan, [(2.05, 1.05), (4.95, 2.95), (3.5, 2), (1.9, 2), (5.1, 2)]) == [False] * 3 + [True] * 2
    assert taken(plan) == pytest.approx(6.0, abs=0.25 if draw is mesh else 1e-6)  # its upright face is a line
    assert plan.remarks == ("layers taken: walls from A-WALL; doors from none",)


def test_upright_faces_are_lines_seen_from_above(tmp_path):
    sheet = hall()
    sheet.space.add_3dface([(2, 1, 0), (2, 1, 3), (5, 4, 3), (5, 4, 0)], dxfattribs=WALL)
    plan = read(sheet.save(tmp_path))
    assert contains(plan, [(3, 2), (4, 3), (4, 2)]) == [False, False, True]


def test_triangles_are_areas(tmp_path):
    sheet = hall()
    sheet.space.add_solid([(2, 1), (5, 1), (2, 3)], dxfattribs=WALL)
    assert taken(read(sheet.save(tmp_path))) == pytest.approx(3.0, abs=1e-6)


@pytest.mark.parametrize(("style", "area"), [(0, 24 - 8 + 2), (1, 24 - 8), (2, 24)])
def test_islands_of_a_hatch_follow_its_style(tmp_path, style, area):
    """A block of 6 x 4 m with a hole of 4 x 2 m, in which stands one of 2 x 1 m; the hole is given first."""
    sheet = hall()
    fill = sheet.space.add_hatch(dxfattribs=WALL | {"hatch_style": style})
    boxes = [(2, 1.5, 4, 2, 16), (1, 0.5, 6, 4, 1), (3, 2, 2, 1, 0)]
    for x, y, wide, high, flags in boxes:
        corners = [(x, y), (x + wide, y), (x + wide, y + high), (x, y + high)]
        fill.paths.add_polyline_path(corners, is_closed=True, flags=flags)
    plan = read(sheet.save(tmp_path))
    assert contains(plan, [(2.5, 1.7), (3.5, 2.5), (1.5, 1)]) == [style != 2, style == 1, False]
    assert taken(plan) == pytest.approx(area, abs=1e-6)


# Multilines
def test_a_multiline_is_as_wide_as_its_outer_lines(tmp_path):
    """An angle from (2, 0) up to (2, 3) and on to (6, 3), drawn by its upper left line, 0.5 m wide."""
    sheet = hall()
    line = sheet.space.add_mline([(2, 0), (2, 3), (6, 3)], dxfattribs=WALL)
    line.set_scale_factor(0.5)
    line.set_justification(0)
    plan = read(sheet.save(tmp_path))
    right = contains(plan, [(2.25, 2), (4, 2.75)])
    left = contains(plan, [(1.75, 2), (4, 3.25)])
    assert sorted([right, left]) == [[False, False], [True, True]]
    assert taken(plan) == pytest.approx(0.5 * (3 + 4) + (0.25 if right[0] else -0.25) - 0.5 * 0.05, abs=1e-6)


def test_a_closed_multiline_goes_around(tmp_path):
    sheet = Sheet()
    line = sheet.space.add_mline(HALL, close=True, dxfattribs=WALL)
    line.set_scale_factor(0.4)
    line.set_justification(1)
    plan = read(sheet.save(tmp_path))
    assert plan.bounds == pytest.approx((-0.2, -0.2, 8.2, 5.2))
    assert plan.free.area == pytest.approx(7.6 * 4.6)


def test_a_multiline_is_open_where_it_was_cut(tmp_path):
    """A partition along x = 3, cut from 1.5 m to 2.75 m of its length."""
    sheet = hall()
    line = sheet.space.add_mline([(3, 0), (3, 5)], dxfattribs=WALL)
    line.set_scale_factor(0.2)
    for vertex in line.vertices:
        vertex.line_params = [(offsets[0], 0.0, 1.5, 2.75) for offsets in vertex.line_params]
    plan = read(sheet.save(tmp_path))
    assert contains(plan, [(3, 1.4), (3, 1.6), (3, 2.7), (3, 2.8), (3, 4.9)]) == [False, True, True, False, False]


def test_a_multiline_cut_on_one_side_is_closed(tmp_path):
    sheet = hall()
    line = sheet.space.add_mline([(3, 0), (3, 5)], dxfattribs=WALL)
    line.set_scale_factor(0.2)
    for vertex in line.vertices:
        vertex.line_params[0] = (vertex.line_params[0][0], 0.0, 1.5, 2.75)
    assert contains(read(sheet.save(tmp_path)), [(3, 2), (3, 4)]) == [False, False]


# What is not read
def test_kinds_that_are_not_read_are_named_with_their_layer(tmp_path):
    sheet = hall()
    sheet.space.add_xline((0, 0), (1, 0), dxfattribs=WALL)
    for x in (1, 2):
        mesh_of([[(x, 1, 0), (x + 1, 1, 0), (x, 2, 0)]]).render_mesh(sheet.space, dxfattribs={"layer": "I-WALL"})
    sheet.space.add_text("D1", dxfattribs=OPENING)
    plan = read(sheet.save(tmp_path))
    assert plan.remarks[1:] == (
        "layer I-WALL holds 2 MESH, which are not read",
        "layer A-WALL holds 1 XLINE, which is not read",
        "layer A-DOOR holds 1 TEXT, which is not read",
    )


def test_a_drawing_of_kinds_that_are_not_read_is_refused_with_them(tmp_path):
    sheet = Sheet()
    sheet.space.add_ray((0, 0), (1, 0), dxfattribs=WALL)
    text = refusal(Dxf(), sheet.save(tmp_path))
    assert "Layer A-WALL holds 1 RAY, which is not read." in text


def test_a_hatch_of_far_too_many_rings_is_damaged(tmp_path, monkeypatch):
    monkeypatch.setattr(dxf_shapes, "_MOST_RINGS", 2)
    sheet = hall()
    fill = sheet.space.add_hatch(dxfattribs=WALL)
    for x in (1, 2, 3):
        fill.paths.add_polyline_path([(x, 1), (x + 0.5, 1), (x, 2)], is_closed=True)
    assert "layer A-WALL holds 1 HATCH, which is damaged" in read(sheet.save(tmp_path)).remarks
