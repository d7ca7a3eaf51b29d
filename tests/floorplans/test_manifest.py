import gzip
import os
from pathlib import Path

import pytest

from pipeline.errors import PlanError
from pipeline.floorplans import manifest as manifest_module
from pipeline.floorplans.manifest import find_manifest
from pipeline.floorplans.readers import COMPANION, READERS, UNRECOGNISED, classify, read_plan_file, read_plans
from pipeline.floorplans.sources import lone_file, open_source
from tests.floorplans.archive_samples import pack
from tests.floorplans.real_data import dev_folder
from tests.floorplans.samples import write_npz


def table(folder: Path, *lines: str, name: str = "manifest_dev.csv", encoding: str = "utf-8") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text("\n".join(lines) + "\n", encoding=encoding)
    return folder


def building(file: Path, plan_id: str = "p") -> str | None:
    found = find_manifest(lone_file(file))
    return None if found is None else found.building_of(plan_id)


@pytest.mark.parametrize("place", [".", "..", "../.."])
def test_a_manifest_beside_or_above_a_file_says_its_building(tmp_path, place):
    folder = tmp_path / "set" / "dev"
    path = write_npz(folder / "W1-2_17.npz")
    table((folder / place).resolve(), "file,building", "W1-2_17.npz,MIT-WALKER")
    assert read_plan_file(path)[0].building == "MIT-WALKER"


def test_the_nearest_manifest_counts(tmp_path):
    table(tmp_path, "file,building", "a.npz,far")
    table(tmp_path / "dev", "file,building", "a.npz,near")
    assert building(tmp_path / "dev" / "a.npz") == "near"
    assert building(tmp_path / "a.npz") == "far"


def test_without_a_manifest_or_a_line_nothing_is_said(tmp_path):
    assert find_manifest(lone_file(tmp_path / "a.npz")) is None
    table(tmp_path, "file,building", "b.npz,other")
    assert building(tmp_path / "a.npz") is None


@pytest.mark.parametrize("file", ["gates/map.yaml", "gates/map.png", "maps.zip/gates/map.yaml"])
def test_a_line_names_a_map_by_its_picture_inside_an_archive(tmp_path, file):
    table(tmp_path, "file,member,building", "maps.zip,gates/map.png,ut-gdc")
    assert building(tmp_path / file) == "ut-gdc"


def test_equal_members_of_two_archives_are_told_apart(tmp_path):
    table(tmp_path, "file,member,building", "a.zip,lab/map.png,one", "b.zip,lab/map.png,two")
    assert building(tmp_path / "a.zip" / "lab" / "map.png") == "one"
    assert building(tmp_path / "b.zip" / "lab" / "map.png") == "two"
    assert building(tmp_path / "c.zip" / "lab" / "map.png") is None


def test_a_folder_whose_lines_agree_speaks_for_its_other_files(tmp_path):
    table(
        tmp_path,
        "file,member,building",
        "m.zip,lab/one.png,B",
        "m.zip,lab/two.png,B",
        "m.zip,mix/a.png,1",
        "m.zip,mix/b.png,2",
    )
    assert building(tmp_path / "m.zip" / "lab" / "third.yaml") == "B"
    assert building(tmp_path / "m.zip" / "mix" / "third.yaml") is None


@pytest.mark.parametrize(
    ("line", "expected"), [("a.npz,B,V,H", "B"), ("a.npz,,V,H", "V"), ("a.npz,,,H", "H"), ("a.npz,,,", None)]
)
def test_building_goes_before_venue_and_home(tmp_path, line, expected):
    table(tmp_path, "file,building,venue,home", line)
    assert building(tmp_path / "a.npz") == expected


def test_a_record_of_a_file_with_many_is_found_by_its_id(tmp_path):
    table(tmp_path, "file,id,building", "houses.jsonl,h1,one", "houses.jsonl,h2,two")
    assert building(tmp_path / "houses.jsonl", "h1") == "one"
    assert building(tmp_path / "houses.jsonl", "houses.h2") == "two"
    assert building(tmp_path / "houses.jsonl", "h3") is None


def test_a_table_without_buildings_says_nothing(tmp_path):
    table(tmp_path, "file,floor", "a.npz,1")
    assert building(tmp_path / "a.npz") is None


