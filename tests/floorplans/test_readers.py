import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from pipeline.errors import PlanError
from pipeline.floorplans.plan import CLUTTER, FREE, OCCUPIED, UNKNOWN, Door, Location
from pipeline.floorplans.readers import READERS, find_plan_files, read_plan_file
from pipeline.floorplans.readers import picture as picture_module
from pipeline.floorplans.readers.ros_map_server import write_ros_map
from tests.floorplans.samples import ELL, KNOWN, cells_of, grid_plan, write_map, write_npz

GREYS = np.array([[254, 254, 0], [205, 0, 254]], dtype=np.uint8)  # row 0 is the top
BELOW = [[UNKNOWN, OCCUPIED, FREE], [FREE, FREE, OCCUPIED]]  # row 0 is the lowest y


def test_an_mit_floor_is_read_as_drawn(tmp_path):
    (plan,) = read_plan_file(write_npz(tmp_path / "W1-2_17.npz"))
    assert (plan.plan_id, plan.floor, plan.building) == ("W1-2_17", "W1-2", "MIT-W1")
    assert plan.resolution == 0.5
    assert np.array_equal(plan.cells, cells_of(tuple(line.replace("d", ".") for line in ELL)))
    assert (plan.cells == CLUTTER).sum() == 1
    (door,) = plan.doors
    assert door == Door(6.5 * 0.5, 4.5 * 0.5, 1.5)


@pytest.mark.parametrize("place", ["beside", "above"])
def test_the_building_of_a_manifest_wins(tmp_path, place):
    folder = tmp_path / "dev"
    path = write_npz(folder / "W1-2_17.npz")
    manifest = (folder if place == "beside" else tmp_path) / "manifest_dev.csv"
    manifest.write_text("file,building\nW1-2_17.npz,MIT-WALKER\n")
    assert read_plan_file(path)[0].building == "MIT-WALKER"


def test_a_manifest_names_a_map_by_its_picture(tmp_path):
    path = write_map(tmp_path / "gates", GREYS)
    (tmp_path / "manifest_dev.csv").write_text("file,member,building\nmaps.zip,gates/map.png,ut-gdc\n")
    assert read_plan_file(path)[0].building == "ut-gdc"


def test_a_manifest_without_buildings_is_an_error(tmp_path):
    path = write_npz(tmp_path / "a-1_2.npz")
    (tmp_path / "manifest_dev.csv").write_text("file,floor\na-1_2.npz,1\n")
    with pytest.raises(PlanError, match="no column 'building', found file, floor"):
        read_plan_file(path)


def test_a_ros_map_is_turned_over(tmp_path):
    (plan,) = read_plan_file(write_map(tmp_path / "lab", GREYS))
    assert plan.cells.tolist() == BELOW
    assert (plan.building, plan.plan_id, plan.origin, plan.resolution) == ("lab", "lab.map", Location(1.0, 2.0), 0.5)


@pytest.mark.parametrize(
    ("yaw", "turned", "origin"),
    [
        ("0.01", BELOW, (1.0, 2.0)),
        ("1.5708", [[0, 2], [0, 1], [1, 0]], (0.0, 2.0)),
        ("3.14", [[1, 0, 0], [0, 1, 2]], (-0.5, 1.0)),
        ("-3.1416", [[1, 0, 0], [0, 1, 2]], (-0.5, 1.0)),
        ("-1.5708", [[0, 1], [1, 0], [2, 0]], (1.0, 0.5)),
    ],
)
def test_quarter_turns_of_the_origin_turn_the_grid(tmp_path, yaw, turned, origin):
    (plan,) = read_plan_file(write_map(tmp_path / "lab", GREYS, origin=f"[1.0, 2.0, {yaw}]"))
    assert plan.cells.tolist() == turned
    assert plan.origin == pytest.approx(origin)


