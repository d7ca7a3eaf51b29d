"""How shapes look: what is hidden or unpainted, which selectors meet, how wide strokes are."""

import time
from xml.etree import ElementTree

import pytest
import shapely

from pipeline.errors import PlanError
from pipeline.floorplans.readers import svg_style
from pipeline.floorplans.readers.svg import Svg
from pipeline.floorplans.readers.svg_style import Styles
from tests.floorplans.readers.drawing_samples import refusal
from tests.floorplans.readers.svg_samples import HALL, HIDDEN, check_walls, read_svg, walls_in, write_svg

BAR = '<rect class="wall b" id="bar" x="100" y="50" width="20" height="300"{}/>'
POST = '<rect class="wall" x="500" y="400" width="30" height="60"/>'
POST_BOX = (5.0, 4.0, 5.3, 4.6)
BAR_BOX = (1.0, 0.5, 1.2, 3.5)


# Hidden
@pytest.mark.parametrize(
    "off",
    [
        "display:none",
        "visibility:hidden",
        "visibility:collapse",
        "opacity:0",
        "opacity: 0%",
        "DISPLAY : None",
        "opacity:-1",
    ],
)
@pytest.mark.parametrize("place", ["style of the shape", "style of a group", "class", "attribute"])
def test_what_is_switched_off_is_passed_over_and_counted(tmp_path, off, place):
    key, value = (part.strip().lower() for part in off.split(":"))
    inner = {
        "style of the shape": BAR.format(f' style="{off}"'),
        "style of a group": f'<g style="{off}"><g>{BAR.format("")}</g></g>',
        "class": f'<style>.off{{{off}}}</style><g class="x off">{BAR.format("")}</g>',
        "attribute": f'<g {key}="{value}">{BAR.format("")}</g>',
    }[place]
    plan = read_svg(tmp_path, HALL + inner + POST)
    check_walls(plan, POST_BOX)
    assert plan.remarks == (HIDDEN.format("1 shape"),)


def test_a_visible_shape_in_a_hidden_group_is_drawn_but_none_in_one_without_display(tmp_path):
    for off, boxes in (('visibility="hidden"', [POST_BOX]), ('display="none"', []), ('opacity="0"', [])):
        shown = POST.replace("/>", ' visibility="visible" display="inline" opacity="1"/>')
        plan = read_svg(tmp_path, f"{HALL}<g {off}>{BAR.format('')}{shown}</g>")
        check_walls(plan, *boxes)
        assert plan.remarks == (HIDDEN.format("1 shape" if boxes else "2 shapes"),)


def test_a_floor_that_is_not_shown_is_read_unless_all_of_the_drawing_is_hidden(tmp_path):
    floor = f'<g class="Floorplan Floor-1" style="visibility:hidden" display="none" opacity="0">{HALL}{POST}</g>'
    check_walls(read_svg(tmp_path, floor), POST_BOX)
    file = write_svg(tmp_path, f'<g display="none">{floor}</g>')
    assert "2 are hidden" in refusal(Svg(), file, metres_per_unit=0.01)


def test_hidden_doors_and_rooms_are_counted_and_furniture_is_not(tmp_path):
    parts = '<rect class="door" width="9" height="9"/><g class="Space Hall"><rect width="50" height="50"/></g>'
    plan = read_svg(tmp_path, f'{HALL}<g display="none">{parts}<rect width="9" height="9"/></g>')
    assert plan.remarks == (HIDDEN.format("2 shapes"),)
    assert (plan.doors, plan.rooms) == ((), ())


def test_a_drawing_whose_walls_are_all_hidden_says_so(tmp_path):
    file = write_svg(tmp_path, f'<g visibility="hidden">{HALL}{POST}</g>')
    assert "no shape of a class wall, walls or Space is shown; 2 are hidden." in refusal(
        Svg(), file, metres_per_unit=0.01
    )


def test_half_transparent_walls_are_walls(tmp_path):
    plan = read_svg(tmp_path, HALL + BAR.format(' opacity="0.2" fill-opacity="30%" fill="#00000010"'))
    check_walls(plan, BAR_BOX)
    assert plan.remarks == ()


