import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, UNKNOWN, GridPlan, Location
from pipeline.floorplans.readers import COMPANION, PLAN, READERS, classify, read_plan_file
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.readers.ros_map_server import RosMapServer
from pipeline.floorplans.sources import lone_file, open_source
from tests.floorplans.real_data import plan_files, read_entry
from tests.floorplans.samples import ELL, cells_of, write_map

CASES = Path(__file__).parents[3].parent / "shared" / "cases"
GREYS = np.array([[254, 254, 0], [205, 0, 254]], dtype=np.uint8)  # row 0 is the top
BELOW = [[UNKNOWN, OCCUPIED, FREE], [FREE, FREE, OCCUPIED]]  # row 0 is the lowest y


def read(path: Path) -> GridPlan:
    (plan,) = RosMapServer().read(path, ReadOptions())
    return plan


def test_a_map_is_turned_over_not_mirrored(tmp_path):
    drawn = cells_of(tuple(line.replace("d", ".").replace("c", "#") for line in ELL))
    plan = read(write_map(tmp_path / "lab", np.where(drawn[::-1] == FREE, 254, 0).astype(np.uint8)))
    assert np.array_equal(plan.cells, drawn)
    assert (plan.building, plan.plan_id, plan.source) == ("lab", "lab.map", "lab/map.yaml")
    assert (plan.origin, plan.resolution) == (Location(1.0, 2.0), 0.5)


def test_a_map_read_by_a_bare_name_still_has_its_folder(tmp_path, monkeypatch):
    write_map(tmp_path / "lab", GREYS)
    monkeypatch.chdir(tmp_path / "lab")
    plan = read(Path("map.yaml"))
    assert (plan.building, plan.plan_id) == ("lab", "lab.map")
    assert plan.cells.tolist() == BELOW


@pytest.mark.parametrize(
    ("yaw", "turned", "origin"),
    [
        ("0.01", BELOW, (1.0, 2.0)),
        ("1.5708", [[0, 2], [0, 1], [1, 0]], (0.0, 2.0)),
        ("3.14", [[1, 0, 0], [0, 1, 2]], (-0.5, 1.0)),
        ("-3.1416", [[1, 0, 0], [0, 1, 2]], (-0.5, 1.0)),
        ("-1.5708", [[0, 1], [1, 0], [2, 0]], (1.0, 0.5)),
        ("7.854", [[0, 2], [0, 1], [1, 0]], (0.0, 2.0)),
    ],
)
def test_quarter_turns_of_the_origin_turn_the_grid(tmp_path, yaw, turned, origin):
    plan = read(write_map(tmp_path / "lab", GREYS, origin=f"[1.0, 2.0, {yaw}]"))
    assert plan.cells.tolist() == turned
    assert plan.origin == pytest.approx(origin)


