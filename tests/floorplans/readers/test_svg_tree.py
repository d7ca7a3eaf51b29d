"""Where shapes lie: transforms, nested drawings, copies, clip paths. Every expected corner is worked out by hand."""

import time

import pytest
import shapely

from pipeline.floorplans.readers import svg_tree
from pipeline.floorplans.readers.svg import Svg
from tests.floorplans.readers.drawing_samples import refusal
from tests.floorplans.readers.svg_samples import (
    HALL,
    HIDDEN,
    check_polygon,
    check_walls,
    read_svg,
    walls_in,
    write_svg,
)

BAR = '<rect class="wall" x="100" y="50" width="20" height="300"{}/>'  # 1.0 to 1.2 m, 0.5 to 3.5 m

# transform of the bar, its corners [cm] after it
SINGLE = {
    "translate(200,30)": [(300, 80), (320, 80), (320, 380), (300, 380)],
    "translate(200)": [(300, 50), (320, 50), (320, 350), (300, 350)],
    "translate(30-20)": [(130, 30), (150, 30), (150, 330), (130, 330)],
    "scale(3 1.5)": [(300, 75), (360, 75), (360, 525), (300, 525)],
    "scale(1.5)": [(150, 75), (180, 75), (180, 525), (150, 525)],
    "rotate(90 300 300)": [(550, 100), (550, 120), (250, 120), (250, 100)],  # (600 - y, x)
    "matrix(0 2 1.5 0 100 -60)": [(175, 140), (175, 180), (625, 180), (625, 140)],
    "translate(700 0) scale(-1 1)": [(600, 50), (580, 50), (580, 350), (600, 350)],
    "translate(60,40) , rotate (0)": [(160, 90), (180, 90), (180, 390), (160, 390)],
    "skewX(45)": [(150, 50), (170, 50), (470, 350), (450, 350)],
    "skewY(45) translate(30 -60)": [(130, 120), (150, 140), (150, 440), (130, 420)],
}


def metres(corners):
    return [(x / 100, y / 100) for x, y in corners]


@pytest.mark.parametrize("transform", SINGLE)
def test_a_transform_of_a_shape_moves_its_points(tmp_path, transform):
    plan = read_svg(tmp_path, HALL + BAR.format(f' transform="{transform}"'))
    check_polygon(plan, *metres(SINGLE[transform]))
    assert plan.remarks == ()


@pytest.mark.parametrize("transform", SINGLE)
def test_a_transform_of_a_group_or_layer_does_too(tmp_path, transform):
    layer = f'<g id="layer1" class="walls" transform="{transform}"><g>{BAR.format("")}</g></g>'
    check_polygon(read_svg(tmp_path, HALL + layer), *metres(SINGLE[transform]))


def test_transforms_in_each_other_count_from_the_inside_out(tmp_path):
    """The bar is doubled in height and moved, then turned by a quarter, then pressed and moved.

    (100..120, 50..350) -> y 2, + (0, 40): (100..120, 140..740) -> (x, y) -> (-y, x): (-740..-140, 100..120)
    -> x 0.5, + (420, 30): (50..350, 130..150).
    """
    inner = f'<g transform="rotate(90)">{BAR.format(""" transform="translate(0,40) scale(1,2)" """)}</g>'
    check_walls(
        read_svg(tmp_path, f'{HALL}<g transform="translate(420 30) scale(.5 1)">{inner}</g>'), (0.5, 1.3, 3.5, 1.5)
    )


def test_every_kind_of_shape_is_moved(tmp_path):
    """All by matrix(2 0 0 1 40 10): x is doubled, and 0.4 and 0.1 m added."""
    shapes = (
        '<rect x="20" y="20" width="10" height="20"/>'
        '<polygon points="50,20 60,20 60,40 50,40"/>'
        '<polyline points="80,20 90,20 90,40 80,40" fill="#000" stroke="none"/>'
        '<path d="M110 20h10v20h-10z"/>'
        '<line x1="140" y1="20" x2="140" y2="40" stroke="#000" stroke-width="10"/>'
    )
    plan = read_svg(tmp_path, f'{HALL}<g class="wall" transform="matrix(2 0 0 1 40 10)">{shapes}</g>')
    bars = [(0.8, 0.3, 1.0, 0.5), (1.4, 0.3, 1.6, 0.5), (2.0, 0.3, 2.2, 0.5), (2.6, 0.3, 2.8, 0.5)]
    check_walls(plan, *bars, (3.1, 0.3, 3.3, 0.5))