@pytest.mark.parametrize(
    ("changes", "shades", "expected"),
    [
        ({}, [254, 205, 100, 0], [FREE, UNKNOWN, UNKNOWN, OCCUPIED]),
        ({"negate": 1}, [0, 50, 100, 255], [FREE, UNKNOWN, UNKNOWN, OCCUPIED]),
        ({"occupied_thresh": 0.5}, [254, 205, 100, 0], [FREE, UNKNOWN, OCCUPIED, OCCUPIED]),
        ({"free_thresh": 0.25}, [254, 205, 100, 0], [FREE, FREE, UNKNOWN, OCCUPIED]),
        ({"mode": "scale"}, [254, 205, 100, 0], [FREE, UNKNOWN, UNKNOWN, OCCUPIED]),
        ({"mode": "raw"}, [0, 50, 100, 255], [FREE, UNKNOWN, OCCUPIED, UNKNOWN]),
    ],
)
def test_modes_and_thresholds(tmp_path, changes, shades, expected):
    path = write_map(tmp_path / "lab", np.array([shades], dtype=np.uint8), **changes)
    assert read_plan_file(path)[0].cells.tolist() == [expected]


def test_colours_are_averaged_and_transparent_pixels_unknown(tmp_path):
    pixels = np.array([[[255, 255, 255, 255], [255, 255, 255, 0], [0, 0, 0, 255]]], dtype=np.uint8)
    assert read_plan_file(write_map(tmp_path / "lab", pixels))[0].cells.tolist() == [[FREE, UNKNOWN, OCCUPIED]]


@settings(max_examples=25, deadline=None)
@given(
    arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.integers(0, 2)),
    st.floats(-1e4, 1e4),
    st.floats(0.01, 1.0),
)
def test_writing_and_reading_a_ros_map_keeps_it(tmp_path_factory, cells, x, resolution):
    path = tmp_path_factory.mktemp("map") / "floor.yaml"
    plan = grid_plan(KNOWN, cells=cells, resolution=resolution, origin=Location(x, -x / 3))
    write_ros_map(plan, path)
    (again,) = read_plan_file(path)
    assert np.array_equal(again.cells, cells)
    assert (again.resolution, again.origin) == (resolution, plan.origin)


def test_furniture_is_written_as_occupied(tmp_path):
    plan = grid_plan(KNOWN)
    write_ros_map(plan, tmp_path / "floor.yaml")
    cells = read_plan_file(tmp_path / "floor.yaml")[0].cells
    assert np.array_equal(cells, np.where(plan.cells == CLUTTER, OCCUPIED, plan.cells))