def test_several_tables_of_a_folder_are_one_manifest(tmp_path):
    table(tmp_path, "file,building", "a.npz,A", name="manifest_dev.csv")
    table(tmp_path, "file,building", "b.npz,B", name="manifest.csv")
    table(tmp_path, "file,building", "a.npz,X", name="other.csv")
    assert (building(tmp_path / "a.npz"), building(tmp_path / "b.npz")) == ("A", "B")


def test_odd_lines_and_a_byte_order_mark_do_no_harm(tmp_path):
    table(tmp_path, "file,building", "", "a.npz", "a.npz,A,too,many", ",B", "..,C", ".,D", "/,E", encoding="utf-8-sig")
    assert building(tmp_path / "a.npz") == "A"


def test_a_changed_manifest_is_read_again(tmp_path):
    path = table(tmp_path, "file,building", "a.npz,old") / "manifest_dev.csv"
    assert building(tmp_path / "a.npz") == "old"
    table(tmp_path, "file,building", "a.npz,new")
    os.utime(path, ns=(1, 1))
    assert building(tmp_path / "a.npz") == "new"


def test_an_unreadable_manifest_is_an_error(tmp_path, monkeypatch):
    (tmp_path / "manifest.csv").write_bytes(b"file,building\n\xff\xfe,b\n")
    with pytest.raises(PlanError, match=r"manifest.csv: not a readable manifest"):
        find_manifest(lone_file(tmp_path / "a.npz"))
    table(tmp_path, "file,building", "a.npz,b", name="manifest.csv")
    monkeypatch.setattr(manifest_module, "_LARGEST", 10)
    with pytest.raises(PlanError, match=r"manifest.csv: larger than 10 bytes"):
        find_manifest(lone_file(tmp_path / "a.npz"))


def test_a_cell_beyond_every_measure_is_an_error(tmp_path, monkeypatch):
    monkeypatch.setattr(manifest_module, "_LONGEST_FIELD", 1000)
    table(tmp_path, "file,building", f"a.npz,{'b' * 2000}")
    with pytest.raises(PlanError, match=r"not a readable manifest \(field larger than field limit"):
        find_manifest(lone_file(tmp_path / "a.npz"))


@pytest.mark.parametrize(
    ("name", "file", "expected"),
    [
        ("kth_campus_grids", "50010535_PLAN1.npz", "KTH-A"),
        ("amrl_vector_maps", "maps_dev.zip/AHG1/AHG1.vectormap.json", "UT-AHG"),
        ("valetudo_homes", "maps_dev.zip/3irobotix_converted_3790.json", "home_3"),
        ("neato_homes", "extra_01.png", "extra_01"),
        ("ros_slam_maps", "maps_dev.zip/aaf_y3/aaf_deployment16-cropped.yaml", "strands-aaf"),
        ("bormann_room_segmentation", "01_freiburg_building52.furnished.png", "freiburg_building52"),
    ],
)
def test_real_manifests_are_understood(name, file, expected):
    assert building(dev_folder(name) / file) == expected


def test_lines_that_disagree_leave_the_building_open(tmp_path):
    table(tmp_path, "file,id,building", "a.json,h1,one", "a.json,h1,two", "b.json,h2,three", "b.json,h2,three")
    assert building(tmp_path / "a.json", "h1") is None
    assert building(tmp_path / "b.json", "h2") == "three"


def test_a_packed_plan_finds_its_line_beside_the_archive(tmp_path):
    content = write_npz(tmp_path / "made" / "W1-2_17.npz").read_bytes()
    root = table(tmp_path / "dev", "file,building", "W1-2_17.npz,MIT-WALKER")
    (root / "W1-2_17.npz.gz").write_bytes(gzip.compress(content))
    with open_source(root) as files:
        (file,) = [file for file in files if file.name.endswith(".gz")]
        (plan,) = read_plans(file, READERS["mit_campus_grids"])
    assert (plan.building, plan.source) == ("MIT-WALKER", "W1-2_17.npz.gz")


