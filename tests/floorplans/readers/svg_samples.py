"""A hall of 10 x 6 m drawn in hundredths of a metre, its faces 0.2 m inside, and what tests draw into it."""

from pathlib import Path

import pytest
import shapely
from shapely.geometry.base import BaseGeometry

from pipeline.floorplans.plan import FloorPlan
from pipeline.floorplans.readers.svg import Svg
from tests.floorplans.readers.drawing_samples import read_one

SCALE = 0.01
HALL = '<path class="wall" fill-rule="evenodd" d="M0 0H1000V600H0Z M20 20H980V580H20Z"/>'
INNER = shapely.box(0.2, -5.8, 9.8, -0.2)
HIDDEN = "{} of walls, doors or rooms passed over: hidden or not painted"
_HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'


def write_svg(folder: Path, inner: str, root: str = ' viewBox="0 0 1000 600"') -> Path:
    path = folder / "hall.svg"
    path.write_text(f"{_HEAD}{root}>{inner}</svg>")
    return path


def read_svg(folder: Path, inner: str, root: str = ' viewBox="0 0 1000 600"', **options) -> FloorPlan:
    return read_one(Svg(), write_svg(folder, inner, root), **({"metres_per_unit": SCALE} | options))


def walls_in(plan: FloorPlan) -> BaseGeometry:
    """What of the hall is not free: what was drawn into it."""
    return INNER.difference(plan.free)


def check_walls(plan: FloorPlan, *boxes: tuple[float, float, float, float]) -> None:
    """Check that just these boxes [m; left, top, right, bottom, y down] stand in the hall."""
    expected = shapely.union_all([shapely.box(x0, -y1, x1, -y0) for x0, y0, x1, y1 in boxes])
    found = walls_in(plan)
    assert found.symmetric_difference(expected).area == pytest.approx(0, abs=1e-3), found.wkt


def check_polygon(plan: FloorPlan, *corners: tuple[float, float]) -> None:
    """Check that just this polygon [m, y down] stands in the hall."""
    expected = shapely.Polygon([(x, -y) for x, y in corners])
    found = walls_in(plan)
    assert found.symmetric_difference(expected).area == pytest.approx(0, abs=1e-3), found.wkt
