import json
from dataclasses import dataclass

import numpy as np
import pytest
from PIL import Image

from pipeline.errors import PlanError
from pipeline.floorplans.readers import READERS, ReadOptions, read_plan_file, read_plans, say_unused
from pipeline.floorplans.readers.mit_campus_grids import MitCampusGrids
from pipeline.floorplans.sources import lone_file, open_source
from pipeline.floorplans.writers import WRITERS
from tests.floorplans.samples import KNOWN, grid_plan, write_map, write_npz
from tests.stages.plan_samples import SQUARE, files_in, run, write_home, write_houses

DEGREE_M = 111_319.49


def write_building(path, *levels):
    """A building of one room of 6 x 4 m on each level, at the equator."""
    corners = [[x / DEGREE_M, y / DEGREE_M] for x, y in [(0, 0), (6, 0), (6, 4), (0, 4), (0, 0)]]
    room = {"type": "Polygon", "coordinates": [corners]}
    tags = [{"indoor": "room", "level": level} for level in levels]
    features = [{"type": "Feature", "properties": each, "geometry": room} for each in tags]
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return path


def samples(folder):
    """One file for each way in which a format has floors: parted, one with a name, one without, and houses."""
    WRITERS["plan_geojson"].write(
        grid_plan(KNOWN, plan_id="venue.1", floor="venue.1", resolution=0.5), folder / "venue.1.geojson"
    )
    return {
        "levels": write_building(folder / "hall.geojson", "-1", "0", "0.5"),
        "npz": write_npz(folder / "7-1_3.npz"),
        "map": write_map(folder / "lab", np.pad(np.full((20, 30), 254, dtype=np.uint8), 2)),
        "houses": write_houses(folder / "houses.jsonl", SQUARE, SQUARE, names=("a", "b")),
        "own": folder / "venue.1.geojson",
        "svg": write_home(folder / "home.svg"),
    }


@pytest.mark.parametrize(
    ("sample", "level", "floors"),
    [
        ("levels", "9", "there are -1, 0, 0.5"),
        ("levels", "5", "there are -1, 0, 0.5"),
        ("levels", "1", "there are -1, 0, 0.5"),
        ("npz", "9", "there is 7-1"),
        ("map", "9", "there is lab"),
        ("houses", "9", "there are a, b"),
        ("own", "9", "there is venue.1"),
        ("svg", "9", "there is home"),
    ],
)
def test_a_level_that_selects_nothing_is_one_line_that_names_those_there_are(sample, level, floors, tmp_path, capsys):
    path = samples(tmp_path)[sample]
    scale = ["--scale", "0.01"] if sample == "svg" else []
    before = files_in(tmp_path)
    for command in (["info", path], ["convert", path, tmp_path / "out", "--to", "plan_geojson"]):
        code, out, err = run(capsys, *command, "--level", level, *scale)
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert f"--level {level} selects nothing; {floors}" in err
    assert files_in(tmp_path) == before


@pytest.mark.parametrize(
    ("sample", "levels", "read"),
    [
        ("levels", ("0",), ["hall.0"]),
        ("levels", ("0", "-1"), ["hall.-1", "hall.0"]),
        ("npz", ("1",), ["7-1"]),
        ("npz", ("7-1",), ["7-1"]),
        ("houses", ("b",), ["houses.b"]),
        ("own", ("1",), ["venue.1"]),
        ("svg", ("home",), ["home"]),
    ],
)
def test_a_level_selects_the_floors_of_that_name_in_every_format(sample, levels, read, tmp_path):
    scale = 0.01 if sample == "svg" else None
    found = read_plan_file(samples(tmp_path)[sample], options=ReadOptions(levels=levels, metres_per_unit=scale))
    assert [plan.floor for plan in found] == read
    assert not any("selects nothing" in remark for plan in found for remark in plan.remarks)


def test_of_several_levels_those_that_are_not_there_are_remarked(tmp_path):
    (plan,) = read_plan_file(samples(tmp_path)["levels"], options=ReadOptions(levels=("7", "0", "8")))
    assert "plans.read.levels = 7, 8 selects nothing in this file" in plan.remarks