@pytest.mark.parametrize(
    ("inside", "outside", "expected"),
    [
        (("manifest.csv", b"file,building\nlab/7-1_1.npz,WITHIN\n"), None, "WITHIN"),
        (("manifest.csv", b"file,building\nlab/7-1_1.npz,WITHIN\n"), "7-1_1.npz,BESIDE", "WITHIN"),
        (("lab/manifest_dev.csv", b"file,building\n7-1_1.npz,NEAR\n"), "7-1_1.npz,BESIDE", "NEAR"),
        (("notes.csv", b"file,building\nlab/7-1_1.npz,WITHIN\n"), "7-1_1.npz,BESIDE", "BESIDE"),
        (("other/manifest.csv", b"file,building\n7-1_1.npz,OTHER\n"), None, "MIT-7"),
    ],
)
def test_a_manifest_within_an_archive_comes_before_one_beside_it(tmp_path, inside, outside, expected):
    content = write_npz(tmp_path / "made" / "7-1_1.npz").read_bytes()
    archive = pack(tmp_path / "dev" / "floors.zip", ("lab/7-1_1.npz", content), inside)
    if outside is not None:
        table(tmp_path / "dev", "file,building", outside)
    with open_source(archive) as files:
        roles = {entry.file.name: entry.role for entry in classify(files)}
        (file,) = [file for file in files if file.name.endswith(".npz")]
        (plan,) = read_plans(file, READERS["mit_campus_grids"])
    assert plan.building == expected
    assert roles[f"floors.zip/{inside[0]}"] == (COMPANION if "manifest" in inside[0] else UNRECOGNISED)


def test_an_unreadable_manifest_within_an_archive_is_named_as_a_person_knows_it(tmp_path):
    content = write_npz(tmp_path / "7-1_1.npz").read_bytes()
    archive = pack(tmp_path / "floors.zip", ("7-1_1.npz", content), ("manifest.csv", b"file,building\n\xff\xfe,b\n"))
    with open_source(archive) as files:
        (file,) = [file for file in files if file.name.endswith(".npz")]
        with pytest.raises(PlanError) as refusal:
            list(read_plans(file, READERS["mit_campus_grids"]))
    assert str(refusal.value).startswith(f"{archive}/manifest.csv: not a readable manifest")


def split(file: Path, plan_id: str = "p") -> str | None:
    found = find_manifest(lone_file(file))
    return None if found is None else found.split_of(plan_id)


def test_a_line_says_its_split_and_that_of_its_building(tmp_path):
    table(tmp_path, "file,building,split", "a.npz,B, Test ", "b.npz,B,", "c.npz,C,", "d.npz,,train")
    assert [split(tmp_path / f"{name}.npz") for name in "abcde"] == ["test", "test", None, "train", None]
    (plan,) = read_plan_file(write_npz(tmp_path / "b.npz"), "mit_campus_grids")
    assert (plan.building, plan.split) == ("B", "test")


def test_a_folder_whose_lines_agree_gives_its_split_to_files_without_a_line(tmp_path):
    table(
        tmp_path,
        "file,split",
        "lab/a.png,train",
        "lab/b.png,train",
        "hall/a.png,train",
        "hall/b.png,test",
        "den/a.png,validation",
        "den/b.png,",
    )
    assert [split(tmp_path / place) for place in ("lab/x.yaml", "hall/x.yaml", "den/x.yaml", "den/b.yaml")] == [
        "train",
        None,
        None,
        None,
    ]


def test_a_building_in_two_splits_is_refused_with_both_rows(tmp_path):
    table(tmp_path, "file,building,split", "a.npz,B,train", "b.npz,C,test", '"c.npz","B",test')
    with pytest.raises(PlanError) as refusal:
        find_manifest(lone_file(tmp_path / "b.npz"))
    said = str(refusal.value)
    manifest = tmp_path / "manifest_dev.csv"
    assert said.startswith(
        f"{manifest}, line 4 (c.npz): building B is in split test, and in train by {manifest}, line 2"
    )
    assert "(a.npz)" in said


def test_two_tables_of_a_folder_are_checked_together(tmp_path):
    table(tmp_path, "file,building,split", "a.npz,B,train", name="manifest_1.csv")
    table(tmp_path, "file,building,split", "b.npz,B,validation", name="manifest_2.csv")
    with pytest.raises(PlanError, match=r"manifest_2\.csv, line 2 \(b\.npz\).*manifest_1\.csv, line 2 \(a\.npz\)"):
        find_manifest(lone_file(tmp_path / "a.npz"))


def test_a_split_that_is_none_is_refused(tmp_path):
    table(tmp_path, "file,split", "a.npz,dev")
    with pytest.raises(
        PlanError, match=r"line 2 \(a\.npz\): split = dev, expected train, validation, test, or nothing"
    ):
        find_manifest(lone_file(tmp_path / "a.npz"))