# Paint. The ring is 20 to 24 cm wide when it is a line of wall_m = 0.04, and an area when it is filled.
RING = '<path class="wall" id="ring" d="M300 100H500V300H300Z"/>'
UNFILLED = [
    ("", 'fill="none"'),
    ("", 'style="fill:none"'),
    ("", 'fill="transparent"'),
    ("", 'fill="rgba(20, 30, 40, 0)"'),
    ("", 'fill="#fff0"'),
    ("", 'style="fill:#123;fill-opacity:0"'),
    ("", 'fill-opacity="0"'),
    ("", 'fill="currentColor" color="transparent"'),
    ("#walls path{fill:none}", 'id="walls"'),
    ("svg g > path { fill : none }", ""),
    (".lines *{fill:none;stroke:#000}", 'class="lines"'),
    ("path{fill:none !important}", 'fill="red"'),
    ("g path[id^=ri]:not(.solid){fill:hsla(1,2%,3%,0)}", ""),
    ("path{fill:none} #ring{color:red}", ""),
    ("@media screen{path{fill:none}} @media print{path{fill:red}}", ""),
    ("/* walls */ .a, path, .b{fill:none} path::before{fill:red} path:hover{fill:red}", ""),
]
FILLED = [
    ("", ""),
    ("", 'fill="red"'),
    ("", 'fill="url(#hatch) none" style="fill:#eee"'),
    ("path{fill:none} #ring{fill:red}", ""),
    ("#ring{fill:red} path{fill:none}", ""),
    ("path{fill:none} path.wall{fill:blue}", ""),
    ("path{fill:none} path{fill:blue}", ""),
    ("g g path{fill:none}", ""),
    ("rect ~ path{fill:none}", ""),
    ("path{fill:none;fill:initial}", 'fill="none"'),
    ("@media print{path{fill:none}}", ""),
]


@pytest.mark.parametrize(("sheet", "attributes"), UNFILLED)
def test_what_has_no_fill_is_a_line(tmp_path, sheet, attributes):
    sheet = sheet.replace(">", "&gt;")
    plan = read_svg(tmp_path, f"<style>{sheet}</style>{HALL_FILLED}<g {attributes}>{RING}</g>", wall_m=0.04)
    assert walls_in(plan).area == pytest.approx(4 * 2 * 0.04, abs=1e-6)
    assert plan.remarks == ()


@pytest.mark.parametrize(("sheet", "attributes"), FILLED)
def test_what_has_a_fill_is_an_area(tmp_path, sheet, attributes):
    plan = read_svg(tmp_path, f"<style>{sheet}</style>{HALL_FILLED}<g {attributes}>{RING}</g>", wall_m=0.04)
    assert walls_in(plan).area == pytest.approx(4.0, abs=1e-6)


HALL_FILLED = HALL.replace("<path", '<path style="fill:black !important"')


def test_the_strongest_rule_wins(tmp_path):
    """By !important, style, id, class, name, and the place in the sheet."""
    sheet = """
        rect{fill:none;x:0} .wall{width:30px} #bar{width:50px} rect.wall.b{width:70px}
        .b{y:100px} .wall{y:200px}
        #bar{height:40px !important}
    """
    bar = BAR.format(' style="height:10px"')
    check_walls(read_svg(tmp_path, f"<style>{sheet}</style>{HALL}<g>{bar}</g>", wall_m=0.1), (0.2, 1.95, 0.55, 2.45))


def test_sheets_with_a_name_space_and_within_character_data_are_read(tmp_path):
    sheet = "<style><![CDATA[ @font-face{src:url(a)} g > .b{display:none} ]]></style>"
    sheet += "<style media='print'>*{display:none}</style><style type='text/less'>*{display:none}</style>"
    plan = read_svg(tmp_path, f"{sheet}{HALL}<g>{BAR.format('')}</g>{POST}")
    check_walls(plan, POST_BOX)


def test_rules_that_cannot_be_followed_are_counted(tmp_path):
    sheet = (
        "g:has(rect){fill:none} path:wobbly{fill:none} svg|path{fill:none} :not(g path){fill:none} @import 'a.css';"
        "@media (min-width: 9px){path{fill:none}} path:has(a){font:x} .a{fill:none; .b{fill:none}}"
    )
    plan = read_svg(tmp_path, f"<style>{sheet}</style>{HALL}")
    assert plan.remarks == ("7 rules of style sheets not followed",)