# Bad files: (name of the file, how to make it, what the message must say)
def _truncated_png(path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (80, 80)).astype(np.uint8)
    write_map(path.parent, noise)
    whole = (path.parent / "map.png").read_bytes()
    (path.parent / "map.png").write_bytes(whole[: len(whole) // 2])


def _wide_picture(path: Path) -> None:
    write_map(path.parent, GREYS)
    Image.new("1", (50_000, 20_000)).save(path.parent / "map.png")


def _cut_npz(path: Path) -> None:
    whole = write_npz(path).read_bytes()
    path.write_bytes(whole[: len(whole) // 2])


def _broken_layer(path: Path) -> None:
    whole = bytearray(write_npz(path).read_bytes())
    start = whole.index(b"occ_grid.npy") + 14
    whole[start : start + 20] = b"\x00" * 20
    path.write_bytes(bytes(whole))


BAD = {
    "missing file": ("no.npz", lambda path: None, "no such file"),
    "object array": ("a.npz", lambda path: write_npz(path, occ_grid=np.array([{}], object)), "holds pickled objects"),
    "bare pickle": ("a.npz", lambda path: path.write_bytes(pickle.dumps({"occ_grid": 1})), "holds pickled objects"),
    "cut npz": ("a.npz", _cut_npz, "not a readable npz"),
    "broken layer": ("a.npz", _broken_layer, "a.npz"),
    "no layer": ("a.npz", lambda path: write_npz(path, resolution=None), "layers resolution are missing"),
    "other shape": ("a.npz", lambda path: write_npz(path, semantic_grid=np.zeros((2, 2))), "two grids of one shape"),
    "NaN grid": ("a.npz", lambda path: write_npz(path, occ_grid=np.full((8, 13), np.nan)), "not finite"),
    "NaN resolution": ("a.npz", lambda path: write_npz(path, resolution=np.float64("nan")), "not finite"),
    "empty grid": (
        "a.npz",
        lambda path: write_npz(path, occ_grid=np.zeros((0, 3)), semantic_grid=np.zeros((0, 3))),
        "at least one cell",
    ),
    "truncated PNG": ("map.yaml", _truncated_png, "map.png: not a readable picture"),
    "huge PNG": ("map.yaml", _wide_picture, "pixels, at most 36,000,000 are read"),
    "not a picture": (
        "map.yaml",
        lambda path: (write_map(path.parent, GREYS), (path.parent / "map.png").write_text("hello")),
        "map.png: not a readable picture",
    ),
    "no picture": (
        "map.yaml",
        lambda path: (write_map(path.parent, GREYS), (path.parent / "map.png").unlink()),
        "image = map.png: no such picture",
    ),
    "YAML without image": ("map.yaml", lambda path: write_map(path.parent, GREYS, image=None), "image missing"),
    "YAML without origin": ("map.yaml", lambda path: write_map(path.parent, GREYS, origin=None), "origin missing"),
    "not YAML": ("map.yaml", lambda path: path.write_text("image: [1, 2"), "not a readable YAML file"),
    "no mapping": ("map.yaml", lambda path: path.write_text("- 1"), "got list"),
    "resolution 0": ("map.yaml", lambda path: write_map(path.parent, GREYS, resolution=0), "resolution = 0"),
    "resolution -1": ("map.yaml", lambda path: write_map(path.parent, GREYS, resolution=-1), "resolution = -1"),
    "resolution NaN": ("map.yaml", lambda path: write_map(path.parent, GREYS, resolution=".nan"), "resolution = nan"),
    "resolution text": (
        "map.yaml",
        lambda path: write_map(path.parent, GREYS, resolution="fine"),
        "resolution = 'fine'",
    ),
    "origin text": ("map.yaml", lambda path: write_map(path.parent, GREYS, origin="here"), "origin = 'here'"),
    "skew yaw": ("map.yaml", lambda path: write_map(path.parent, GREYS, origin="[0, 0, 0.5]"), "yaw of 28.6 degrees"),
    "swapped": ("map.yaml", lambda path: write_map(path.parent, GREYS, free_thresh=0.9), "free_thresh = 0.9"),
    "mode": ("map.yaml", lambda path: write_map(path.parent, GREYS, mode="blue"), "mode = blue, expected one of"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_gives_one_clear_error(tmp_path, case):
    name, make, message = BAD[case]
    path = tmp_path / name
    make(path)
    reader = "mit_campus_grids" if path.suffix == ".npz" else "ros_map_server"
    with pytest.raises(PlanError) as refusal:
        read_plan_file(path, reader)
    assert message in str(refusal.value)
    assert str(tmp_path) in str(refusal.value)


def test_the_size_of_a_picture_is_checked_before_it_is_read(tmp_path, monkeypatch):
    path = write_map(tmp_path / "lab", np.zeros((20, 20), dtype=np.uint8))
    monkeypatch.setattr(picture_module, "MOST_PIXELS", 399)
    with pytest.raises(PlanError, match="20 x 20 pixels, at most 399 are read"):
        read_plan_file(path)


def test_the_content_decides_which_reader_is_taken(tmp_path):
    write_npz(tmp_path / "a-1_2.npz")
    write_map(tmp_path / "lab", GREYS)
    (tmp_path / "doors.yaml").write_text("doors: [1, 2]\n")
    found = {
        path.name: [name for name, reader in READERS.items() if reader.sniff(path)]
        for path in find_plan_files(tmp_path)
    }
    assert found == {"a-1_2.npz": ["mit_campus_grids"], "doors.yaml": [], "map.yaml": ["ros_map_server"]}
    with pytest.raises(PlanError, match=r"doors.yaml: not recognised as mit_campus_grids or ros_map_server"):
        read_plan_file(tmp_path / "doors.yaml")


def test_searching_says_where_nothing_was_found(tmp_path):
    with pytest.raises(PlanError, match="nowhere: no such folder or file"):
        find_plan_files(tmp_path / "nowhere")
    with pytest.raises(PlanError, match=r"no \*.npz in this folder"):
        find_plan_files(tmp_path, "mit_campus_grids")
    with pytest.raises(PlanError, match=r"plans.reader = dxf: no such reader. Choose one of mit_campus_grids"):
        find_plan_files(tmp_path, "dxf")


def test_real_floors_read_and_keep_their_doors(mit_folder):
    (plan,) = read_plan_file(mit_folder / "24-1_1010.npz")
    assert plan.building == "MIT-24"
    assert len(plan.doors) == 33
    assert 0.9 <= np.median([door.width for door in plan.doors]) <= 1.2
