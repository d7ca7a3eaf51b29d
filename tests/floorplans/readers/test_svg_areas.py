"""Areas by SVG's fill rules, against counts by hand and a slow obvious twin."""

import time

import numpy as np
import pytest
import shapely

from pipeline.errors import PlanError
from pipeline.floorplans.readers.svg_areas import drawn, filled
from pipeline.floorplans.readers.svg_paint import Pen
from tests.floorplans.readers.svg_samples import HALL, check_walls, read_svg, walls_in


def ring(*corners):
    return np.array(corners, dtype=np.float64)


def rectangle(x0, y0, x1, y1, *, back=False):
    corners = ring((x0, y0), (x1, y0), (x1, y1), (x0, y1))
    return corners[::-1] if back else corners


def area(*rings, nonzero=True):
    return filled(rings, nonzero=nonzero, name="a drawing")[0]


# rings, area by the nonzero rule, area by the even-odd rule
BY_HAND = {
    "one": ([rectangle(0, 0, 5, 2)], 10, 10),
    "the same twice": ([rectangle(0, 0, 5, 2)] * 2, 10, 0),
    "there and back": ([rectangle(0, 0, 5, 2), rectangle(0, 0, 5, 2, back=True)], 0, 0),
    "overlap": ([rectangle(0, 0, 5, 2), rectangle(3, 0, 9, 2)], 18, 14),
    "overlap, one turned": ([rectangle(0, 0, 5, 2), rectangle(3, 0, 9, 2, back=True)], 14, 14),
    "a hole turned against its outline": ([rectangle(0, 0, 9, 7), rectangle(1, 1, 8, 6, back=True)], 28, 28),
    "a hole turned alike is none": ([rectangle(0, 0, 9, 7), rectangle(1, 1, 8, 6)], 63, 28),
    "a pillar in a hole": (
        [rectangle(0, 0, 9, 7), rectangle(1, 1, 8, 6, back=True), rectangle(3, 2, 5, 4)],
        32,
        32,
    ),
    "a hole in twice": (
        [rectangle(0, 0, 9, 7), rectangle(0, 0, 9, 7), rectangle(1, 1, 8, 6, back=True)],
        63,
        35,
    ),
    "far apart": ([rectangle(0, 0, 1, 1), rectangle(5, 5, 7, 6, back=True)], 3, 3),
    "sides in common": ([rectangle(0, 0, 2, 3), rectangle(2, 0, 5, 3)], 15, 15),
    "nothing": ([ring((0, 0), (4, 4), (2, 2))], 0, 0),
}


@pytest.mark.parametrize("case", BY_HAND)
def test_areas_by_both_rules(case):
    rings, nonzero, even_odd = BY_HAND[case]
    assert area(*rings).area == pytest.approx(nonzero)
    assert area(*rings, nonzero=False).area == pytest.approx(even_odd)


def test_a_ring_that_runs_twice_around_itself():
    """Its inner loop, 2 x 2, is turned around twice."""
    loop = ring((0, 0), (6, 0), (6, 5), (2, 5), (2, 1), (4, 1), (4, 3), (0, 3))
    both = [filled([loop], nonzero=rule, name="a") for rule in (True, False)]
    # 6 x 5 without the corner (0, 3)-(2, 5), and without the loop (2, 1)-(4, 3) by the other rule
    assert [found.area for found, _ in both] == pytest.approx([26, 22])
    assert [crossed for _, crossed in both] == [True, True]


def turns(spot, rings):
    """How often the rings turn around ``spot``: the sum of the angles by which the view of a walker turns."""
    total = 0.0
    for corners in rings:
        angles = np.arctan2(*(corners - spot).T[::-1])
        steps = np.diff(np.append(angles, angles[0]))
        total += float(np.sum((steps + np.pi) % (2 * np.pi) - np.pi))
    return round(total / (2 * np.pi))


@pytest.mark.parametrize("seed", range(12))
def test_areas_are_those_of_a_walk_around_every_spot(seed):
    rng = np.random.default_rng(seed)
    rings = [rng.uniform(0, 10, (rng.integers(3, 8), 2)) for _ in range(rng.integers(1, 5))]
    spots = rng.uniform(0, 10, (300, 2))
    counts = np.array([turns(spot, rings) for spot in spots])
    assert (shapely.contains_xy(area(*rings), spots) == (counts != 0)).all()
    assert (shapely.contains_xy(area(*rings, nonzero=False), spots) == (counts % 2 != 0)).all()
    assert 0 < (counts != 0).sum() < len(spots)


