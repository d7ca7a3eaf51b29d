"""Small drawings in the manner of bug reports, kept beside the repository, and what is right for each."""

import os
from pathlib import Path
from typing import NamedTuple

import pytest
import shapely

from pipeline.floorplans.checks import inspect
from pipeline.floorplans.readers.svg import Svg
from tests.floorplans.readers.drawing_samples import contains, read_one
from tests.floorplans.readers.svg_samples import HIDDEN, SCALE

_ROOT = Path(__file__).parents[3].parent / "shared" / "cases"


class Right(NamedTuple):
    """Free floor [m2] and its parts, the largest one's share, size [m], spots in walls and free, and the remarks."""

    area: float
    parts: int = 1
    share: float = 1.0
    size: tuple[float, float] = (10.0, 6.0)
    solid: tuple[tuple[float, float], ...] = ()
    free: tuple[tuple[float, float], ...] = ()
    narrowest: float | None = None
    remarks: tuple[str, ...] = ()


_UNFILLED = Right(54.8, size=(9.8, 5.8), narrowest=0.9)
_HIDDEN = Right(52.8, free=((2.5, -3.0),), remarks=(HIDDEN.format("1 shape"),))
_HALVES = Right(52.64, 2, 0.5, solid=((5.0, -2.5),))
CASES = {
    "01_svg_transforms_ignored/t_rect_translate.svg": Right(52.64, 2, 0.702, solid=((3.1, -3.0),), free=((1.1, -3.0),)),
    "02_svg_fill_rule_nonzero/nonzero_overlap.svg": _HALVES,
    "02_svg_fill_rule_nonzero/nonzero_twice.svg": _HALVES,
    "03_hidden_geometry_counts/css_display_none.svg": _HIDDEN,
    "03_hidden_geometry_counts/css_visibility.svg": _HIDDEN,
    "03_hidden_geometry_counts/opacity0.svg": _HIDDEN,
    "04_wall_width_ignored/stroke_walls.svg": Right(46.16, solid=((5.15, -1.0),)),
    "18_svg_position_and_style/css_id_unfilled.svg": _UNFILLED,
    "18_svg_position_and_style/css_transform.svg": Right(52.84),
    "18_svg_position_and_style/fill_opacity0.svg": _UNFILLED,
    "18_svg_position_and_style/fill_transparent.svg": _UNFILLED,
    "18_svg_position_and_style/percent.svg": Right(53.76),
}


@pytest.mark.parametrize("name", CASES)
def test_a_case_is_read_as_it_is_drawn(name):
    path = Path(os.environ.get("HINTERLAND_CASES", _ROOT)) / name
    if not path.is_file():
        pytest.skip(f"no {path}: set HINTERLAND_CASES to the folder that holds it")
    right, plan = CASES[name], read_one(Svg(), path, metres_per_unit=SCALE)
    parts = [part.area for part in shapely.get_parts(plan.free)]
    assert plan.free.area == pytest.approx(right.area, abs=0.05)
    assert (len(parts), max(parts) / sum(parts)) == (right.parts, pytest.approx(right.share, abs=0.002))
    low_x, low_y, high_x, high_y = plan.bounds
    assert (high_x - low_x, high_y - low_y) == pytest.approx(right.size, abs=0.005)
    assert not any(contains(plan, [spot])[0] for spot in right.solid)
    assert all(contains(plan, [spot])[0] for spot in right.free)
    assert (plan.remarks, plan.doors) == (right.remarks, ())
    if right.narrowest is not None:
        assert inspect(plan).narrowest_door_m == pytest.approx(right.narrowest, abs=0.01)
