import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, Polygon

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan
from pipeline.floorplans.readers import READERS, read_plan_file, svg_tree
from pipeline.floorplans.readers import svg as svg_module
from pipeline.floorplans.readers.svg import Svg
from pipeline.floorplans.sources import open_source
from tests.floorplans.readers.drawing_samples import (
    DOOR,
    HALL,
    OUTLINE,
    PARTITION,
    STUDY,
    check_house,
    contains,
    read_all,
    read_one,
    refusal,
)

SCALE = 0.02  # metres per unit of these drawings
HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
SOLID_WALLS = Polygon(OUTLINE).buffer(0.05, join_style="mitre").difference(Polygon(OUTLINE).buffer(-0.05))
SOLID_PARTITION = LineString(PARTITION).buffer(0.05, cap_style="flat")
DOOR_PATCH = LineString(DOOR).buffer(0.06, cap_style="flat")


def points(corners) -> str:
    """Corners [m], y up, as the attribute of a drawing whose y points down."""
    return " ".join(f"{x / SCALE:.6g},{-y / SCALE:.6g}" for x, y in corners)


def polygon(corners, **attributes) -> str:
    said = "".join(f' {key.rstrip("_")}="{text}"' for key, text in attributes.items())
    return f'<polygon points="{points(corners)}"{said}/>'


def path(area: Polygon, **attributes) -> str:
    said = "".join(f' {key.rstrip("_")}="{text}"' for key, text in attributes.items())
    rings = [area.exterior, *area.interiors]
    return f'<path d="{" ".join(f"M {points(ring.coords[:-1])} Z" for ring in rings)}"{said}/>'


def group(name: str, *inner: str, **attributes) -> str:
    said = "".join(f' {key.rstrip("_")}="{text}"' for key, text in attributes.items())
    return f'<g class="{name}"{said}>{"".join(inner)}</g>'


def wall(*inner: str) -> str:
    return group("Wall External", path(SOLID_WALLS)) + group("Wall", path(SOLID_PARTITION), *inner)


def door() -> str:
    """As CubiCasa draws a door: its patch, its threshold, and its leaf with the swing."""
    corners = DOOR_PATCH.exterior.coords[:-1]
    swing = f'<path d="M {points([DOOR[1]])} q 0,-45 -45,-45 l 0,45 Z"/>'
    panel = group("Panel Left Positive", group("PanelArea", polygon(STUDY)), swing, id="Panel", fill="none")
    threshold = f'<g id="Threshold">{polygon(corners)}</g>'
    return group("Door Swing Beside", polygon(corners), threshold, panel, id="Door")


def write(tmp_path: Path, *inner: str, name: str = "model.svg", head: str = "", root: str = "") -> Path:
    file = tmp_path / name
    file.write_text(f"{head}{HEAD}{root}>{''.join(inner)}</svg>")
    return file


def read(file: Path, **options) -> FloorPlan:
    return read_one(Svg(), file, **({"metres_per_unit": SCALE} | options))


def test_a_house_is_scaled_and_turned_over_not_mirrored(tmp_path):
    plan = read(write(tmp_path, wall(door()), root=' width="500" height="450" viewBox="0 -450 500 450"'))
    check_house(plan)
    assert (plan.plan_id, plan.building, plan.environment, plan.source) == ("model", "model", "svg_plans", "model.svg")
    assert plan.remarks == ()


@pytest.mark.parametrize("box", ["0 0 10 10", "-500 -500 1000 1000", "0 0 500 450"])
def test_the_scale_is_of_user_units_whatever_the_view_box(tmp_path, box):
    check_house(read(write(tmp_path, wall(door()), root=f' width="2mm" viewBox="{box}"')))


def test_rooms_keep_their_types_as_labels(tmp_path):
    dimensions = group("SpaceDimensionsLabel", "<text>OH</text>", polygon([(0, 0), (1, 0), (1, 1)]))
    rooms = group("Space LivingRoom", polygon(HALL), dimensions, id="853e2235-4100-46f2-90a0-8a3af729de74")
    rooms += group("Space Draught Lobby ", polygon(STUDY), id="Study")
    rooms += group("Space Outdoor Terrace", polygon([(4, 4), (10, 4), (10, 9), (4, 9)]))
    plan = read(write(tmp_path, rooms, wall(door())))
    check_house(plan)
    assert [(room.label, round(room.outline.area, 3)) for room in plan.rooms] == [
        ("LivingRoom", 40.0),
        ("Draught Lobby", 20.0),
    ]