def test_thousands_of_walls_in_one_path_are_quick():
    corners = [(10 * x, 10 * y) for x in range(50) for y in range(40)]
    bars = [rectangle(x, y, x + 10.5, y + 1) for x, y in corners]
    bars += [rectangle(x, y, x + 1, y + 10.2, back=(x + y) % 20 == 0) for x, y in corners]
    started = time.process_time()
    assert area(*bars[:2000]).area == pytest.approx(2000 * 10.5 - 49 * 40 * 0.5)
    assert area(*bars).is_valid
    assert time.process_time() - started < 5


def test_a_scribble_is_refused():
    scribble = np.random.default_rng(0).uniform(0, 5000, (2000, 2))
    for rings in ([scribble], [scribble, rectangle(0, 0, 5, 5)]):
        with pytest.raises(PlanError, match="a drawing: lines meet more than"):
            area(*rings)
    with pytest.raises(PlanError, match="a drawing: lines meet more than"):
        drawn(scribble, Pen(5.0), closed=False, name="a drawing")


def test_pens_draw_lines_and_rings():
    line = ring((0, 0), (0, 4))
    for cap, expected in (("flat", 4), ("square", 5), ("round", 4 + np.pi / 4)):
        assert drawn(line, Pen(1.0, cap), closed=False, name="a").area == pytest.approx(expected, rel=0.01)
    corners = rectangle(0, 0, 6, 4)
    for join, expected in (("mitre", 20), ("bevel", 20 - 4 * 0.125), ("round", 20 - 4 * (1 - np.pi / 4) / 4)):
        assert drawn(corners, Pen(1.0, join=join), closed=True, name="a").area == pytest.approx(expected, rel=0.01)


# In a drawing: two bars in one path that overlap in 0.5 x 0.2 m
CROSS = '<path class="wall{}" d="M300 100H500V120H300Z M450 100H620V120H450Z"{}/>'
BOTH = [(3.0, 1.0, 6.2, 1.2)]
NONZERO = ' fill-rule="nonzero"'
NOT_TWICE = [(3.0, 1.0, 4.5, 1.2), (5.0, 1.0, 6.2, 1.2)]


@pytest.mark.parametrize(
    ("drawing", "boxes"),
    [
        (CROSS.format("", ""), BOTH),
        (CROSS.format("", ' fill-rule="evenodd"'), NOT_TWICE),
        (CROSS.format("", ' style="fill-rule:evenodd"'), NOT_TWICE),
        (f'<g fill-rule="evenodd">{CROSS.format("", "")}</g>', NOT_TWICE),
        (f'<g fill-rule="evenodd"><g style="fill-rule:nonzero">{CROSS.format("", "")}</g></g>', BOTH),
        (f"<style>.odd{{fill-rule:evenodd}}</style>{CROSS.format(' odd', '')}", NOT_TWICE),
        (f"<style>g path{{fill-rule:EvenOdd}}</style><g>{CROSS.format('', NONZERO)}</g>", NOT_TWICE),
        (CROSS.format("", ' clip-rule="evenodd"'), BOTH),
        (CROSS.format("", ' transform="scale(-1 1) translate(-1000 50)"'), [(3.8, 1.5, 7.0, 1.7)]),
    ],
)
def test_the_fill_rule_is_taken_from_where_it_is_said(tmp_path, drawing, boxes):
    plan = read_svg(tmp_path, HALL + drawing)
    check_walls(plan, *boxes)
    assert plan.remarks == ()


def test_a_wall_drawn_twice_in_one_path_stays_a_wall(tmp_path):
    plan = read_svg(tmp_path, HALL + f'<path class="wall" d="{"M490 20H510V580H490Z" * 2}"/>')
    assert [round(part.area, 2) for part in shapely.get_parts(plan.free)] == [26.32, 26.32]


def test_a_court_in_a_ring_of_walls_in_a_court(tmp_path):
    """Two rings in each other, each with a hole turned against it, in one path."""
    outer, inner = "M200 100H800V500H200ZM220 120V480H780V120Z", "M400 200H700V400H400ZM420 220V380H680V220Z"
    plan = read_svg(tmp_path, HALL + f'<path class="wall" d="{outer}{inner}"/>')
    assert walls_in(plan).area == pytest.approx((6 * 4 - 5.6 * 3.6) + (3 * 2 - 2.6 * 1.6), abs=1e-6)
