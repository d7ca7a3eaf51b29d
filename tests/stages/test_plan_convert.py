import numpy as np
import pytest

from pipeline.floorplans.plan import CLUTTER, OCCUPIED, FloorPlan
from pipeline.floorplans.readers import read_plan_file
from pipeline.grids.rasterize import rasterize
from tests.floorplans.samples import write_npz
from tests.stages.plan_samples import SQUARE, cells_in, files_in, run, write_home, write_houses


@pytest.mark.parametrize("ending", [".yaml", ".png", ".geojson"])
def test_a_converted_grid_is_the_same_grid(ending, tmp_path, capsys):
    source = write_npz(tmp_path / "7-1_3.npz")
    code, out, err = run(capsys, "convert", source, tmp_path / "out" / f"floor{ending}")
    assert (code, err) == (0, "")
    assert out.startswith("1 plan as ")
    (before,), (after,) = read_plan_file(source), read_plan_file(tmp_path / "out" / f"floor{ending}")
    kept = before.cells if ending == ".geojson" else np.where(before.cells == CLUTTER, OCCUPIED, before.cells)
    assert np.array_equal(after.cells, kept)
    assert (after.resolution, after.origin) == (before.resolution, before.origin)


def test_geometry_is_rasterised_for_a_format_of_cells_and_that_is_said(tmp_path, capsys):
    source = write_houses(tmp_path / "house.json", SQUARE)
    code, _, err = run(capsys, "convert", source, tmp_path / "house.yaml")
    assert code == 0
    assert err == "house.house-0: drawn as cells of 0.05 m; --resolution changes that\n"
    (house,) = read_plan_file(source)
    assert np.array_equal(cells_in(tmp_path / "house.yaml"), rasterize(house, 0.05).cells)
    assert run(capsys, "convert", source, tmp_path / "coarse.yaml", "--resolution", "0.2")[2] == ""
    assert np.array_equal(cells_in(tmp_path / "coarse.yaml"), rasterize(house, 0.2).cells)


def test_geometry_stays_geometry_where_the_format_can_hold_it(tmp_path, capsys):
    home = write_home(tmp_path / "home.svg")
    assert run(capsys, "convert", home, tmp_path / "home.geojson", "--scale", "0.01")[0] == 0
    (plan,) = read_plan_file(tmp_path / "home.geojson")
    assert isinstance(plan, FloorPlan)
    assert sorted(room.label for room in plan.rooms) == ["Bedroom", "Kitchen"]
    assert plan.doors[0].width == pytest.approx(1.0)


def test_a_resolution_that_may_close_a_door_is_said(tmp_path, capsys):
    home = write_home(tmp_path / "home.svg")
    code, _, err = run(capsys, "convert", home, tmp_path / "home.yaml", "--scale", "0.01", "--resolution", "0.4")
    assert code == 0
    assert "cells of 0.4 m may close its narrowest opening, 1.00 m; at most 0.33 surely keeps it open" in err


def test_several_plans_become_files_of_a_folder(tmp_path, capsys):
    houses = write_houses(tmp_path / "houses.jsonl", SQUARE, SQUARE, SQUARE)
    code, _, err = run(capsys, "convert", houses, tmp_path / "one.geojson")
    assert code == 1
    assert "3 plans do not fit into one file" in err
    assert run(capsys, "convert", houses, tmp_path / "out", "--to", "moving_ai", "--resolution", "0.5")[0] == 0
    assert files_in(tmp_path / "out") == [f"houses.house-{k}.map" for k in range(3)]
    assert "type octile" in (tmp_path / "out" / "houses.house-2.map").read_text()


def test_one_bad_plan_stops_a_conversion_unless_it_is_to_be_skipped(tmp_path, capsys):
    houses = write_houses(tmp_path / "houses.jsonl", SQUARE, [[0, 0], [0.5, 0], [0.5, 0.5]], SQUARE)
    code, out, err = run(capsys, "convert", houses, tmp_path / "out", "--to", "plan_geojson")
    assert (code, out, files_in(tmp_path)) == (1, "", ["houses.jsonl"])
    assert "house-1" in err
    assert err.count("\n") == 1
    code, _, err = run(capsys, "convert", houses, tmp_path / "out", "--to", "plan_geojson", "--skip-bad")
    assert code == 0
    assert err.startswith("left out: plan houses.house-1")
    assert files_in(tmp_path / "out") == ["houses.house-0.geojson", "houses.house-2.geojson"]


def test_nothing_is_overwritten_and_nothing_is_half_written(tmp_path, capsys):
    source = write_npz(tmp_path / "7-1_3.npz")
    (tmp_path / "floor.pgm").write_text("mine")  # the picture that would lie beside floor.yaml
    code, _, err = run(capsys, "convert", source, tmp_path / "floor.yaml")
    assert code == 1
    assert "floor.pgm: exists" in err
    assert files_in(tmp_path) == ["7-1_3.npz", "floor.pgm"]
    assert (tmp_path / "floor.pgm").read_text() == "mine"
    assert run(capsys, "convert", source, tmp_path / "floor.yaml", "--force")[0] == 0
    assert files_in(tmp_path) == ["7-1_3.npz", "floor.pgm", "floor.yaml"]
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".")] == []