def test_circles_and_ellipses_are_moved_and_stretched(tmp_path):
    shapes = '<circle cx="50" cy="100" r="20"/><ellipse cx="150" cy="150" rx="10" ry="30"/>'
    plan = read_svg(tmp_path, f'{HALL}<g class="wall" transform="translate(100 50) scale(3 1)">{shapes}</g>')
    left, right = sorted(shapely.get_parts(walls_in(plan)), key=lambda part: part.bounds[0])
    assert left.bounds == pytest.approx((1.9, -1.7, 3.1, -1.3), abs=1e-6)
    assert right.bounds == pytest.approx((5.2, -2.3, 5.8, -1.7), abs=1e-6)
    assert left.area == pytest.approx(3.14159 * 0.6 * 0.2, rel=0.01)


# style of the bar, its box [m]
CSS = {
    "transform:translate(200px,30px)": (3.0, 0.8, 3.2, 3.8),
    "transform:translate(20%, 10%)": (3.0, 1.1, 3.2, 4.1),
    "transform: translateX(2in) translateY(-0.3rem)": (2.92, 0.452, 3.12, 3.452),
    "transform:rotate(0.25turn); transform-origin: 300px 300px": (2.5, 1.0, 5.5, 1.2),
    "transform:rotate(90deg);transform-origin:30% 50%": (2.5, 1.0, 5.5, 1.2),
    "transform:scale(150%, 50%) !important": (1.5, 0.25, 1.8, 1.75),
    "translate: 200px 30px": (3.0, 0.8, 3.2, 3.8),
    "scale: 3 1; translate: 10px": (3.1, 0.5, 3.7, 3.5),
    "x:400px; width: 3%; height:1in": (4.0, 0.5, 4.3, 1.46),
}


@pytest.mark.parametrize("style", CSS)
def test_style_places_shapes(tmp_path, style):
    check_walls(read_svg(tmp_path, HALL + BAR.format(f' style="{style}"')), CSS[style])


def test_style_wins_over_the_attribute_and_sheets_place_groups(tmp_path):
    sheet = "<style>#moved{transform:translate(350px,70px)}</style>"
    moved = f'<g id="moved" transform="translate(11 11)">{BAR.format("")}</g>'
    check_walls(read_svg(tmp_path, sheet + HALL + moved), (4.5, 1.2, 4.7, 4.2))


def test_a_transform_of_the_drawing_itself_is_applied(tmp_path):
    whole = f'<g transform="translate(-300 200)">{HALL}{BAR.format("")}</g>'
    root = ' viewBox="0 0 1000 600" transform="translate(300,-200)"'
    check_walls(read_svg(tmp_path, whole, root), (1.0, 0.5, 1.2, 3.5))


@pytest.mark.parametrize(
    "transform", ["scale(zwei)", "rotate(1 2)", "rotate(5px)", "matrix(1 2)", "twirl(3)", "scale(1"]
)
def test_a_transform_that_cannot_be_read_costs_its_shape_alone(tmp_path, transform):
    plan = read_svg(tmp_path, HALL + BAR.format(f' transform="{transform}"') + BAR.format(' transform="translate(99)"'))
    check_walls(plan, (1.99, 0.5, 2.19, 3.5))
    assert plan.remarks == ("1 shape left out: could not be read",)


