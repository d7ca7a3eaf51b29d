from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import label

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, Door, GridPlan, Location
from pipeline.floorplans.readers import READERS, read_plan_file
from pipeline.floorplans.readers.kth_campus_grids import KthCampusGrids
from pipeline.floorplans.readers.reader import ReadOptions
from tests.floorplans.real_data import largest_share, plan_files, read_entry

# Digits are rooms, "." is drawn white and belongs to no room, "#" is a wall face. The walls are hollow: the cavity runs
# from doorway to doorway. Room 2 lies under the left part of room 1, so that a mirrored or inverted plan is another.
HOLLOW = (
    ".............",
    ".###########.",
    ".#111111111#.",
    ".###.#######.",
    ".#.........#.",
    ".###.#######.",
    ".#2222#......",
    ".#2222#......",
    ".######......",
    ".............",
)


def write(path: Path, lines: tuple[str, ...] = HOLLOW, **changes) -> Path:
    drawn = np.array([[0 if letter == "#" else 254 for letter in line] for line in lines], dtype=np.uint8)
    rooms = np.array([[int(letter) if letter.isdigit() else 0 for letter in line] for line in lines], dtype=np.uint8)
    layers = {"occ_map": drawn, "valid_space": rooms} | changes
    np.savez_compressed(path, **{name: layer for name, layer in layers.items() if layer is not None})
    return path


def read(path: Path) -> GridPlan:
    (plan,) = KthCampusGrids().read(path, ReadOptions())
    return plan


def drawn(plan: GridPlan) -> tuple[str, ...]:
    """The cells as lines, the first line the top."""
    return tuple("".join(".#"[cell] for cell in row) for row in plan.cells[::-1])


def test_rooms_and_doorways_are_free_and_cavities_are_not(tmp_path):
    plan = read(write(tmp_path / "50010535_PLAN1.npz"))
    assert drawn(plan) == (
        "#############",
        "#############",
        "##.........##",
        "####.########",
        "####.########",
        "####.########",
        "##....#######",
        "##....#######",
        "#############",
        "#############",
    )
    assert (plan.building, plan.floor, plan.resolution) == ("KTH-50010535", "50010535_PLAN1", 0.1)
    assert plan.origin == Location(0.0, 0.0)
    closed = np.count_nonzero([letter == "." for line in HOLLOW for letter in line]) - 3
    assert plan.remarks == (
        f"{closed / 100:.1f} m2 drawn free are inside walls or outside the building and were closed",
    )


def test_the_doorway_is_a_door_in_its_middle(tmp_path):
    (door,) = read(write(tmp_path / "a.npz")).doors
    assert door == pytest.approx(Door(0.45, 0.55, 0.1, True))


def test_room_numbers_are_kept_as_a_layer_the_right_way_up(tmp_path):
    rooms = read(write(tmp_path / "a.npz")).layers["rooms"].values
    assert rooms[2:4, 2:6].tolist() == [[2] * 4] * 2
    assert rooms[7, 2:11].tolist() == [1] * 9
    assert np.count_nonzero(rooms) == 17


def test_a_border_without_a_wall_is_an_opening(tmp_path):
    plan = read(write(tmp_path / "a.npz", ("######", "#1122#", "#1122#", "#1122#", "######")))
    (door,) = plan.doors
    assert door == pytest.approx(Door(0.3, 0.25, 0.3, True))
    assert plan.remarks == ()


def test_a_wide_opening_has_no_leaf(tmp_path):
    lines = ("#" * 6, *["#1122#"] * 26, "#" * 6)
    (door,) = read(write(tmp_path / "a.npz", lines)).doors
    assert (door.width, door.leaf) == (2.6, False)


def test_a_way_through_more_than_two_metres_of_wall_is_no_doorway(tmp_path):
    for cells, open_to in ((20, 1), (21, 2)):
        plan = read(write(tmp_path / "a.npz", ("#" * (cells + 4), f"#1{'.' * cells}2#", "#" * (cells + 4))))
        _, parts = label(plan.cells == FREE)
        assert parts == open_to
        assert len(plan.doors) == 2 - open_to


def test_an_entrance_from_outside_is_closed_and_rooms_may_touch_the_border(tmp_path):
    plan = read(write(tmp_path / "a.npz", ("11111", "11111", "##.##", ".....")))
    assert drawn(plan) == (".....", ".....", "#####", "#####")
    assert plan.doors == ()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"valid_space": np.zeros((2, 2), np.uint8)}, "expected two grids of one shape [rows, cols]"),
        ({"occ_map": np.zeros((10, 13))}, "expected whole numbers in occ_map and valid_space, got float64"),
        ({"valid_space": np.full((10, 13), -1)}, "valid_space holds -1 to -1, expected room numbers up to 65535"),
        ({"valid_space": np.full((10, 13), 2**40)}, "expected room numbers up to 65535"),
        ({"occ_map": None}, "layers occ_map are missing, found valid_space"),
    ],
)
def test_a_bad_file_gives_one_clear_error(tmp_path, changes, message):
    path = write(tmp_path / "a.npz", **changes)
    with pytest.raises(PlanError) as refusal:
        read_plan_file(path, "kth_campus_grids")
    assert str(refusal.value).startswith(f"{path}: ")
    assert message in str(refusal.value)


def test_the_content_tells_these_floors_from_other_npz_files(tmp_path):
    path = write(tmp_path / "a.npz")
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["kth_campus_grids"]


def test_real_floors_are_connected_through_their_doors():
    with plan_files("kth_campus_grids") as entries:
        for entry in entries[::9]:
            (plan,) = read_entry(entry)
            assert plan.building.startswith("KTH-")
            rooms = len(np.unique(plan.layers["rooms"].values)) - 1
            assert len(plan.doors) > rooms / 2
            assert largest_share(plan) > 0.9
            assert 0.8 <= np.median([door.width for door in plan.doors if door.leaf]) <= 1.6
            assert (plan.cells[plan.layers["rooms"].values == 0] == OCCUPIED).mean() > 0.5
