import numpy as np
import pytest
from PIL import Image

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.paper import GAP_M, without_paper
from pipeline.floorplans.plan import FREE, OCCUPIED, FloorPlan, GridPlan
from pipeline.floorplans.readers import ReadOptions, read_plan_file
from tests.floorplans.samples import cells_of, grid_plan, write_map

CELL_M = 0.1


def house(*, door_m: float = 0.9, margin_m: float = 3.0, turned_deg: float = 0.0) -> np.ndarray:
    """Cells of 0.1 m of a house of 8 x 6 m on paper, in two rooms, its front door open to the paper; True is free."""
    size = round((8 + 2 * margin_m) / CELL_M)
    y, x = (np.mgrid[0:size, 0:size] + 0.5) * CELL_M - size * CELL_M / 2
    turn = np.deg2rad(turned_deg)
    along, across = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    within = (np.abs(along) < 4) & (np.abs(across) < 3)
    outer = within & ~((np.abs(along) < 3.8) & (np.abs(across) < 2.8))
    inner = within & (np.abs(along) < 0.1)
    front = (np.abs(along + 2) < door_m / 2) & (across < 0)
    between = (np.abs(across) < 0.5) & (np.abs(along) < 0.5)
    return ~((outer & ~front) | (inner & ~between))


def drawn(free: np.ndarray, **changes: object) -> GridPlan:
    cells = np.where(free, np.uint8(FREE), np.uint8(OCCUPIED))
    return grid_plan((".",), cells=cells, resolution=CELL_M, **changes)


def floor_m2(plan: GridPlan) -> float:
    return float((plan.cells == FREE).sum() * CELL_M**2)


ROOMS_M2 = 7.6 * 5.6 - 0.2 * 5.6 + 0.2 * 1.0


@pytest.mark.parametrize("turned_deg", [0.0, 20.0, 45.0])
@pytest.mark.parametrize("margin_m", [3.0, 1.5])
def test_the_rooms_stay_and_the_paper_goes_although_the_front_door_is_open(turned_deg, margin_m):
    plan = without_paper(drawn(house(turned_deg=turned_deg, margin_m=margin_m)))
    assert floor_m2(plan) == pytest.approx(ROOMS_M2, abs=1.5)  # the doorway, and at most a closet
    edge = [plan.cells[0], plan.cells[-1], plan.cells[:, 0], plan.cells[:, -1]]
    assert all((side == OCCUPIED).all() for side in edge)
    assert inspect(plan).warnings == ()


def test_how_much_counts_as_paper_is_remarked():
    before = drawn(house(), remarks=("an earlier one",))
    after = without_paper(before)
    gone = floor_m2(before) - floor_m2(after)
    assert after.remarks == (
        "an earlier one",
        f"{gone:.1f} m2 of free space that reaches the border count as paper around the house",
    )


def test_what_is_no_paper_keeps_its_cells():
    before = drawn(house(turned_deg=20.0))
    before.cells[60, 60], before.cells[70, 70] = 2, 3
    after = without_paper(before)
    changed = before.cells != after.cells
    assert (before.cells[changed] == FREE).all()
    assert (after.cells[changed] == OCCUPIED).all()


def test_a_court_within_the_house_is_no_paper():
    free = house()
    free[60:80, 80:100] = False
    free[62:78, 82:98] = True
    after = without_paper(drawn(free))
    assert (after.cells[62:78, 82:98] == FREE).all()


def test_a_house_open_by_more_than_the_gap_is_flooded_and_that_is_an_error():
    hall = house(door_m=GAP_M + 0.4)
    hall[:, 68:72] = hall[:, 80:84]  # without the wall between the rooms
    with pytest.raises(PlanError) as refusal:
        without_paper(drawn(hall))
    assert str(refusal.value).startswith("a drawing: no floor is left within the free space that reaches the border.")
    assert "leave plans.read.paper away" in str(refusal.value)


def test_a_grid_without_free_cells_is_left_to_the_checks():
    with pytest.raises(PlanError, match="the plan is empty"):
        inspect(without_paper(drawn(np.zeros((30, 40), dtype=np.bool_))))


@pytest.mark.parametrize("name", ["picture", "map"])
def test_paper_is_kept_unless_a_person_says_what_it_is(tmp_path, name):
    grey = np.where(house()[::-1], 254, 0).astype(np.uint8)
    path = tmp_path / "home.png"
    Image.fromarray(grey).save(path)
    if name == "map":
        path = write_map(tmp_path / "home", grey, resolution=CELL_M)
    kept, cut = (
        read_plan_file(path, options=ReadOptions(metres_per_unit=CELL_M, paper=paper))[0] for paper in (False, True)
    )
    (warning,) = inspect(kept).warnings
    assert warning.startswith("100% of the border is free")
    assert "plans.read.paper=true" in warning
    assert kept.remarks == ()
    assert floor_m2(cut) == pytest.approx(ROOMS_M2, abs=1.5)
    assert len(cut.remarks) == 1


def test_an_error_of_one_plan_names_its_file_and_geometry_has_no_paper(tmp_path):
    Image.fromarray(np.full((60, 60), 255, dtype=np.uint8)).save(tmp_path / "blank.png")
    (problem,) = read_plan_file(tmp_path / "blank.png", options=ReadOptions(metres_per_unit=0.1, paper=True))
    assert isinstance(problem, PlanError)
    assert str(problem).startswith("blank.png: no floor is left")
    (tmp_path / "h.json").write_text('{"id": "h", "verts": [[0, 0], [8, 0], [8, 5], [0, 5]]}')
    (plan,) = read_plan_file(tmp_path / "h.json", options=ReadOptions(paper=True))
    assert isinstance(plan, FloorPlan)
    assert plan.free.area == 40.0
    assert plan.remarks == ("plans.read.paper has no effect: houseexpo needs no such thing",)


def test_a_laser_map_that_reaches_the_border_is_cut_there_only_by_request(tmp_path):
    lines = ("????????", "########", "........", "........", "########", "????????")
    cells = cells_of(lines)
    path = write_map(tmp_path / "lab", np.choose(cells[::-1], [254, 0, 205]).astype(np.uint8))
    (plan,) = read_plan_file(path)
    assert np.array_equal(plan.cells, cells)
    assert inspect(plan).warnings == ()