# Nested drawings: attributes, the bar within 0..80 x 10..20 as it should come out
NESTED = {
    'x="300" y="100"': (3.1, 1.1, 3.9, 1.2),
    'x="300" y="100" width="200" height="200" viewBox="0 0 100 50"': (3.2, 1.7, 4.8, 1.9),
    'x="300" y="100" width="200" height="200" viewBox="0 0 100 50" preserveAspectRatio="xMinYMax"': (
        3.2,
        2.2,
        4.8,
        2.4,
    ),
    'x="300" y="100" width="400" height="50" viewBox="0 0 100 50" preserveAspectRatio="xMaxYMid"': (6.1, 1.1, 6.9, 1.2),
    'x="300" y="100" width="300" height="200" viewBox="0 0 100 50" preserveAspectRatio="none"': (3.3, 1.4, 5.7, 1.8),
    'x="30%" y="10%" width="50" height="15"': (3.1, 0.7, 3.5, 0.75),
    'x="300" y="100" width="50" height="15" overflow="visible"': (3.1, 1.1, 3.9, 1.2),
    'x="300" y="100" viewBox="10 10 1000 600"': (3.0, 1.0, 3.8, 1.1),
    # three times as large, so that both sides are covered: 100 x 50 in 150 x 150, its middle at the middle
    'x="300" y="100" width="150" height="150" viewBox="0 0 100 50" preserveAspectRatio="xMidYMid slice"': (
        3.0,
        1.3,
        4.5,
        1.6,
    ),
}


@pytest.mark.parametrize("attributes", NESTED)
def test_nested_drawings_place_fit_and_cut(tmp_path, attributes):
    inner = f'<svg {attributes}><rect class="wall" x="10" y="10" width="80" height="10"/></svg>'
    check_walls(read_svg(tmp_path, HALL + inner), NESTED[attributes])


def test_shares_are_of_the_nearest_viewport(tmp_path):
    """100 % are the view box where there is one, else the size; of radii the diagonal over the root of two."""
    bar = '<rect class="wall" x="50%" y="10%" width="2%" height="40%"/>'
    check_walls(read_svg(tmp_path, HALL + bar), (5.0, 0.6, 5.2, 3.0))
    check_walls(read_svg(tmp_path, HALL + bar, ' width="1000" height="600px"'), (5.0, 0.6, 5.2, 3.0))
    nested = f'<svg x="200" y="100" width="500" height="400" viewBox="0 0 250 200">{bar}</svg>'
    check_walls(read_svg(tmp_path, HALL + nested), (4.5, 1.4, 4.6, 3.0))
    line = '<line class="wall" x1="30%" y1="20%" x2="30%" y2="50%" stroke="#000" stroke-width="20"/>'
    check_walls(read_svg(tmp_path, HALL + line), (2.9, 1.2, 3.1, 3.0))


def test_a_share_of_an_unknown_size_is_said(tmp_path):
    plan = read_svg(tmp_path, HALL + '<rect class="wall" width="50%" height="20"/>', "")
    check_walls(plan)
    assert plan.remarks == ("1 shape left out: could not be read",)


POST = '<rect id="post" class="wall" width="20" height="100"/>'


def test_copies_are_drawn_where_they_are_put(tmp_path):
    uses = (
        '<use href="#post" x="300" y="100"/><use xlink:href="#post" x="1" transform="translate(500 300) rotate(90)"/>'
    )
    plan = read_svg(tmp_path, f"{HALL}<defs>{POST}</defs>{uses}")
    check_walls(plan, (3.0, 1.0, 3.2, 2.0), (4.0, 3.01, 5.0, 3.21))
    assert plan.remarks == ()


def test_a_copy_takes_name_and_style_from_where_it_is_put(tmp_path):
    plain = '<defs><g id="leaf" class="leaf"><path d="M0 0H90"/></g></defs>'
    uses = '<use class="wall" href="#leaf" x="200" y="300" stroke="#000" stroke-width="30"/><use href="#leaf" y="99"/>'
    check_walls(read_svg(tmp_path, HALL + plain + uses), (2.0, 2.85, 2.9, 3.15))


def test_symbols_are_fitted_into_what_the_copy_says(tmp_path):
    symbol = '<symbol id="s" viewBox="0 0 10 10"><rect class="wall" width="10" height="5"/></symbol>'
    uses = '<use href="#s" x="300" y="100" width="100" height="200"/>'
    uses += '<use href="#s" x="5%" y="400" width="60" height="60"/>'
    check_walls(read_svg(tmp_path, HALL + symbol + uses), (3.0, 1.5, 4.0, 2.0), (0.5, 4.0, 1.1, 4.3))