def test_windows_and_railings_are_walls(tmp_path):
    window = group("Window Regular", polygon([(2, -0.05), (3, -0.05), (3, 0.05), (2, 0.05)]), id="Window")
    railing = group("Railing", polygon([(6, 0), (6.1, 0), (6.1, 4), (6, 4)]))
    plan = read(write(tmp_path, group("Wall", window), wall(door()), railing))
    assert contains(plan, [(2.5, 0.0), (6.05, 2.0), (5.5, 2.0), (6.5, 2.0)]) == [False, False, True, True]


def test_hollow_walls_and_lines_without_fill_are_walls_of_the_asked_thickness(tmp_path):
    outline = polygon(OUTLINE, class_="wall", fill="none")
    faces = polygon([(0, 3.9), (4, 3.9), (4, 4.1), (0, 4.1)], class_="wall", style="stroke:red; fill : none")
    patch = LineString(DOOR).buffer(0.15, cap_style="flat")
    plan = read(write(tmp_path, outline, faces, path(patch, class_="door")), wall_m=0.05)
    check_house(plan)
    assert plan.free.area == pytest.approx(60 - 0.025 * 38 - 3.95 * 0.25 + 0.9 * 0.25, abs=0.05)


@pytest.mark.parametrize("sheet", [".st0{fill:none;stroke:#000}", ".a,.st0 { stroke: red; fill: none }"])
def test_style_sheets_say_what_has_no_fill(tmp_path, sheet):
    walls = f'<g id="Outer_Walls">{polygon(OUTLINE, class_="st0")}</g>'
    inner = f'<g id="Walls"><polyline class="st0" points="{points(PARTITION)}"/></g>'
    file = write(tmp_path, f'<style type="text/css">{sheet}</style>', walls, inner, path(DOOR_PATCH, id="door_1"))
    check_house(read(file))


def test_lines_polylines_rectangles_and_circles_are_drawn(tmp_path):
    (x0, y0), (x1, y1) = PARTITION
    line = f'<line x1="{x0 / SCALE}" y1="{-y0 / SCALE}" x2="{x1 / SCALE}" y2="{-y1 / SCALE}"/>'
    ring = f'<polyline points="{points([*OUTLINE, OUTLINE[0]])}"/>'
    pillar = f'<circle cx="{7 / SCALE}" cy="{-2 / SCALE}" r="{0.3 / SCALE}"/>'
    oval = f'<ellipse cx="{9 / SCALE}" cy="{-2 / SCALE}" rx="{0.2 / SCALE}" ry="{0.4 / SCALE}"/>'
    block = f'<rect x="{5 / SCALE}" y="{-3 / SCALE}" width="{0.5 / SCALE}" height="{2 / SCALE}"/>'
    plan = read(write(tmp_path, group("walls", ring, line, pillar, oval, block), group("doors", path(DOOR_PATCH))))
    check_house(plan)
    inside = [(7, 2), (9, 2.3), (5.25, 1.1), (5.25, 2.9)]
    assert contains(plan, [*inside, (6.5, 2), (9.3, 2), (5.25, 0.8)]) == [False] * 4 + [True] * 3


def test_transforms_are_applied_from_the_inside_out(tmp_path):
    """The drawing is turned by a quarter, shrunk and moved; its groups undo that, the outermost one last."""
    inner = group("", wall(door()), transform="rotate(90)")
    outer = group("", group("", inner, transform="translate(30 70) scale(2)"), transform="scale(0.5)")
    back = group("", group("", outer, transform="translate(-15,-35)"), transform="rotate(-90)")
    check_house(read(write(tmp_path, back)))


def test_a_transform_of_a_shape_counts_once(tmp_path):
    shapes = wall(door()).replace("<path", '<path transform="matrix(0.5 0 0 0.5 7 9)"')
    shapes = shapes.replace("<polygon", '<polygon transform="matrix(0.5 0 0 0.5 7 9)"')
    check_house(read(write(tmp_path, group("", shapes, transform="translate(-14 -18) scale(2)"))))


def test_layers_of_editors_name_walls_and_doors(tmp_path):
    walls = f'<g inkscape:label="Walls" id="layer1"><g id="g12">{path(SOLID_WALLS)}{path(SOLID_PARTITION)}</g></g>'
    doors = f'<g inkscape:label="Doors" id="layer2"><g id="g13">{path(DOOR_PATCH, id="path77")}</g></g>'
    check_house(read(write(tmp_path, walls, doors)))


def test_classes_that_a_person_names_are_taken_alone(tmp_path):
    solid = group("mauer", path(SOLID_WALLS), path(SOLID_PARTITION))
    extra = group("wall", polygon([(5, 1), (9, 1), (9, 3), (5, 3)]))
    file = write(tmp_path, solid, extra, group("Loch-1", path(DOOR_PATCH)))
    plan = read(file, wall_layers=("mau*",), door_layers=("loch*",))
    check_house(plan)
    assert contains(plan, [(7, 2)]) == [True]
    assert "no shape of a class wand or Space. Name the classes of the walls" in refusal(
        Svg(), file, wall_layers=("wand",), metres_per_unit=SCALE
    )