@pytest.mark.parametrize("quarters", [0, 1, 2, 3])
def test_a_turned_map_puts_each_pixel_where_the_pose_says(tmp_path, quarters):
    """Pixel (col, row from below) lies at origin + R(yaw) (col + 1/2, row + 1/2) resolution."""
    yaw = quarters * np.pi / 2
    plan = read(write_map(tmp_path / "lab", GREYS, origin=f"[1.0, 2.0, {yaw}]"))
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    for row, col in np.ndindex(2, 3):
        x, y = (1.0, 2.0) + turn @ (np.array([col + 0.5, row + 0.5]) * 0.5)
        i, j = int((y - plan.origin.y) // 0.5), int((x - plan.origin.x) // 0.5)
        assert plan.cells[i, j] == BELOW[row][col]


@pytest.mark.parametrize(
    ("changes", "shades", "expected"),
    [
        ({}, [254, 205, 100, 0], [FREE, UNKNOWN, UNKNOWN, OCCUPIED]),
        ({"negate": 1}, [0, 50, 100, 255], [FREE, UNKNOWN, UNKNOWN, OCCUPIED]),
        ({"negate": "true"}, [0, 50, 100, 255], [FREE, UNKNOWN, UNKNOWN, OCCUPIED]),
        ({"occupied_thresh": 0.5}, [254, 205, 100, 0], [FREE, UNKNOWN, OCCUPIED, OCCUPIED]),
        ({"free_thresh": 0.25}, [254, 205, 100, 0], [FREE, FREE, UNKNOWN, OCCUPIED]),
        ({"free_thresh": None, "occupied_thresh": None}, [254, 206, 205, 90, 89, 0], [0, 0, 2, 2, 1, 1]),
        ({"mode": "scale"}, [254, 205, 100, 0], [FREE, UNKNOWN, UNKNOWN, OCCUPIED]),
        ({"mode": "Trinary"}, [254, 205, 100, 0], [FREE, UNKNOWN, UNKNOWN, OCCUPIED]),
        ({"mode": "raw"}, [0, 50, 100, 255], [FREE, UNKNOWN, OCCUPIED, UNKNOWN]),
        ({"mode": "raw", "negate": 1}, [255, 205, 155, 0], [FREE, UNKNOWN, OCCUPIED, UNKNOWN]),
    ],
)
def test_modes_polarity_and_thresholds(tmp_path, changes, shades, expected):
    path = write_map(tmp_path / "lab", np.array([shades], dtype=np.uint8), **changes)
    assert read(path).cells.tolist() == [expected]


def test_colours_are_averaged_and_transparent_pixels_unknown(tmp_path):
    pixels = np.array([[[255, 255, 255, 255], [255, 255, 255, 0], [0, 0, 0, 255]]], dtype=np.uint8)
    assert read(write_map(tmp_path / "lab", pixels)).cells.tolist() == [[FREE, UNKNOWN, OCCUPIED]]


def test_a_map_may_be_free_up_to_its_border(tmp_path):
    assert (read(write_map(tmp_path / "lab", np.full((3, 4), 254, dtype=np.uint8))).cells == FREE).all()


UNSEEN = "grey 205 counts as free with free_thresh = {}: {} pixels. Map savers write it for what was not seen"


@pytest.mark.parametrize(
    ("stated", "given", "expected", "remarks"),
    [
        ({}, {}, [FREE, UNKNOWN, UNKNOWN, OCCUPIED, OCCUPIED], ()),
        ({"free_thresh": 0.25}, {}, [FREE, FREE, FREE, OCCUPIED, OCCUPIED], (UNSEEN.format("0.25", "2 of 5"),)),
        (
            {"free_thresh": 0.25},
            {"free_thresh": 0.196},
            [FREE, UNKNOWN, UNKNOWN, OCCUPIED, OCCUPIED],
            ("free_thresh = 0.25 of the file was replaced by 0.196",),
        ),
        (
            {},
            {"free_thresh": 0.3},
            [FREE, FREE, FREE, OCCUPIED, OCCUPIED],
            ("free_thresh = 0.196 of the file was replaced by 0.3", UNSEEN.format("0.3", "2 of 5")),
        ),
        (
            {"occupied_thresh": 0.7},
            {"occupied_thresh": 0.9},
            [FREE, UNKNOWN, UNKNOWN, UNKNOWN, OCCUPIED],
            ("occupied_thresh = 0.7 of the file was replaced by 0.9",),
        ),
        ({"free_thresh": 0.19, "mode": "scale"}, {}, [FREE, UNKNOWN, UNKNOWN, OCCUPIED, OCCUPIED], ()),
        ({"free_thresh": 0.25, "mode": "raw", "occupied_thresh": 0.65}, {}, [2, 2, 2, 2, 0], ()),
    ],
)
def test_grey_205_as_free_is_said_and_a_threshold_that_is_given_wins(tmp_path, stated, given, expected, remarks):
    path = write_map(tmp_path / "lab", np.array([[254, 205, 205, 30, 0]], dtype=np.uint8), **stated)
    (plan,) = RosMapServer().read(path, ReadOptions(**given))
    assert plan.cells.tolist() == [expected]
    assert len(plan.remarks) == len(remarks)
    assert all(said.startswith(begin) for said, begin in zip(plan.remarks, remarks, strict=True))


def test_grey_205_of_a_negated_map_is_50(tmp_path):
    shades = np.array([[0, 50, 205, 255]], dtype=np.uint8)
    plan = read(write_map(tmp_path / "lab", shades, negate=1, free_thresh=0.25))
    assert plan.cells.tolist() == [[FREE, FREE, OCCUPIED, OCCUPIED]]
    assert [remark.partition("pixels")[0] for remark in plan.remarks] == [
        "grey 205 counts as free with free_thresh = 0.25: 1 of 4 "
    ]


def test_a_given_threshold_that_contradicts_the_file_is_refused(tmp_path):
    path = write_map(tmp_path / "lab", GREYS, occupied_thresh=0.3)
    with pytest.raises(PlanError, match=r"free_thresh = 0\.4 is above occupied_thresh = 0\.3, of which one is given"):
        list(RosMapServer().read(path, ReadOptions(free_thresh=0.4)))


def test_a_map_with_tabs_and_the_header_of_opencv_is_read_and_says_so(tmp_path):
    path = write_map(tmp_path / "lab", GREYS)
    path.write_text("%YAML:1.0\n---\n" + path.read_text().replace(": ", ":\t"))
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["ros_map_server"]
    plan = read(path)
    assert plan.cells.tolist() == BELOW
    assert plan.remarks == (
        "its first line %YAML:1.0, which OpenCV writes, is not YAML and was passed over",
        "6 lines have tabs, which YAML forbids (line 3 first): read as spaces",
    )


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("image: map.png\nresolution: 0.05\norigin: [0, 0, 0\nnegate: 0\n", 4),
        ("image: map.png\nresolution: 0.05\n  origin: [0, 0, 0]\n", 3),
        ("resolution: 0.05\nimage: 'map.png\norigin: [0, 0, 0]\n", 4),
        ("image: map.png\nresolution:\t0.05\norigin: {\n", 2),
    ],
)
def test_a_map_in_damaged_yaml_is_known_and_its_line_named(tmp_path, text, line):
    (tmp_path / "map.yaml").write_text(text)
    (entry,) = classify([lone_file(tmp_path / "map.yaml")])
    assert (entry.role, entry.reader.name) == (PLAN, "ros_map_server")
    with pytest.raises(PlanError, match=rf"map\.yaml: not a readable YAML file \(line {line}: .*\)\. Mend it"):
        read(tmp_path / "map.yaml")


