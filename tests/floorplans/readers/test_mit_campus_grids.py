from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import PlanError
from pipeline.floorplans.plan import CLUTTER, FREE, Door, GridPlan, Location
from pipeline.floorplans.readers import read_plan_file
from pipeline.floorplans.readers.mit_campus_grids import MitCampusGrids
from pipeline.floorplans.readers.reader import ReadOptions
from tests.floorplans.real_data import largest_share, plan_files, read_entry
from tests.floorplans.samples import ELL, LABELS, cells_of, write_npz


def read(path: Path) -> GridPlan:
    (plan,) = MitCampusGrids().read(path, ReadOptions())
    return plan


def test_a_floor_is_read_as_drawn_not_mirrored(tmp_path):
    plan = read(write_npz(tmp_path / "W1-2_17.npz"))
    assert (plan.plan_id, plan.floor, plan.building, plan.source) == ("W1-2_17", "W1-2", "MIT-W1", "W1-2_17.npz")
    assert (plan.resolution, plan.origin) == (0.5, Location(0.0, 0.0))
    assert np.array_equal(plan.cells, cells_of(tuple(line.replace("d", ".") for line in ELL)))
    assert (plan.cells == CLUTTER).sum() == 1
    (door,) = plan.doors
    assert door == Door(6.5 * 0.5, 4.5 * 0.5, 1.5)


def test_the_semantics_are_kept_as_a_layer(tmp_path):
    layer = read(write_npz(tmp_path / "W1-2_17.npz")).layers["semantics"]
    assert layer.labels == dict(enumerate(LABELS))
    named = np.array([layer.labels[value] for value in layer.values.ravel()]).reshape(layer.values.shape)
    assert (named[4] == "door").nonzero()[0].tolist() == [5, 6, 7]  # row 4 from below, as drawn
    assert named[2, 7] == "clutter"


@pytest.mark.parametrize(
    ("file", "floor", "building"),
    [("26-3_105", "26-3", "MIT-26"), ("N52-1_2", "N52-1", "MIT-N52"), ("hall", "hall", "MIT-hall")],
)
def test_names_give_floor_and_building(tmp_path, file, floor, building):
    plan = read(write_npz(tmp_path / f"{file}.npz"))
    assert (plan.floor, plan.building) == (floor, building)


def test_a_floor_may_touch_the_border_and_have_no_label_for_doors(tmp_path):
    path = write_npz(tmp_path / "a-1_2.npz", ("...", ".#."), semantic_labels=np.array(["wall", "x", "y", "hall"]))
    plan = read(path)
    assert plan.cells.tolist() == [[0, 1, 0], [0, 0, 0]]
    assert plan.doors == ()


@pytest.mark.parametrize("kind", [np.uint8, np.int64, np.float32, np.bool_])
def test_the_kind_of_the_numbers_is_no_matter(tmp_path, kind):
    occupied = np.array([[1, 0], [0, 0]]).astype(kind)
    path = write_npz(tmp_path / "a-1_2.npz", occ_grid=occupied, semantic_grid=np.full((2, 2), 3))
    assert (read(path).cells == FREE).tolist() == [[True, True], [False, True]]


BAD = {
    "no layer": ({"resolution": None}, "layers resolution are missing, found"),
    "other shape": ({"semantic_grid": np.zeros((2, 2), np.uint8)}, "expected two grids of one shape"),
    "three axes": ({"occ_grid": np.zeros((8, 13, 3))}, "expected two grids of one shape"),
    "no cell": ({"occ_grid": np.zeros((0, 3)), "semantic_grid": np.zeros((0, 3), np.uint8)}, "at least one cell"),
    "NaN grid": ({"occ_grid": np.full((8, 13), np.nan)}, "occ_grid or resolution holds a value that is not finite"),
    "NaN resolution": ({"resolution": np.float64("nan")}, "not finite"),
    "complex": ({"resolution": np.complex128(1)}, "expected numbers in the grids, one resolution"),
    "two resolutions": ({"resolution": np.array([0.1, 0.1])}, "one resolution [m]"),
    "labels are numbers": ({"semantic_labels": np.arange(6)}, "text labels"),
    "semantics in parts": ({"semantic_grid": np.full((8, 13), 0.5)}, "expected numbers in the grids"),
    "unlabelled": ({"semantic_grid": np.full((8, 13), 6)}, "semantic_grid holds 6 to 6 and there are 6 labels"),
    "negative": ({"semantic_grid": np.full((8, 13), -1)}, "semantic_grid holds -1 to -1"),
    "many labels": ({"semantic_labels": np.full(70_000, "door")}, "at most 1000 labels"),
    "pickled": ({"occ_grid": np.array([{}], dtype=object)}, "holds pickled objects"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_gives_one_clear_error(tmp_path, case):
    changes, message = BAD[case]
    path = write_npz(tmp_path / "a-1_2.npz", **changes)
    with pytest.raises(PlanError) as refusal:
        read_plan_file(path, "mit_campus_grids")
    assert str(refusal.value).startswith(f"{path}: ")
    assert message in str(refusal.value)


def test_foreign_files_are_not_taken_for_floors(tmp_path):
    other = tmp_path / "b.npz"
    np.savez(other, occ_map=np.zeros((2, 2)), valid_space=np.zeros((2, 2)))
    assert MitCampusGrids().sniff(write_npz(tmp_path / "a.npz"))
    assert not MitCampusGrids().sniff(other)
    assert not MitCampusGrids().sniff(tmp_path)
    assert not MitCampusGrids().sniff(tmp_path / "missing.npz")


def test_real_floors_read_and_keep_their_doors(mit_folder):
    (plan,) = read_plan_file(mit_folder / "24-1_1010.npz")
    assert plan.building == "MIT-24"
    assert len(plan.doors) == 33
    assert 0.9 <= np.median([door.width for door in plan.doors]) <= 1.2


def test_real_floors_are_mostly_connected():
    with plan_files("mit_campus_grids") as entries:
        plans = [plan for entry in entries[:: max(1, len(entries) // 5)] for plan in read_entry(entry)]
    assert {plan.resolution for plan in plans} == {0.1}
    shares = [largest_share(plan) for plan in plans]
    assert np.median(shares) > 0.9
    assert min(shares) > 0.5  # some floors have sealed rooms
