import json
import os
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely.geometry import box

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.plan import FloorPlan
from pipeline.floorplans.readers import READERS, read_plan_file
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.readers.resplan import ResPlan
from pipeline.grids.rasterize import rasterize

Y_UP = "the file does not say where y points: it was taken as up"
# In units of 5 cm: a living room with a bedroom above its left end, an L; walls are 2 units thick, the door 18 wide.
LIVING, BEDROOM = box(0, 0, 200, 80), box(0, 82, 80, 160)
DOOR, FRONT, WINDOW = box(20, 80, 38, 82), box(200, 30, 202, 48), box(80, 100, 82, 140)
WALL = box(-2, 80, 82, 82).union(box(-2, -2, 0, 162))
DATA = Path(os.environ.get("HINTERLAND_DATA", Path(__file__).parents[3].parent / "shared" / "data"))


def geometries(**changes) -> dict:
    drawn = {"living": LIVING, "bedroom": BEDROOM, "door": DOOR, "front_door": FRONT, "window": WINDOW, "wall": WALL}
    return {kind: [shape.wkt] if shape is not None else [] for kind, shape in (drawn | changes).items()}


def home(**changes) -> dict:
    return {"id": 4, "geometries": geometries(), "bounds": [-2, -2, 202, 162]} | changes


def write(tmp_path: Path, content: object, name="homes.json") -> Path:
    path = tmp_path / name
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def read(path: Path, metres_per_unit: float | None = 0.05) -> list[FloorPlan | PlanError]:
    return list(ResPlan().read(path, ReadOptions(metres_per_unit=metres_per_unit)))


def test_a_home_is_read_as_drawn_with_its_rooms_and_doors(tmp_path):
    (plan,) = read(write(tmp_path, [home()]))
    assert (plan.plan_id, plan.building, plan.floor) == ("homes.4", "homes.4", "homes.4")
    assert (plan.environment, plan.source, plan.remarks) == ("resplan_homes", "homes.json", (Y_UP,))
    assert [room.label for room in plan.rooms] == ["living", "bedroom"]
    assert plan.rooms[1].outline.bounds == pytest.approx((0, 4.1, 4, 8))
    assert shapely.contains_xy(plan.free, [9, 1], [1, 7]).all()
    assert not shapely.contains_xy(plan.free, [9, 9], [7, 4.2]).any()  # not mirrored
    (door,) = plan.doors
    assert door == pytest.approx((1.45, 4.05, 0.9, True))


def test_rooms_are_joined_by_their_doors_alone(tmp_path):
    (plan,) = read(write(tmp_path, home()))
    assert shapely.get_num_geometries(plan.free) == 1
    across = plan.free.intersection(shapely.LineString([(-1, 4.05), (11, 4.05)]))
    assert across.length == pytest.approx(0.9, abs=0.05)
    (sealed,) = read(write(tmp_path, home(geometries=geometries(door=None))))
    assert inspect(sealed).free_components == 2
    assert sealed.doors == ()


def test_front_doors_and_windows_stay_closed(tmp_path):
    (plan,) = read(write(tmp_path, home()))
    assert plan.free.bounds[2] < 10.05
    assert not shapely.contains_xy(plan.free, 4.05, 6)


def test_a_home_that_touches_its_border_is_closed_on_the_grid(tmp_path):
    (plan,) = read(write(tmp_path, home()))
    cells = rasterize(plan, 0.1).cells
    assert cells[[0, -1]].all() and cells[:, [0, -1]].all()


def test_the_scale_must_be_given_and_one_is_proposed(tmp_path):
    path = write(tmp_path, home())
    (problem,) = read(path, None)
    assert isinstance(problem, PlanError)
    assert str(problem) == (
        f"{path}, home 4: the file does not say how many metres a unit of it has. Set plans.read.metres_per_unit. "
        "Its doors are 18 units wide: 0.9 m at 0.05."
    )
    (doorless,) = read(write(tmp_path, home(geometries=geometries(door=None))), None)
    assert str(doorless).endswith("Set plans.read.metres_per_unit.")


@pytest.mark.parametrize("scale", [0.05, 0.06])
def test_the_given_scale_is_taken(tmp_path, scale):
    (plan,) = read(write(tmp_path, home(net_area=3)), scale)
    assert plan.rooms[0].outline.bounds == pytest.approx((0, 0, 200 * scale, 80 * scale))


def test_the_net_area_gives_the_scale(tmp_path):
    drawn = LIVING.area + BEDROOM.area
    content = home(net_area=round(drawn * 0.04**2, 3), geometries=geometries(balcony=box(80, 82, 150, 160)))
    (plan,) = read(write(tmp_path, content), None)
    assert plan.rooms[0].outline.bounds == pytest.approx((0, 0, 8, 3.2), rel=1e-4)
    assert plan.remarks[-1] == f"the scale was set so that the rooms have the net area of {drawn * 0.04**2:g} m2"


@pytest.mark.parametrize(("scale", "width"), [(1.0, "18"), (0.02, "0.36"), (0.2, "3.6")])
def test_a_scale_at_which_doors_are_no_doors_is_refused(tmp_path, scale, width):
    (problem,) = read(write(tmp_path, home()), scale)
    assert f"home 4: at {scale:g} m per unit its doors are {width} m wide, expected 0.4 to 2.5." in str(problem)
    assert "metres_per_unit=0.05" in str(problem)
    (by_area,) = read(write(tmp_path, home(net_area=9000)), None)
    assert isinstance(by_area, PlanError) and "m per unit its doors are" in str(by_area)


