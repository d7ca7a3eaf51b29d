import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, UNKNOWN, GridPlan, Location
from pipeline.floorplans.readers import COMPANION, PLAN, READERS, classify, read_plan_file
from pipeline.floorplans.readers.raster_picture import NOTE, RasterPicture
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.sources import lone_file
from tests.floorplans.real_data import largest_share, plan_files, read_entry
from tests.floorplans.samples import ELL, cells_of, write_map

GREYS = np.array([[255, 255, 0], [128, 0, 255]], dtype=np.uint8)  # row 0 is the top
BELOW = [[UNKNOWN, OCCUPIED, FREE], [FREE, FREE, OCCUPIED]]  # row 0 is the lowest y


def write(path: Path, grey: np.ndarray = GREYS, note: object = None) -> Path:
    texts = PngInfo()
    if note is not None:
        texts.add_text(NOTE, note if isinstance(note, str) else json.dumps(note))
    Image.fromarray(grey).save(path, **({"pnginfo": texts} if path.suffix == ".png" else {}))
    return path


def read(path: Path, **options) -> GridPlan:
    (plan,) = RasterPicture().read(path, ReadOptions(**{"metres_per_unit": 0.05, **options}))
    return plan


@pytest.mark.parametrize("name", ["lab.furnished.png", "lab.furnished.pgm", "lab.furnished.bmp", "lab.furnished.tif"])
def test_a_picture_is_turned_over_not_mirrored(tmp_path, name):
    drawn = cells_of(tuple(line.replace("d", ".").replace("c", "#") for line in ELL))
    plan = read(write(tmp_path / name, np.where(drawn[::-1] == FREE, 255, 0).astype(np.uint8)))
    assert np.array_equal(plan.cells, drawn)
    assert (plan.plan_id, plan.building, plan.floor) == ("lab.furnished", "lab", "lab")
    assert (plan.resolution, plan.origin) == (0.05, Location(0.0, 0.0))


def test_white_is_free_black_occupied_and_grey_unknown(tmp_path):
    assert read(write(tmp_path / "a.png")).cells.tolist() == BELOW


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({}, [0, 2, 2, 2, 1, 1]),
        ({"invert": True}, [1, 1, 2, 2, 2, 0]),
        ({"free_thresh": 0.25}, [0, 0, 2, 2, 1, 1]),
        ({"free_thresh": 0.1}, [0, 2, 2, 2, 1, 1]),
        ({"occupied_thresh": 0.5}, [0, 2, 2, 1, 1, 1]),
        ({"free_thresh": 0.5, "occupied_thresh": 0.5}, [0, 0, 0, 1, 1, 1]),
        ({"invert": True, "free_thresh": 0.1}, [1, 1, 2, 2, 2, 0]),
    ],
)
def test_thresholds_and_inversion(tmp_path, options, expected):
    shades = np.array([[255, 205, 150, 100, 50, 0]], dtype=np.uint8)
    assert read(write(tmp_path / "a.png", shades), **options).cells.tolist() == [expected]


def test_the_grey_that_robots_leave_unseen_is_unknown_and_scanned_paper_free(tmp_path):
    shades = np.array([[255, 254, 230, 206, 205, 0]], dtype=np.uint8)
    assert read(write(tmp_path / "a.png", shades)).cells.tolist() == [[FREE] * 4 + [UNKNOWN, OCCUPIED]]


@pytest.mark.parametrize(
    "saved",
    [
        {},
        {"compression": "tiff_lzw"},
        {"big_tiff": True},
        {"save_all": True, "append_images": [Image.new("L", (3, 2))]},
    ],
)
def test_tiff_is_found_by_its_content_and_its_first_page_is_read(tmp_path, saved):
    Image.fromarray(GREYS).save(tmp_path / "scan.tiff", **saved)
    (tmp_path / "scan.tiff").rename(tmp_path / "scan")
    (plan,) = read_plan_file(tmp_path / "scan", options=ReadOptions(metres_per_unit=0.05))
    assert plan.cells.tolist() == BELOW


def test_transparent_pixels_are_unknown_also_when_inverted(tmp_path):
    pixels = np.array([[[255, 255], [255, 0], [0, 0], [0, 255]]], dtype=np.uint8)
    Image.fromarray(pixels, mode="LA").save(tmp_path / "a.png")
    assert read(tmp_path / "a.png").cells.tolist() == [[FREE, UNKNOWN, UNKNOWN, OCCUPIED]]
    assert read(tmp_path / "a.png", invert=True).cells.tolist() == [[OCCUPIED, UNKNOWN, UNKNOWN, FREE]]


def test_a_missing_scale_is_refused_with_the_key_to_set(tmp_path):
    path = write(tmp_path / "a.png")
    with pytest.raises(PlanError) as refusal:
        read_plan_file(path)
    assert str(refusal.value) == (
        f"{path}: a picture has no scale, expected the size of a pixel. "
        "Give it: plans.read.metres_per_unit=0.05, or --scale 0.05"
    )