def test_copies_of_copies_are_followed_but_never_within_themselves(tmp_path):
    chain = f'<defs>{POST}<g id="two"><use href="#post" x="30"/><use href="#post" x="80"/></g></defs>'
    plan = read_svg(tmp_path, f'{HALL}{chain}<use href="#two" x="200" y="200"/>')
    check_walls(plan, (2.3, 2.0, 2.5, 3.0), (2.8, 2.0, 3.0, 3.0))
    circle = '<g id="a">{}<use href="#a" x="50"/><use href="#b"/></g><g id="b"><use href="#a"/></g>'.format(
        POST.replace("/>", ' x="300" y="100"/>')
    )
    plan = read_svg(tmp_path, HALL + circle)
    check_walls(plan, (3.0, 1.0, 3.2, 2.0))
    assert plan.remarks == ("5 <use>s left out: nothing in this file to copy",)


def test_copies_of_other_files_and_of_nothing_are_counted(tmp_path):
    uses = '<use href="other.svg#post"/><use href="#nowhere"/><use/><use href="#c"/><clipPath id="c"/>'
    plan = read_svg(tmp_path, HALL + uses)
    assert plan.remarks == ("4 <use>s left out: nothing in this file to copy",)


def test_copies_that_multiply_are_refused_in_time(tmp_path):
    layers = "".join(f'<g id="l{k}">{f"""<use href="#l{k + 1}"/>""" * 10}</g>' for k in range(9))
    file = write_svg(
        tmp_path, f'{HALL}<defs>{layers}<rect id="l9" class="wall" width="9" height="9"/></defs><use href="#l0"/>'
    )
    started = time.process_time()
    assert "hall.svg: <use> copies more than 30,000 elements." in refusal(Svg(), file, metres_per_unit=0.01)
    assert time.process_time() - started < 5


BEAM = '<rect class="wall" x="200" y="200" width="400" height="20"/>'


@pytest.mark.parametrize(
    ("clip", "attribute", "seen"),
    [
        ('<rect x="300" width="100" height="300"/>', "", (3.0, 2.0, 4.0, 2.2)),
        (
            '<rect x="300" width="100" height="300"/><circle r="9"/>',
            'transform="translate(150 0)"',
            (4.5, 2.0, 5.5, 2.2),
        ),
        ('<path clip-rule="evenodd" d="M0 0H900V500H0ZM0 0H450V500H0Z"/>', "", (4.5, 2.0, 6.0, 2.2)),
        ('<path d="M0 0H900V500H0ZM0 0H450V500H0Z"/>', "", (2.0, 2.0, 6.0, 2.2)),
        ('<use href="#frame" x="100"/>', "", (3.5, 2.0, 5.1, 2.2)),
        ('<rect x="300" width="100" height="300"/><rect width="900" height="900" display="none"/>', "", (3, 2, 4, 2.2)),
    ],
)
def test_clip_paths_cut(tmp_path, clip, attribute, seen):
    frame = '<defs><rect id="frame" x="250" y="150" width="160" height="90"/></defs>'
    defs = f'{frame}<clipPath id="c" {attribute}>{clip}</clipPath>'
    plan = read_svg(tmp_path, f'{HALL}{defs}<g clip-path="url(#c)">{BEAM}</g>')
    check_walls(plan, seen)
    assert plan.remarks == ()


def test_clip_paths_meet_each_other_and_move_with_their_group(tmp_path):
    defs = '<clipPath id="a"><rect x="300" width="200" height="600"/></clipPath>'
    defs += '<clipPath id="b"><rect x="100" width="250" height="600"/></clipPath>'
    inner = f'<g style="clip-path: url(\'#b\')" transform="translate(50)">{BEAM}</g>'
    plan = read_svg(tmp_path, f'{HALL}{defs}<g clip-path="url(#a)">{inner}</g>')
    check_walls(plan, (3.0, 2.0, 4.0, 2.2))