@pytest.mark.parametrize(
    ("sheet", "filled"),
    [
        (":root{--inside:none} path{fill:var(--inside)}", False),
        ("g{--inside:none} path{fill:var( --inside , red)}", False),
        ("path{fill:var(--absent, none)}", False),
        ("path{fill:var(--absent, var(--other, rgba(1,2,3,0)))}", False),
        ("svg{--a:var(--b);--b:none} path{fill:var(--a)}", False),
        ("svg{--a:none} g{--a:red} path{fill:var(--a)}", True),
        ("path{fill:none} path{fill:var(--absent)}", True),
        ("svg{--a:var(--a)} path{fill:var(--a)}", True),
        ("g{--A:none} path{fill:var(--a)}", True),
    ],
)
def test_variables_are_put_in(tmp_path, sheet, filled):
    plan = read_svg(tmp_path, f"<style>{sheet}</style>{HALL_FILLED}<g>{RING}</g>", wall_m=0.04)
    assert walls_in(plan).area == pytest.approx(4.0 if filled else 4 * 2 * 0.04, abs=1e-6)


# Strokes
@pytest.mark.parametrize(
    "width",
    [
        '<g stroke-width="40">{}</g>',
        '<g style="stroke-width:40px">{}</g>',
        '<g class="fat">{}</g>',
        '<g stroke-width="3"><g stroke-width="40">{}</g></g>',
        '<g stroke-width="4.850712500726659%">{}</g>',  # of sqrt(1000^2 + 600^2) / sqrt(2) = 824.62
        '<g stroke-width="40" transform="scale(4)"><g transform="scale(.25)">{}</g></g>',
    ],
)
def test_a_line_is_as_wide_as_its_stroke(tmp_path, width):
    line = '<path class="wall" d="M300 100V300"/><line class="wall" x1="600" y1="200" x2="700" y2="200"/>'
    inner = f'<g fill="none" stroke="#000">{width.format(line)}</g>'
    plan = read_svg(tmp_path, f"<style>.fat{{stroke-width:40}}</style>{HALL}{inner}", wall_m=0.07)
    check_walls(plan, (2.8, 1.0, 3.2, 3.0), (6.0, 1.8, 7.0, 2.2))
    assert plan.remarks == ()


def test_a_stroke_is_scaled_with_its_shape_in_each_direction(tmp_path):
    """By scale(4 2): a pen of 5 units is 0.2 m wide across a standing line and 0.1 m across a lying one."""
    lines = '<path class="wall" d="M100 50V100"/><path class="wall" d="M150 150H200" stroke-linecap="square"/>'
    plan = read_svg(tmp_path, f'{HALL}<g stroke-width="5" stroke="red" fill="none" transform="scale(4 2)">{lines}</g>')
    check_walls(plan, (3.9, 1.0, 4.1, 2.0), (5.9, 2.95, 8.1, 3.05))
    fixed = lines.replace("/>", ' vector-effect="non-scaling-stroke"/>')
    plan = read_svg(tmp_path, f'{HALL}<g stroke-width="20" stroke="red" fill="none" transform="scale(2)">{fixed}</g>')
    check_walls(plan, (1.9, 1.0, 2.1, 2.0), (2.9, 2.9, 4.1, 3.1))


def test_corners_and_ends_of_strokes(tmp_path):
    bend = '<polyline class="wall" points="300,100 300,300 500,300" fill="none" stroke="#000" stroke-width="40"{}/>'
    plan = read_svg(tmp_path, HALL + bend.format(""))
    check_walls(plan, (2.8, 1.0, 3.2, 3.2), (2.8, 2.8, 5.0, 3.2))
    area = 0.4 * 2.2 + 0.4 * 1.8
    for more, difference in (
        ('stroke-linejoin="bevel"', -0.02),
        ("stroke-linecap='square'", 0.16),
    ):
        plan = read_svg(tmp_path, HALL + bend.format(" " + more))
        assert walls_in(plan).area == pytest.approx(area + difference, abs=0.002), more


def test_a_filled_wall_is_as_wide_as_its_fill_and_stroke_together(tmp_path):
    bar = BAR.format(' stroke="#000" stroke-width="10" stroke-linejoin="miter"')
    check_walls(read_svg(tmp_path, HALL + bar), (0.95, 0.45, 1.25, 3.55))
    for unseen in (
        'stroke="none" stroke-width="10"',
        'stroke-width="10"',
        'stroke="red" stroke-opacity="0" stroke-width="9"',
    ):
        check_walls(read_svg(tmp_path, HALL + BAR.format(" " + unseen)), BAR_BOX)