def test_what_is_not_shown_is_not_read(tmp_path):
    block = polygon([(5, 1), (9, 1), (9, 3), (5, 3)])
    hidden = group("Wall", block, display="none") + group("Wall", block, style="color:red;display : none")
    defined = f"<defs>{group('Wall', block)}</defs><clipPath>{group('Wall', block)}</clipPath>"
    furniture = group("FixedFurniture Toilet", group("BoundaryPolygon", block)) + "<!-- a remark --><?pi?>"
    plan = read(write(tmp_path, wall(door()), hidden, defined, furniture))
    check_house(plan)
    assert contains(plan, [(7, 2)]) == [True]


def test_floors_are_plans_of_their_own_even_when_hidden(tmp_path):
    first = group("Floorplan Floor-1", group("Floor", wall(door())))
    second = group("Floorplan Floor-2", wall(), style="display: none;")
    third = group("Floorplan", wall(door()), id="attic")
    file = write(tmp_path, group("Model v1-1", group("Floor", first), group("Floor", second, third)))
    plans = read_all(Svg(), file, metres_per_unit=SCALE)
    assert [plan.plan_id for plan in plans] == ["model.Floor-1", "model.Floor-2", "model.attic"]
    assert {plan.building for plan in plans} == {"model"}
    for plan, width in zip(plans, (0.9, None, 0.9), strict=True):
        check_house(plan, width=width)
    for level in ("2", "Floor-2"):
        (plan,) = read_all(Svg(), file, metres_per_unit=SCALE, levels=(level,))
        assert plan.plan_id == "model.Floor-2"


def test_copies_and_damaged_shapes_are_counted_in_remarks(tmp_path):
    bad = [
        '<path d="M 0 0 L"/>',
        '<polygon points="1,1 1,1"/>',
        '<rect x="0" y="0" width="1e12" height="1"/>',
        '<circle cx="x" cy="y" r="z"/>',
        '<polygon points="0,0 9,9 9,0" transform="scale(zwei)"/>',
    ]
    uses = '<use href="#a"/>' * 2
    plan = read(write(tmp_path, wall(door()), group("Wall", *bad), uses))
    check_house(plan)
    assert plan.remarks == ("2 <use>s left out: nothing in this file to copy", "5 shapes left out: could not be read")


def test_an_outline_that_crosses_itself_is_repaired_and_said(tmp_path):
    eight = polygon([(5, 1), (7, 3), (7, 1), (5, 3)])
    plan = read(write(tmp_path, wall(door()), group("Wall", eight)))
    assert plan.free.is_valid
    assert contains(plan, [(5.3, 2), (6.7, 2), (6, 1.3), (6, 2.7)]) == [False, False, True, True]
    assert plan.remarks == ("1 outline crossed itself and was repaired",)


def test_a_facade_with_gaps_is_closed(tmp_path):
    line = f'<polyline class="wall" fill="none" points="{points([(2, 0), *OUTLINE[1:], (0, 0), (0.5, 0)])}"/>'
    check_house(read(write(tmp_path, line, group("Wall", path(SOLID_PARTITION), door()))))


def test_a_house_without_its_door_is_sealed(tmp_path):
    check_house(read(write(tmp_path, wall())), width=None)


# The scale
def test_without_a_scale_the_file_is_refused_and_its_doors_propose_one(tmp_path):
    text = refusal(Svg(), write(tmp_path, wall(door())))
    assert "the file does not say how many metres a unit of it has. Set plans.read.metres_per_unit." in text
    assert "Its doors are 45 units wide: 0.9 m at 0.02." in text


def test_an_unlikely_scale_is_said(tmp_path):
    plan = read(write(tmp_path, wall(door())), metres_per_unit=0.002)
    assert plan.remarks == ("half of its doors are 0.09 m wide or less: check the scale",)