def test_clip_paths_in_shares_of_the_box_of_what_they_clip(tmp_path):
    """The box around both is 2.0 to 7.0 m and 1.0 to 2.2 m: of it the right half and the lower 75 %."""
    clip = (
        '<clipPath id="c" clipPathUnits="objectBoundingBox"><rect x=".5" y=".25" width="0.5" height="0.75"/></clipPath>'
    )
    post = '<rect class="wall" x="680" y="100" width="20" height="100"/>'
    plan = read_svg(tmp_path, f'{HALL}{clip}<g clip-path="url(#c)">{BEAM}{post}</g>')
    check_walls(plan, (4.5, 2.0, 6.0, 2.2), (6.8, 1.3, 7.0, 2.0))


@pytest.mark.parametrize(
    ("style", "seen"),
    [
        ("transform:rotate(90deg);transform-origin:center", (3.9, 0.2, 4.1, 4.1)),  # around (4.0, 2.1), up to the wall
        ("transform:rotate(90deg);transform-origin:25% 100%", (3.0, 1.2, 3.2, 5.2)),  # around (3.0, 2.2)
        ("transform:translate(50%,200%)", (4.0, 2.4, 8.0, 2.6)),
        ("scale:0.5 3", (2.0, 2.0, 4.0, 2.6)),
    ],
)
def test_the_box_of_a_shape_or_group_may_be_what_a_transform_refers_to(tmp_path, style, seen):
    style = f"transform-box:fill-box;{style}"
    check_walls(read_svg(tmp_path, HALL + BEAM.replace("/>", f' style="{style}"/>')), seen)
    check_walls(read_svg(tmp_path, f'{HALL}<g style="{style}"><g>{BEAM}</g></g>'), seen)


def test_pictures_of_walls_are_counted(tmp_path):
    picture = '<image href="a.png" width="30" height="30"/>'
    plan = read_svg(tmp_path, f'{HALL}<g class="walls">{picture}</g>{picture}')
    assert plan.remarks == ("1 <image> of walls, doors or rooms left out: pictures are not read",)


def test_what_is_clipped_away_is_counted_and_what_cannot_clip_is_said(tmp_path):
    defs = '<clipPath id="a"><rect x="900" width="20" height="600"/></clipPath><clipPath id="none"/>'
    values = ('clip-path="url(#a)"', 'clip-path="url(#none)"', 'clip-path="url(#b)"', 'clip-path="circle(3px)"')
    shapes = "".join(f"<g {value}>{BEAM}</g>" for value in (*values, 'mask="url(#m)"'))
    plan = read_svg(tmp_path, HALL + defs + shapes)
    check_walls(plan, (2.0, 2.0, 6.0, 2.2))
    assert plan.remarks == (HIDDEN.format("2 shapes"), "3 clippings by path or mask not applied")


def test_clip_paths_that_clip_themselves_end(tmp_path):
    loop = '<clipPath id="a"><rect width="900" height="600" clip-path="url(#b)"/></clipPath>'
    loop += '<clipPath id="b"><rect width="400" height="600" clip-path="url(#a)"/></clipPath>'
    plan = read_svg(tmp_path, f'{HALL}{loop}<g clip-path="url(#a)">{BEAM}</g>')
    check_walls(plan, (2.0, 2.0, 4.0, 2.2))
    assert plan.remarks == ("1 clipping by path or mask not applied",)


def test_of_a_switch_one_child_is_drawn(tmp_path):
    parts = f'<foreignObject requiredExtensions="x"/><g>{BEAM}</g><g>{BAR.format("")}</g>'
    check_walls(read_svg(tmp_path, f"{HALL}<switch>{parts}</switch>"), (2.0, 2.0, 6.0, 2.2))


def test_a_deep_chain_of_clip_paths_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(svg_tree, "_DEEPEST", 20)
    chain = "".join(f'<clipPath id="c{k}"><g clip-path="url(#c{k + 1})">{BEAM}</g></clipPath>' for k in range(50))
    file = write_svg(tmp_path, f'{HALL}{chain}<g clip-path="url(#c0)">{BEAM}</g>')
    assert "20 groups in each other" in refusal(Svg(), file, metres_per_unit=0.01)
