import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.errors import PlanError
from pipeline.floorplans.readers import ReadOptions
from pipeline.floorplans.survey import DataSet, Loss, data_sets_in, survey, survey_one, survey_table
from tests.floorplans.samples import write_map, write_npz

GREY = np.pad(np.full((20, 30), 254, dtype=np.uint8), 2)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """Three data sets: floors of npz, of which one is damaged; pictures without a scale; maps in an archive."""
    folder = tmp_path / "all"
    for name in ("7-1_1.npz", "7-1_2.npz", "7-2_1.npz"):
        write_npz(folder / "campus" / "dev" / name)
    (folder / "campus" / "dev" / "7-3_1.npz").write_bytes(b"PK\x03\x04 and nothing more")
    (folder / "campus" / "README.md").write_text("floors")
    (folder / "homes").mkdir()
    Image.fromarray(GREY).save(folder / "homes" / "attic.png")
    maps = write_map(tmp_path / "gates", GREY)
    (folder / "maps").mkdir()
    with zipfile.ZipFile(folder / "maps" / "maps.zip", "w") as archive:
        for file in (maps, maps.with_name("map.png")):
            archive.write(file, f"gates/{file.name}")
    return folder


def test_each_folder_is_a_data_set(root):
    assert [path.name for path in data_sets_in(root)] == ["campus", "homes", "maps"]
    assert data_sets_in(root / "homes") == [root / "homes"]
    assert data_sets_in(root / "maps") == [root / "maps"]
    (root / "maps" / "maps.zip").rename(root / "more.zip")
    assert [path.name for path in data_sets_in(root)] == ["campus", "homes", "maps", "more.zip"]
    assert data_sets_in(root / "homes" / "attic.png") == [root / "homes" / "attic.png"]


def test_a_row_counts_files_plans_floors_and_what_failed(root):
    row = survey_one(root / "campus", DataSet())
    assert (row.files, row.read_files, row.plans, row.floors, row.buildings) == (5, 3, 3, 2, 1)
    assert row.unrecognised == ("README.md",)
    assert len(row.failures) == 1
    assert "7-3_1.npz" in row.failures[0]
    assert "\n" not in row.failures[0]
    assert row.seconds > 0


def test_members_of_an_archive_count_singly(root):
    row = survey_one(root / "maps", DataSet())
    assert (row.files, row.read_files, row.companions, row.plans) == (2, 1, 1, 1)


def test_a_data_set_is_read_with_its_own_options(root):
    without = {row.name: row for row in survey(root)}
    assert without["homes"].plans == 0
    assert "no scale" in without["homes"].failures[0]
    scaled = DataSet(options=ReadOptions(metres_per_unit=0.2))
    rows = survey(root, {"homes": scaled})
    assert [row.plans for row in rows] == [3, 1, 1]
    assert [row.warnings for row in rows][1] == 0


def test_files_may_be_read_in_any_way_that_keeps_their_order(root):
    calls = []

    def backwards(read, entries):
        calls.append(len(entries))
        return [*map(read, reversed(entries))][::-1]

    usual, other = (survey_one(root / "campus", DataSet(), **how) for how in ({}, {"spread": backwards}))
    assert calls == [4]
    assert [vars(row) | {"seconds": 0} for row in (usual, other)] == [vars(usual) | {"seconds": 0}] * 2


def test_the_table_sums_up_and_names_every_failure(root):
    rows = survey(root)
    lines = survey_table(rows).splitlines()
    assert lines[0].split()[:4] == ["data", "set", "files", "read"]
    cells = dict(
        zip(lines[0].replace("data set", "name").replace("no plan", "none").split(), lines[4].split(), strict=True)
    )
    assert (cells["name"], cells["files"], cells["plans"], cells["failures"]) == ("all", "8", "4", "2")
    assert [line.partition(":")[0] for line in lines[5:]] == ["campus", "homes"]
    assert len({len(line) for line in lines[:5]}) == 1


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(PlanError, match="no such folder or file"):
        survey(tmp_path / "nowhere")


def test_a_survey_says_how_much_floor_is_lost(tmp_path):
    write_npz(tmp_path / "7-1_3.npz")
    write_npz(tmp_path / "7-2_3.npz")

    def measure(plan):
        return Loss(0.25, "much is lost") if plan.plan_id == "7-2_3" else Loss(0.0, "")

    row = survey_one(tmp_path, DataSet(), measure=measure)
    assert (row.lost, row.losses) == ((0.0, 0.25), ("much is lost",))
    head, line, total, said = survey_table([row]).splitlines()
    assert head.endswith("lost median    most  above 1 %")
    assert line.split()[-3:] == total.split()[-3:] == ["12.50%", "25.00%", "1"]
    assert said == f"{tmp_path.name}: much is lost"
    assert "lost" not in survey_table([survey_one(tmp_path, DataSet())])