def test_records_are_read_past_bad_ones(tmp_path):
    nan_area, no_rooms = home(id="nan", net_area=float("nan")), home(geometries=geometries(living=None, bedroom=None))
    path = write(tmp_path, [home(id="../one"), 7, no_rooms, nan_area | {"geometries": {}}, home(id=2)])
    one, number, empty, bare, two = read(path)
    assert (one.plan_id, two.plan_id) == ("homes._one", "homes.2")
    assert f'{path}, record 1: 7, expected a home with "geometries" by class' in str(number)
    assert f"{path}, home 4: no room in it, expected polygons of living, bedroom and others" in str(empty)
    assert "home nan: no room in it" in str(bare)
    (area,) = read(write(tmp_path, [nan_area]), None)
    assert "home nan: net_area is nan, expected a finite number" in str(area)


def test_rooms_that_cross_themselves_are_repaired_and_said(tmp_path):
    crossed = shapely.Polygon([(0, 0), (200, 0), (200, 80), (40, 80), (60, 84), (50, 76), (0, 80)])
    assert not crossed.is_valid
    (plan,) = read(write(tmp_path, home(geometries=geometries(living=crossed))))
    assert plan.remarks == (Y_UP, "1 outline crossed itself and was repaired")
    assert plan.free.is_valid and plan.free.area > 40


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        ("POLYGON EMPTY", "living is POLYGON EMPTY, expected a list of at most 20,000 WKT polygons"),
        ([7], "living holds 7, expected WKT polygons"),
        (["POLYGON ((0 0, 1 0"], "'POLYGON ((0 0, 1 0' is not WKT"),
        (["POLYGON ((0 0, 1 1))"], "is not WKT"),
        (["\ud800"], "is not WKT"),
        (["POINT (0 0)"], "'POINT (0 0)' is no polygon"),
        (["POLYGON ((0 0, 9 0, NaN 9, 0 0))"], "living"),
        (["POLYGON ((0 0, 9 0, 1e300 9, 0 0))"], "a coordinate is not finite or beyond 1e+10"),
        (["POLYGON ((0 0, 9 0, 1e999 9, 0 0))"], "a coordinate is not finite or beyond 1e+10"),
        (["GEOMETRYCOLLECTION (" * 5000 + ")" * 5000], "living"),
        (["POLYGON EMPTY"] * 20_001, "expected a list of at most 20,000"),
        (["POLYGON ((" + "0 0, " * 500_000 + "0 0))"], "expected WKT polygons"),
    ],
)
def test_damaged_shapes_are_refused_with_their_record(tmp_path, texts, said):
    path = write(tmp_path, [home(geometries=geometries() | {"living": texts}), home(id=5)])
    problem, plan = read(path)
    assert str(problem).startswith(f"{path}, home 4: living")
    assert said in str(problem) and len(str(problem)) < 400
    assert plan.plan_id == "homes.5"


def test_a_third_coordinate_is_dropped(tmp_path):
    flat = "POLYGON Z ((0 0 3, 200 0 3, 200 80 3, 0 80 3, 0 0 3))"
    (plan,) = read(write(tmp_path, home(geometries=geometries() | {"living": [flat]})))
    assert not plan.free.has_z


def test_a_scribble_is_refused_before_it_takes_minutes(tmp_path):
    scribble = shapely.Polygon(np.random.default_rng(0).uniform(0, 200, (3000, 2)))
    (problem,) = read(write(tmp_path, home(geometries=geometries(living=scribble))))
    assert isinstance(problem, PlanError) and "lines meet more than 300,000 times" in str(problem)


@pytest.mark.parametrize(("content", "said"), [("[]", "no record in it"), ("", "not whole"), ('[{"id":', "not whole")])
def test_a_file_without_homes_is_refused(tmp_path, content, said):
    with pytest.raises(PlanError, match=rf"homes.json: {said}"):
        read(write(tmp_path, content))


def test_only_homes_are_recognised(tmp_path):
    path = write(tmp_path, [home()], name="homes.txt")
    assert ResPlan().sniff(path)
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["resplan"]
    for content in ("", "{}", "[]", '{"geometries": []}', "POLYGON ((0 0))", 'x"geometries" POLYGON'):
        assert not ResPlan().sniff(write(tmp_path, content))
    assert not ResPlan().sniff(tmp_path) and not ResPlan().accompanies(path)


def test_real_homes_need_a_scale_of_their_own():
    path = DATA / "residential_samples" / "dev" / "resplan_samples.json"
    if not path.is_file():
        pytest.skip(f"no {path}: set HINTERLAND_DATA to the folder that holds residential_samples")
    assert all("Set plans.read.metres_per_unit" in str(problem) for problem in read_plan_file(path))
    first, other, last = read_plan_file(path, options=ReadOptions(metres_per_unit=0.05))
    assert isinstance(other, PlanError) and "its doors are 3.65 m wide" in str(other)
    for plan in (first, last):
        assert inspect(plan).free_components == 1
        assert {room.label for room in plan.rooms} >= {"living", "bedroom", "bathroom", "kitchen"}
        assert len(plan.doors) >= 4