def test_the_stroke_of_a_pen_is_no_wall_and_lines_without_width_are_as_thick_as_asked(tmp_path):
    line = '<path class="wall" fill="none" d="M300 100V300"{}/>'
    for more in ("", ' stroke="#000"'):
        plan = read_svg(tmp_path, HALL + line.format(more), wall_m=0.2)
        check_walls(plan, (2.9, 0.9, 3.1, 3.1))
        assert plan.remarks == ()
    plan = read_svg(tmp_path, HALL + line.format(' stroke="#000" stroke-width="2.5"'), wall_m=0.2)
    check_walls(plan, (2.9, 0.9, 3.1, 3.1))
    assert plan.remarks == ("1 line drawn thinner than 0.03 m taken as walls of 0.2 m",)


@pytest.mark.parametrize("stroke", ['stroke="none"', 'stroke-width="0"', 'stroke="transparent"', 'stroke-opacity="0"'])
def test_a_line_that_is_not_painted_is_hidden(tmp_path, stroke):
    lines = (
        f'<g {stroke} class="wall"><path fill="none" d="M300 100V300"/><line x1="400" y1="50" x2="400" y2="90"/></g>'
    )
    plan = read_svg(tmp_path, HALL + lines)
    check_walls(plan)
    assert plan.remarks == (HIDDEN.format("2 shapes"),)


def test_an_open_outline_is_filled_where_it_has_no_stroke(tmp_path):
    outline = '<path class="wall" d="M300 100H400V200H300"{}/>'
    for more in (' fill="#000"', ' stroke="none"', ' fill="#000" stroke-width="0"'):
        check_walls(read_svg(tmp_path, HALL + outline.format(more)), (3.0, 1.0, 4.0, 2.0))
    for more in ("", ' fill="#eee" stroke="#000"'):
        plan = read_svg(tmp_path, HALL + outline.format(more), wall_m=0.1)
        assert walls_in(plan).area == pytest.approx(0.1 * 3.1, abs=1e-3)


def test_doors_and_rooms_are_areas_however_they_are_painted(tmp_path):
    wall = '<rect class="wall" x="490" y="20" width="20" height="560"/>'
    door = '<rect class="door" x="490" y="200" width="20" height="90"/>'
    plan = read_svg(tmp_path, f'{HALL}{wall}<g fill="none" stroke="none" transform="translate(0 50)">{door}</g>')
    assert len(shapely.get_parts(plan.free)) == 1
    (found,) = plan.doors
    assert (found.x, found.y, found.width) == (pytest.approx(5.0), pytest.approx(-2.95), pytest.approx(0.9))


# Sheets made to hurt
def styles_of(text: str) -> Styles:
    return Styles(ElementTree.fromstring(text), "a.svg")


@pytest.mark.parametrize(
    "selector",
    [
        "g " * 40 + "a",
        "g ~ " * 40 + "a",
        "* " * 200 + "a",
        ":not(" * 3000,
        "a" * 100_000,
        "[a*=b]" * 390,
        "a:nth-child(n of g g)",
    ],
)
def test_selectors_made_to_hurt_end_in_time(selector):
    tree = "<g>" * 90 + "<g/>" * 400 + "<path/>" * 400 + "</g>" * 90
    started = time.process_time()
    styles = styles_of(f"<svg><style>{selector}{{fill:none}}</style>{tree}</svg>")
    assert time.process_time() - started < 3
    assert styles.unread <= 1


def test_a_sheet_of_far_too_many_tests_is_refused(monkeypatch):
    monkeypatch.setattr(svg_style, "_MOST_TESTS", 1000)
    with pytest.raises(PlanError, match=r"a.svg: its style sheets take more than 1,000 tests. Simplify them."):
        styles_of(f"<svg><style>{'*{fill:none}' * 50}</style>{'<g/>' * 50}</svg>")


def test_brackets_in_brackets_end_nothing():
    root = ElementTree.fromstring(f'<svg style="fill:{"(" * 50_000};stroke:red"/>')
    assert Styles(root, "a.svg").of(root).get("fill", "") == ""


def test_each_combinator_meets_what_it_names():
    text = """<svg><style>
        .p > .x{fill:a} .p .x{stroke:b} .x + .y{fill:c} .x ~ .z{fill:d} .q .p > .x + .y{stroke:e}
        </style><g class="p q"><g class="p"><a class="x"/><a class="y"/><a class="z"/><g><a class="x"/></g></g></g>
        </svg>"""
    root = ElementTree.fromstring(text)
    styles = Styles(root, "a.svg")
    said = [(element.get("class"), styles.of(element)) for element in root.iter("a")]
    assert said == [
        ("x", {"fill": "a", "stroke": "b"}),
        ("y", {"fill": "c", "stroke": "e"}),
        ("z", {"fill": "d"}),
        ("x", {"stroke": "b"}),
    ]