NOTED = {"metres_per_pixel": 0.1, "origin_m": [-3.5, 2], "rows": 2, "cols": 3}


def test_a_note_gives_scale_and_place_unless_a_person_does(tmp_path):
    path = write(tmp_path / "a.png", note=NOTED)
    noted, given = read(path, metres_per_unit=None), read(path, metres_per_unit=0.2)
    assert (noted.resolution, noted.origin) == (0.1, Location(-3.5, 2.0))
    assert (given.resolution, given.origin) == (0.2, Location(0.0, 0.0))
    assert noted.cells.tolist() == given.cells.tolist() == BELOW


@pytest.mark.parametrize(
    ("note", "message"),
    [
        (NOTED | {"rows": 4}, "its note of the scale is of a picture of another size, expected the size of a pixel"),
        (NOTED | {"metres_per_pixel": "fine"}, "metres_per_pixel is 'fine', expected a number"),
        (NOTED | {"origin_m": [0, float("nan")]}, "origin_m: a coordinate is not finite"),
        ({"rows": 2, "cols": 3}, "origin_m: a point is not a list"),
        ("[" * 5000, "nested too deeply"),
        ("[1]", "is 'a list of 1', expected a mapping"),
        ("{", "not whole JSON"),
    ],
)
def test_a_damaged_note_is_refused_and_passed_over_where_a_scale_is_given(tmp_path, note, message):
    path = write(tmp_path / "a.png", note=note)
    with pytest.raises(PlanError) as refusal:
        read(path, metres_per_unit=None)
    assert str(refusal.value).startswith(f"{path}: ")
    assert message in str(refusal.value)
    assert read(path).resolution == 0.05


@pytest.mark.parametrize("yaml", ["image: map.png", 'image: "maps/map.png"  # saved', "{image: map.png, negate: 0}"])
def test_a_picture_that_a_map_names_is_part_of_the_map(tmp_path, yaml):
    for name in ("map.png", "big_map.png", "map.png.png"):
        write(tmp_path / name)
    (tmp_path / "map.yaml").write_text(f"{yaml}\n")
    found = {name: RasterPicture().accompanies(tmp_path / name) for name in ("map.png", "big_map.png", "map.png.png")}
    assert found == {"map.png": True, "big_map.png": False, "map.png.png": False}


def test_a_picture_beside_a_map_of_another_is_a_plan(tmp_path):
    write_map(tmp_path, np.zeros((3, 3), np.uint8), picture="one.png")
    files = [lone_file(write(tmp_path / "two.png")), lone_file(tmp_path / "one.png")]
    assert [entry.role for entry in classify(files)] == [PLAN, COMPANION]


@pytest.mark.parametrize("name", ["a_keepout.png", "a.groundtruth.png", "a-nogo.pgm", "a_limit.pgm"])
def test_masks_and_ground_truth_are_no_plans(tmp_path, name):
    assert RasterPicture().accompanies(write(tmp_path / name))


def test_an_image_beside_a_description_of_rooms_is_no_plan(tmp_path):
    path = write(tmp_path / "floor_image.png")
    assert not RasterPicture().accompanies(path)
    (tmp_path / "floor_info.json").write_text("{}")
    assert RasterPicture().accompanies(path)


@pytest.mark.parametrize("content", [b"", b"P5-2 is a room", b"BM as well as any text", b"P51 9 9", b"GIF"])
def test_texts_are_not_taken_for_pictures(tmp_path, content):
    (tmp_path / "a.txt").write_bytes(content)
    assert not RasterPicture().sniff(tmp_path / "a.txt")


def test_any_picture_is_asked_last(tmp_path):
    assert [name for name, reader in READERS.items() if reader.sniff(write(tmp_path / "a.png"))] == ["raster_picture"]
    assert list(READERS)[-1] == "raster_picture"


def test_real_vacuum_maps_are_inverted():
    with plan_files("neato_homes") as entries:
        for entry in entries[::15]:
            (plan,) = read_entry(entry, ReadOptions(metres_per_unit=0.04, invert=True))
            assert plan.building == entry.file.path.stem
            area = (plan.cells == FREE).sum() * plan.resolution**2
            assert 20 < area < 700
            assert (plan.cells == UNKNOWN).mean() > 0.8
            assert largest_share(plan) > 0.5


def test_real_benchmark_pictures_are_floors_that_furniture_makes_smaller():
    with plan_files("bormann_room_segmentation") as entries:
        assert not any("groundtruth" in entry.file.name for entry in entries)
        by_name = {entry.file.path.name: entry for entry in entries}
        for name in ("04_lab_a", "13_office_b"):
            furnished, bare = (
                read_entry(by_name[f"{name}.{variant}.png"], ReadOptions(metres_per_unit=0.05))[0]
                for variant in ("furnished", "no_furniture")
            )
            assert bare.building == furnished.building == name.partition("_")[2]
            assert largest_share(bare) > 0.9
            assert 0.5 < (furnished.cells == FREE).sum() / (bare.cells == FREE).sum() < 1