@pytest.mark.parametrize("sample", ["levels", "npz", "map", "houses", "own"])
def test_a_scale_for_a_file_that_states_another_is_refused_once(sample, tmp_path, capsys):
    code, out, err = run(capsys, "info", samples(tmp_path)[sample], "--scale", "0.07")
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "--scale 0.07 does not fit: a file of " in err
    assert "Leave it away" in err


def test_the_scale_that_a_grid_states_may_be_said_again(tmp_path):
    (plan,) = read_plan_file(samples(tmp_path)["npz"], options=ReadOptions(metres_per_unit=0.5))
    assert (plan.resolution, plan.remarks) == (0.5, ())


@pytest.mark.parametrize(
    ("sample", "flags", "said"),
    [
        ("levels", ["--invert"], "--invert has no effect: indoor_geojson needs no such thing"),
        ("levels", ["--free-thresh", "0.1", "--paper"], "--free-thresh and --paper have no effect: indoor_geojson"),
        ("npz", ["--door-width", "1.1"], "--door-width has no effect: mit_campus_grids"),
        ("houses", ["--wall", "0.2", "--occupied-thresh", "0.7"], "--occupied-thresh and --wall have no effect"),
        ("svg", ["--scale", "0.01", "--invert"], "--invert has no effect: svg"),
        ("own", ["--door-layer", "DOORS"], "--door-layer has no effect: plan_geojson"),
    ],
)  # fmt: skip
def test_an_option_that_a_reader_does_not_use_is_remarked_and_told_when_converting(
    sample, flags, said, tmp_path, capsys
):
    path = samples(tmp_path)[sample]
    code, out, _ = run(capsys, "info", path, *flags)
    assert code == 0
    assert said in out
    code, _, err = run(capsys, "convert", path, tmp_path / "out", "--to", "plan_geojson", *flags)
    assert code == 0
    assert said in err


def test_options_at_their_defaults_and_those_that_are_used_are_not_spoken_of(tmp_path):
    assert all(say_unused(reader, ReadOptions()) == [] for reader in READERS.values())
    assert say_unused(READERS["raster_picture"], ReadOptions(invert=True, free_thresh=0.1, metres_per_unit=1.0)) == []


def test_layers_of_doors_without_a_door_are_remarked(tmp_path):
    options = ReadOptions(metres_per_unit=0.01, door_layers=("LEAVES",))
    (plan,) = read_plan_file(write_home(tmp_path / "home.svg"), options=options)
    assert "plans.read.door_layers = LEAVES selects nothing: no door was found" in plan.remarks


@dataclass(frozen=True)
class Silent(MitCampusGrids):
    """Finds nothing and says nothing."""

    def read(self, path, options):
        yield from ()


def test_a_file_without_a_plan_is_an_error(tmp_path):
    with pytest.raises(PlanError, match=r"7-1_3.npz: mit_campus_grids finds no plan in it"):
        list(read_plans(lone_file(write_npz(tmp_path / "7-1_3.npz")), Silent()))


def test_in_a_folder_a_scale_is_for_the_files_that_state_none(tmp_path):
    """A map in degrees and a picture without a scale: the picture takes it, the map says that its own one holds."""
    write_building(tmp_path / "floor.geojson", "0")
    picture = np.full((40, 60), 255, dtype=np.uint8)
    picture[[0, -1]], picture[:, [0, -1]] = 0, 0
    Image.fromarray(picture).save(tmp_path / "house.png")
    readers = {"floor.geojson": READERS["indoor_geojson"], "house.png": READERS["raster_picture"]}
    with open_source(tmp_path) as files:
        plans = {f.name: next(iter(read_plans(f, readers[f.name], ReadOptions(metres_per_unit=0.1)))) for f in files}
    assert plans["house.png"].resolution == 0.1
    assert not any("metres_per_unit" in remark for remark in plans["house.png"].remarks)
    assert any("states its own scale, which holds" in remark for remark in plans["floor.geojson"].remarks)
    with open_source(tmp_path / "floor.geojson") as files, pytest.raises(PlanError, match="Leave it away"):
        list(read_plans(files[0], READERS["indoor_geojson"], ReadOptions(metres_per_unit=0.1)))
