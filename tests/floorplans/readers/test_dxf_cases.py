"""Small drawings in the manner of real exports, kept beside the repository, and what is right for each."""

import os
from pathlib import Path
from typing import NamedTuple

import pytest
import shapely

from pipeline.floorplans.readers.dxf import Dxf
from tests.floorplans.readers.drawing_samples import contains, refusal
from tests.floorplans.readers.dxf_samples import read

_ROOT = Path(__file__).parents[3].parent / "shared" / "cases"


class Right(NamedTuple):
    """Size [m], free floor [m2] and its parts, doors as x, y, width, and what a remark says."""

    area: float
    parts: int = 1
    size: tuple[float, float] = (10.0, 6.0)
    doors: tuple[tuple[float, float, float], ...] = ()
    remark: str = "layers taken: walls from A-WALL"


CASES = {
    "03_hidden_geometry_counts/entity_invisible.dxf": Right(57.9, remark="on layers A-WALL"),
    "03_hidden_geometry_counts/layer_frozen.dxf": Right(57.9, remark="on layers A-WALL-OLD"),
    "03_hidden_geometry_counts/layer_off.dxf": Right(57.9, remark="on layers A-WALL-OLD"),
    "04_wall_width_ignored/wide_polyline.dxf": Right(50.0, size=(10.5, 6.5)),
    "05_dxf_door_block_scaled/door_nonuniform.dxf": Right(57.9, doors=((5.0, 3.54, 1.08),)),
    "10_dxf_layer_names/name_important.dxf": Right(57.8, 2),
    "10_dxf_layer_names/name_report.dxf": Right(57.8, 2),
    "10_dxf_layer_names/name_transport.dxf": Right(57.8, 2),
    "10_dxf_layer_names/walls_socket.dxf": Right(57.9),
    "10_dxf_layer_names/walls_wallpaper.dxf": Right(57.9),
    "11_dxf_millimetre_grid_coordinates/utm_mm.dxf": Right(57.9),
    "12_dxf_kinds_and_xref/mline_partition.dxf": Right(57.2, 2),
    "12_dxf_kinds_and_xref/solid_only.dxf": Right(9.6 * 5.6),
    "12_dxf_kinds_and_xref/xref_missing.dxf": Right(57.9, remark="shell.dxf"),
    "20_us_survey_feet/us_survey_feet.dxf": Right(57.9),
}


def case(name: str) -> Path:
    path = Path(os.environ.get("HINTERLAND_CASES", _ROOT)) / name
    if not path.is_file():
        pytest.skip(f"no {path}: set HINTERLAND_CASES to the folder that holds it")
    return path


@pytest.mark.parametrize("name", CASES)
def test_a_case_is_read_as_it_is_drawn(name):
    right, plan = CASES[name], read(case(name))
    assert plan.free.area == pytest.approx(right.area, abs=0.05)
    assert len(shapely.get_parts(plan.free)) == right.parts
    low_x, low_y, high_x, high_y = plan.bounds
    assert (high_x - low_x, high_y - low_y) == pytest.approx(right.size, abs=0.005)
    assert [door[:3] for door in plan.doors] == [pytest.approx(door, abs=0.01) for door in right.doors]
    assert any(right.remark in remark for remark in plan.remarks)


def test_the_wide_outline_is_wide():
    assert contains(read(case("04_wall_width_ignored/wide_polyline.dxf")), [(2, 0.2), (2, 0.3)]) == [False, True]


def test_a_drawing_of_a_reference_alone_names_it():
    assert "shell.dxf" in refusal(Dxf(), case("12_dxf_kinds_and_xref/xref_only.dxf"))