@pytest.mark.parametrize(
    "image", ["../pictures/map.png", "/home/robot/maps/map.png", "C:\\\\maps\\\\map.png", "./map.png"]
)
def test_the_picture_is_found_where_it_is_named_or_beside_the_file(tmp_path, image):
    path = write_map(tmp_path / "lab", GREYS, image=f'"{image}"')
    if image.startswith(".."):
        (tmp_path / "pictures").mkdir()
        (tmp_path / "lab" / "map.png").rename(tmp_path / "pictures" / "map.png")
    assert read(path).cells.tolist() == BELOW


# Bad files: (how to make it in the folder of map.yaml, what the message must say)
def _truncated_png(folder: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (80, 80)).astype(np.uint8)
    whole = (write_map(folder, noise).parent / "map.png").read_bytes()
    (folder / "map.png").write_bytes(whole[: len(whole) // 2])


def _truncated_pgm(folder: Path) -> None:
    write_map(folder, np.zeros((80, 80), np.uint8), picture="map.pgm")
    whole = (folder / "map.pgm").read_bytes()
    (folder / "map.pgm").write_bytes(whole[: len(whole) // 2])


def _wide_picture(folder: Path) -> None:
    write_map(folder, GREYS)
    (folder / "map.png").write_bytes(b"P5 50000 20000 255\n")


def _text_as_picture(folder: Path) -> None:
    write_map(folder, GREYS)
    (folder / "map.png").write_text("hello")


def _no_picture(folder: Path) -> None:
    write_map(folder, GREYS)
    (folder / "map.png").unlink()


def _text(content: str):
    return lambda folder: (folder / "map.yaml").write_text(content)


def _header(**changes):
    return lambda folder: write_map(folder, GREYS, **changes)


BAD = {
    "truncated PNG": (_truncated_png, "map.png: not a readable picture"),
    "truncated PGM": (_truncated_pgm, "map.pgm: not a readable picture"),
    "huge picture": (_wide_picture, "map.png: far too many pixels, at most 36,000,000 are read"),
    "not a picture": (_text_as_picture, "map.png: not a readable picture"),
    "no picture": (_no_picture, "image = map.png: no such picture beside the YAML file. Put it there."),
    "long name": (_header(image="a" * 5000), "no such picture beside the YAML file"),
    "a folder": (_header(image="."), "image = .: no such picture"),
    "a device": (_header(image="/dev/zero"), "image = /dev/zero: no such picture"),
    "without image": (_header(image=None), "image missing. A map needs image, resolution and origin."),
    "without origin": (_header(origin=None), "origin missing"),
    "without anything": (_text("mode: raw\n"), "image and resolution and origin missing"),
    "not YAML": (_text("image: [1, 2"), "not a readable YAML file"),
    "deep": (_text("[" * 40_000), "not a readable YAML file"),
    "impossible date": (_text("image: 2024-13-45\n"), "not a readable YAML file"),
    "object": (_text("image: !!python/object/apply:os.getcwd []\n"), "not a readable YAML file"),
    "long": (_text("# " + "a" * 60_000), "more than 50,000 bytes"),
    "aliases": (_text("a: &a [1, 1]\nimage: [*a, *a]\n"), "it refers to other parts of itself"),
    "no mapping": (_text("- 1"), "got list"),
    "resolution 0": (_header(resolution=0), "resolution = 0"),
    "resolution -1": (_header(resolution=-1), "resolution = -1"),
    "resolution NaN": (_header(resolution=".nan"), "resolution = nan"),
    "resolution huge": (_header(resolution="9" * 400), "resolution = "),
    "resolution text": (_header(resolution="fine"), "resolution = 'fine', expected a finite number"),
    "origin text": (_header(origin="here"), "origin = 'here', expected [x, y, yaw]"),
    "origin short": (_header(origin="[1]"), "origin = [1], expected [x, y, yaw]"),
    "origin NaN": (_header(origin="[1, .nan, 0]"), "origin = nan, expected a finite number"),
    "skew yaw": (_header(origin="[0, 0, 0.5]"), "origin has a yaw of 28.6 degrees"),
    "swapped": (_header(free_thresh=0.9), "free_thresh = 0.9, occupied_thresh = 0.65; expected 0 <= free"),
    "per cent": (_header(occupied_thresh=65), "occupied_thresh = 65"),
    "mode": (_header(mode="blue"), "mode = blue, expected one of trinary, scale, raw"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_map_gives_one_clear_error(tmp_path, case):
    make, message = BAD[case]
    make(tmp_path)
    with pytest.raises(PlanError) as refusal:
        read_plan_file(tmp_path / "map.yaml", "ros_map_server")
    assert str(refusal.value).startswith(f"{tmp_path / 'map.yaml'}: ")
    assert message in str(refusal.value)
    assert len(str(refusal.value)) < 600


def test_a_yaml_file_runs_no_code(tmp_path):
    trace = tmp_path / "trace"
    (tmp_path / "map.yaml").write_text(f"image: !!python/object/apply:os.mkdir ['{trace}']\n")
    assert not RosMapServer().sniff(tmp_path / "map.yaml")
    with pytest.raises(PlanError):
        read(tmp_path / "map.yaml")
    assert not trace.exists()


def test_the_picture_and_other_yaml_accompany_a_map(tmp_path):
    path = write_map(tmp_path, GREYS)
    (tmp_path / "doors.yaml").write_text("doors: [1, 2]\n")
    files = [lone_file(tmp_path / name) for name in ("map.yaml", "map.png", "doors.yaml")]
    assert [entry.role for entry in classify(files)] == [PLAN, COMPANION, COMPANION]
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["ros_map_server"]


@pytest.mark.parametrize("mask", ["map_keepout", "map-nogo", "other.limit", "keepout_mask", "mask", "Map_KeepOut"])
def test_a_mask_accompanies_a_map_and_is_read_where_there_is_none(tmp_path, mask):
    write_map(tmp_path, GREYS).rename(tmp_path / f"{mask}.yaml")
    alone = lone_file(tmp_path / f"{mask}.yaml")
    assert [entry.role for entry in classify([alone])] == [PLAN]
    write_map(tmp_path, GREYS)
    assert [entry.role for entry in classify([alone, lone_file(tmp_path / "map.yaml")])] == [COMPANION, PLAN]


@pytest.mark.parametrize("name", ["no_limits", "masked", "map_localization", "nogood"])
def test_a_map_with_another_name_is_no_mask(tmp_path, name):
    write_map(tmp_path, GREYS).rename(tmp_path / f"{name}.yaml")
    write_map(tmp_path, GREYS)
    assert not RosMapServer().accompanies(tmp_path / f"{name}.yaml")


@pytest.mark.parametrize(
    "content", [b"", b"\xff\xfe", b"[" * 40_000, b"image: 2024-13-45", b"- image: a", b"a" * 60_000]
)
def test_foreign_files_are_not_taken_for_maps(tmp_path, content):
    (tmp_path / "a.yaml").write_bytes(content)
    assert not RosMapServer().sniff(tmp_path / "a.yaml")
    assert not RosMapServer().sniff(tmp_path / f"missing{os.sep}a.yaml")


@pytest.mark.parametrize(
    ("case", "options", "remark"),
    [
        ("16_picture_of_a_map_twice/win_path", {}, None),
        ("17_ros2_free_thresh/free025", {"free_thresh": 0.196}, "free_thresh = 0.25 of the file was replaced by 0.196"),
        ("22_messages/tab", {}, "6 lines have tabs, which YAML forbids (line 1 first): read as spaces"),
    ],
)
def test_reported_maps_give_their_right_values(case, options, remark):
    folder = CASES / case
    if not folder.is_dir():
        pytest.skip(f"{folder} is absent")
    with open_source(folder) as files:
        (entry,) = [entry for entry in classify(files) if entry.role == PLAN]
        (plan,) = read_entry(entry, ReadOptions(**options))
    assert (plan.cells == FREE).sum() * plan.resolution**2 == pytest.approx(52.84)
    assert plan.remarks == ((remark,) if remark else ())


def test_real_maps_lie_where_their_origin_says():
    with plan_files("ros_slam_maps") as entries:
        maps = [entry for entry in entries if entry.reader.name == "ros_map_server"]
        assert len(maps) > 15
        assert not any("nogo" in entry.file.name for entry in maps)
        for entry in maps[::7]:
            (plan,) = read_entry(entry)
            assert 0.02 <= plan.resolution <= 0.25
            assert 0 < (plan.cells == OCCUPIED).mean() < 0.5
            assert (plan.cells == FREE).any()


def test_a_real_map_with_a_half_turn_is_turned():
    with plan_files("ros_slam_maps") as entries:
        (entry,) = [entry for entry in entries if "mit_stata" in entry.file.name and entry.file.path.suffix == ".yaml"]
        (plan,) = read_entry(entry)
        picture = next(path for path in entry.file.path.parent.iterdir() if path.suffix in (".png", ".pgm"))
        with Image.open(picture) as opened:
            grey = np.asarray(opened.convert("RGB")).mean(axis=2)
        assert "3.14" in entry.file.path.read_text()
        # Turned by half a turn, the top row of the picture is the lowest of the grid, read from right to left.
        assert np.array_equal(plan.cells == OCCUPIED, (grey < 89.25)[:, ::-1])