# What is refused
ENTITIES = '<!DOCTYPE svg [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'
BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (Path.unlink, "not whole XML"),
    "empty": (lambda file: file.write_bytes(b""), "not whole XML"),
    "truncated": (lambda file: file.write_bytes(file.read_bytes()[:-40]), "not whole XML"),
    "bytes": (lambda file: file.write_bytes(bytes(range(256))), "not whole XML"),
    "strange encoding": (
        lambda file: file.write_text(f'<?xml version="1.0" encoding="latin-99"?>{HEAD}/>'),
        "not whole XML",
    ),
    "entities": (lambda file: file.write_text(f"{ENTITIES}{HEAD}>&b;</svg>"), "declares XML entities"),
    "no classes": (lambda file: write(file.parent, polygon(OUTLINE)), "no shape of a class wall, walls or Space"),
    "only doors": (lambda file: write(file.parent, door()), "no shape of a class wall, walls or Space"),
    "deep": (lambda file: write(file.parent, "<g>" * 200 + "</g>" * 200), "more than 300,000 elements or 100 groups"),
    "a wall far away": (
        lambda file: write(file.parent, group("Wall", '<rect x="1e11" y="0" width="5" height="5"/>')),
        "no shape of a class",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_gives_one_clear_error(tmp_path, case):
    damage, message = BAD[case]
    file = write(tmp_path, wall(door()))
    damage(file)
    assert message in refusal(Svg(), file, metres_per_unit=SCALE)


def test_too_large_a_drawing_is_refused(tmp_path, monkeypatch):
    file = write(tmp_path, wall(door()))
    monkeypatch.setattr(svg_tree, "_MOST_ELEMENTS", 5)
    assert "more than 5 elements or 100 groups in each other." in refusal(Svg(), file)
    monkeypatch.setattr(svg_module, "_MOST_BYTES", 100)
    assert "more than 100 bytes, at most that many are read. Simplify it." in refusal(Svg(), file)


def test_one_bad_floor_does_not_cost_the_others(tmp_path):
    lines = "".join(f'<line x1="0" y1="{k}" x2="5000" y2="{5000 - k}"/>' for k in range(1100))
    file = write(tmp_path, group("Floorplan Floor-1", group("wall", lines)), group("Floorplan Floor-2", wall(door())))
    bad, good = read_all(Svg(), file, metres_per_unit=SCALE)
    assert isinstance(bad, PlanError)
    assert "(model.Floor-1): lines meet more than" in str(bad)
    check_house(good)


def test_a_scribble_refuses_its_floor_alone(tmp_path):
    scribble = np.random.default_rng(0).uniform(0, 20, (2000, 2))
    walls = group("Wall", polygon(scribble), polygon(OUTLINE))
    file = write(tmp_path, group("Floorplan Floor-1", walls), group("Floorplan Floor-2", wall(door())))
    bad, good = read_all(Svg(), file, metres_per_unit=SCALE)
    assert str(bad).startswith(f"{file} (model.Floor-1): lines meet more than")
    check_house(good)


HEADS = ["", '<?xml version="1.0"?>\n<!-- by hand <svg> -->', '<!DOCTYPE svg PUBLIC "a" "b.dtd">', "<!DOCTYPE svg []>"]


@pytest.mark.parametrize("head", HEADS)
def test_a_drawing_is_known_by_its_root(tmp_path, head):
    file = write(tmp_path, wall(door()), head=head, name="drawing.xml")
    assert [name for name, reader in READERS.items() if reader.sniff(file)] == ["svg"]
    assert not Svg().accompanies(file)
    check_house(read(file))


def test_a_prefixed_name_space_is_read(tmp_path):
    text = (
        write(tmp_path, wall(door()))
        .read_text()
        .replace("<", "<s:")
        .replace("<s:/", "</s:")
        .replace("xmlns=", "xmlns:s=")
    )
    (tmp_path / "other.svg").write_text(text)
    assert Svg().sniff(tmp_path / "other.svg")
    check_house(read(tmp_path / "other.svg"))


def test_packed_drawings_are_read(tmp_path):
    packed = tmp_path / "home.svgz"
    packed.write_bytes(gzip.compress(write(tmp_path, wall(door())).read_bytes()))
    with open_source(packed) as files:
        check_house(read(files[0].path))


OTHERS = [
    "",
    "<html><body><svg></svg></body></html>",
    '{"text": "<svg>"}',
    "<svgish/>",
    "<!-- <svg> -->",
    "<building/>",
]


@pytest.mark.parametrize("content", [*OTHERS, "<!--" * 1000, "<?" * 2000, "<!DOCTYPE [" * 300])
def test_other_files_are_no_drawing(tmp_path, content):
    (tmp_path / "other.svg").write_text(content)
    assert not Svg().sniff(tmp_path / "other.svg")
    assert not Svg().sniff(tmp_path / "absent.svg")
    assert not Svg().sniff(tmp_path)


def test_an_unrecognised_drawing_says_what_was_expected(tmp_path):
    (tmp_path / "other.svg").write_text("<html/>")
    with pytest.raises(PlanError, match=r"other.svg: a web page \(HTML\), which is not read"):
        read_plan_file(tmp_path / "other.svg")


def test_the_samples_are_the_house():
    solid = shapely.union_all([SOLID_WALLS, SOLID_PARTITION])
    assert np.allclose(solid.bounds, (-0.05, -0.05, 10.05, 9.05))
