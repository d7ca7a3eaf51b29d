import numpy as np
import pytest
from PIL import Image

from pipeline.floorplans.readers import COMPANION, PLAN, UNRECOGNISED, classify, read_plan_file
from pipeline.floorplans.readers.map_pictures import find_picture, pictures_named_by
from pipeline.floorplans.sources import open_source
from tests.floorplans.samples import write_map

GREYS = np.array([[254, 254, 0, 0], [205, 0, 254, 0]], dtype=np.uint8)

# What the YAML at set/maps/map.yaml says, and where the picture lies below set.
NAMED = {
    "beside": ("map.pgm", "maps/map.pgm"),
    "Windows drive": (r"C:\maps\map.pgm", "maps/map.pgm"),
    "Windows drive, in quotes": (r'"C:\new\maps\map.pgm"', "maps/map.pgm"),
    "Windows drive, escaped": (r'"C:\\maps\\map.pgm"', "maps/map.pgm"),
    "Windows drive with slashes": ("D:/data/map.pgm", "maps/map.pgm"),
    "Windows share": (r"\\server\maps\map.pgm", "maps/map.pgm"),
    "Windows, relative": (r"maps\map.pgm", "maps/map.pgm"),
    "Windows, below": (r"img\floor 2\map.pgm", "maps/img/floor 2/map.pgm"),
    "Windows, upward": (r"..\img\map.pgm", "img/map.pgm"),
    "Windows, in other capitals": (r"C:\Maps\MAP.PGM", "maps/Map.pgm"),
    "Windows drive, beside the folder": (r"C:\ws\img\map.pgm", "img/map.pgm"),
    "upward": ("../img/map.pgm", "img/map.pgm"),
    "upward, in quotes": ("'../img/map.pgm'", "img/map.pgm"),
    "upward twice": ("../../set/img/map.pgm", "img/map.pgm"),
    "another machine": ("/home/robot/maps/map.pgm", "maps/map.pgm"),
    "another machine, below": ("/home/robot/img/map.pgm", "maps/img/map.pgm"),
    "a package": ("package://demo/maps/map.pgm", "maps/map.pgm"),
}


def write_set(tmp_path, named: str, place: str):
    """A map in one folder, its picture in another or the same, and a picture of its own with the same pixels."""
    root = tmp_path / "set"
    write_map(root / "maps", GREYS, image=named)
    (root / "maps" / "map.png").unlink()
    picture = root / place
    for path in (picture, root / "other" / "own.pgm"):
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(GREYS).save(path, format="PPM")
    return root, picture


@pytest.mark.parametrize("case", NAMED)
def test_a_map_finds_its_picture_which_is_no_plan_of_its_own(tmp_path, case):
    named, place = NAMED[case]
    root, picture = write_set(tmp_path, named, place)
    (plan,) = read_plan_file(root / "maps" / "map.yaml")
    assert plan.cells.tolist() == [[2, 1, 0, 1], [0, 0, 1, 1]]
    with open_source(root) as files:
        roles = {entry.file.name: entry.role for entry in classify(files)}
        by_name = {entry.file.name: entry.role for entry in classify(files, "raster_picture")}
    assert roles == {"maps/map.yaml": PLAN, place: COMPANION, "other/own.pgm": PLAN}
    assert by_name == {"maps/map.yaml": UNRECOGNISED, place: COMPANION, "other/own.pgm": PLAN}
    assert pictures_named_by([root / "maps" / "map.yaml"]) == {picture.resolve()}


def test_the_picture_at_the_longest_end_of_the_path_is_taken(tmp_path):
    for place in ("map.pgm", "lab/map.pgm"):
        (tmp_path / place).parent.mkdir(exist_ok=True)
        (tmp_path / place).write_bytes(b"P5")
    assert find_picture(tmp_path / "map.yaml", r"C:\all\lab\map.pgm") == tmp_path / "lab" / "map.pgm"
    assert find_picture(tmp_path / "map.yaml", r"C:\all\hall\map.pgm") == tmp_path / "map.pgm"


def test_the_picture_of_a_damaged_map_is_still_its_own(tmp_path):
    (tmp_path / "map.yaml").write_text("image: map.pgm\nresolution: [0.05\n")
    (tmp_path / "map.pgm").write_bytes(b"P5 1 1 255\n\0")
    assert pictures_named_by([tmp_path / "map.yaml"]) == {(tmp_path / "map.pgm").resolve()}


@pytest.mark.parametrize("named", ["", ".", "..", "\\", "C:\\", "a\0b", "a" * 5000, "a/" * 20_000, "MAP.pgm/x"])
def test_no_picture_is_no_picture(tmp_path, named):
    (tmp_path / "map.pgm").write_bytes(b"P5")
    assert find_picture(tmp_path / "map.yaml", named) is None


def test_of_two_names_that_differ_in_capitals_none_is_guessed(tmp_path):
    for name in ("Map.pgm", "MAP.pgm"):
        (tmp_path / name).write_bytes(b"P5")
    assert find_picture(tmp_path / "map.yaml", r"C:\map.pgm") is None
    assert find_picture(tmp_path / "map.yaml", r"C:\Map.pgm") == tmp_path / "Map.pgm"
