import json
import os
from pathlib import Path

import numpy as np
import pytest
import shapely

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.plan import FloorPlan
from pipeline.floorplans.readers import READERS, read_plan_file
from pipeline.floorplans.readers.mlstruct import MlStruct
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.grids.occupancy import OCCUPIED
from pipeline.grids.rasterize import rasterize

STRUCTURE_ONLY = "only load-bearing walls are drawn: partitions and doors are missing"
# An L, y up and negative as in the published files: the foot lies at low y and high x.
SLAB = [(0, -9), (10, -9), (10, -6), (4, -6), (4, 0), (0, 0)]
# Its walls, and a partition across the upper arm that leaves 1.2 m open on the right.
WALLS = [
    (0, -9, 0.2, 0),
    (0, -9, 10, -8.8),
    (9.8, -9, 10, -6),
    (4, -6.2, 10, -6),
    (3.8, -6.2, 4, 0),
    (0, -0.2, 4, 0),
    (0.2, -4.2, 2.6, -4),
]
DATA = Path(os.environ.get("HINTERLAND_DATA", Path(__file__).parents[3].parent / "shared" / "data"))


def corners(shape) -> dict:
    xs, ys = zip(*shape, strict=True)
    return {"x": list(xs), "y": list(ys)}


def rect(low_x, low_y, high_x, high_y, **changes) -> dict:
    shape = [(low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)]
    return corners(shape) | {"floorID": 7, "wallID": 1, "angle": 0.0, "thickness": 0.2} | changes


def floor(number: int = 7, **changes) -> dict:
    walls = {f"{number}{k}": rect(*wall, floorID=number) for k, wall in enumerate(WALLS)}
    slab = {str(number): corners(SLAB) | {"floorID": number}}
    return {"floor": {str(number): {"image": "a.png", "scale": 150.8}}, "rect": walls, "slab": slab} | changes


def write(tmp_path: Path, content: object, name="building.json") -> Path:
    path = tmp_path / name
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def read(path: Path, **options) -> list[FloorPlan | PlanError]:
    return list(MlStruct().read(path, ReadOptions(**options)))


def test_a_floor_is_read_in_metres_as_drawn_not_mirrored(tmp_path):
    (plan,) = read(write(tmp_path, floor()))
    assert (plan.plan_id, plan.building, plan.floor) == ("building", "mlstruct-7", "building")
    assert (plan.environment, plan.source) == ("mlstruct_floors", "building.json")
    assert (plan.rooms, plan.doors, plan.remarks) == ((), (), (STRUCTURE_ONLY,))
    assert plan.bounds == (0, -9, 10, 0)
    assert shapely.contains_xy(plan.free, [1, 9, 1], [-1, -8, -8]).all()
    assert not shapely.contains_xy(plan.free, [9, 9, 5], [-1, -5, -5]).any()
    assert plan.free.area == pytest.approx(9.6 * 2.6 + 3.6 * 6.0 - 2.4 * 0.2)
    assert inspect(plan).narrowest_door_m == pytest.approx(1.2)


def test_slabs_that_touch_the_border_are_closed_on_the_grid(tmp_path):
    content = floor(rect={"1": rect(2, -4, 2.2, -3)})
    grid = rasterize(read(write(tmp_path, content))[0], 0.1)
    assert (grid.cells[[0, -1]] == OCCUPIED).all() and (grid.cells[:, [0, -1]] == OCCUPIED).all()
    assert grid.cells[1, 100] != OCCUPIED and grid.cells[90, 1] != OCCUPIED


def test_without_a_slab_the_floor_is_what_the_walls_enclose(tmp_path):
    (plan,) = read(write(tmp_path, floor(slab={})))
    assert plan.remarks == (STRUCTURE_ONLY, "the file has no slab: the floor is what the walls enclose")
    assert plan.free.area == pytest.approx(46.1, abs=3)
    assert shapely.contains_xy(plan.free, 9, -8) and not shapely.contains_xy(plan.free, 9, -1)


def test_one_file_may_hold_several_floors(tmp_path):
    first, second = floor(7), floor(8)
    both = {key: first[key] | second[key] for key in first}
    path = write(tmp_path, both)
    plans = read(path)
    assert [(plan.plan_id, plan.building) for plan in plans] == [
        ("building.7", "mlstruct-7"),
        ("building.8", "mlstruct-8"),
    ]
    assert [plan.building for plan in read(path, levels=("8",))] == ["mlstruct-8"]
    assert read(path, levels=("9",)) == []


def test_a_bad_floor_does_not_take_the_others_with_it(tmp_path):
    both = {key: floor(7)[key] | floor(8)[key] for key in floor()}
    both["rect"]["70"]["x"][0] = float("nan")
    path = write(tmp_path, both)
    problem, plan = read(path)
    assert f"{path}, floor 7: wall 70: a coordinate is not finite" in str(problem)
    assert plan.building == "mlstruct-8"


def test_outlines_that_cross_themselves_are_repaired_and_said(tmp_path):
    content = floor()
    wall = content["rect"]["76"]
    wall["x"][0], wall["x"][1] = wall["x"][1], wall["x"][0]
    content["slab"]["7"] = corners([*SLAB[:3], (4, -6), (4, 0), (0, -0.001), (4, -0.001), (0, 0)]) | {"floorID": 7}
    (plan,) = read(write(tmp_path, content))
    assert plan.remarks == (STRUCTURE_ONLY, "2 outlines crossed themselves and were repaired")
    assert plan.free.is_valid and plan.free.area == pytest.approx(46.1, abs=1)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"x": [0, 1]}, 'lists "x" and "y" of the same length, at least 3 corners in metres'),
        ({"x": None}, 'lists "x" and "y" of the same length'),
        ({"x": [0, 1, 2, 3, 4]}, 'lists "x" and "y" of the same length'),
        ({"x": [0, 1, 1, "0"]}, "a coordinate is not a number"),
        ({"x": [0, 1, 1, 1e300]}, "a coordinate is not finite or beyond"),
        ({"x": [0, 1, 1, 10**400]}, "a coordinate is not finite or beyond"),
        ({"x": [0.0] * 10_001, "y": [0.0] * 10_001}, "10,001 points, at most 10,000"),
    ],
)
def test_a_damaged_wall_is_named(tmp_path, change, said):
    content = floor()
    content["rect"]["73"] |= change
    path = write(tmp_path, content)
    (problem,) = read(path)
    assert str(problem).startswith(f"{path}, floor 7: wall 73")
    assert said in str(problem) and len(str(problem)) < 400


def test_an_entry_that_is_no_wall_is_named(tmp_path):
    (problem,) = read(write(tmp_path, floor(rect={"70": [1, 2]})))
    assert 'building.json: wall 70: expected lists "x" and "y"' in str(problem)


def test_scribbles_are_refused_before_they_take_minutes(tmp_path):
    scribble = np.random.default_rng(0).uniform(0, 9, (3000, 2)).tolist()
    (slab,) = read(write(tmp_path, floor(slab={"7": corners(scribble) | {"floorID": 7}})))
    (wall,) = read(write(tmp_path, floor(rect={"7": corners(scribble) | {"floorID": 7}})))
    for problem in (slab, wall):
        assert isinstance(problem, PlanError) and "building.json, floor 7: lines meet more than" in str(problem)


@pytest.mark.parametrize("content", ["[]", "{}", '{"rect": []}', '{"rect": {}}', "7"])
def test_a_file_without_walls_is_refused(tmp_path, content):
    with pytest.raises(PlanError, match=r'building.json: no wall in it, expected "rect" .* Check the file'):
        read(write(tmp_path, content))


@pytest.mark.parametrize("keep", [0, 1, 50, 400])
def test_a_truncated_file_is_refused(tmp_path, keep):
    with pytest.raises(PlanError, match=r"building.json: not whole JSON"):
        read(write(tmp_path, json.dumps(floor())[:keep]))


def test_only_such_files_are_recognised(tmp_path):
    path = write(tmp_path, floor(), name="walls.txt")
    assert MlStruct().sniff(path)
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["mlstruct"]
    assert MlStruct().sniff(write(tmp_path, {"rect": {"1": rect(0, 0, 1, 1)}}))
    for content in ("", "{}", "[]", '{"rect": {}}', '{"floor": 1, "scale": 2}', '["floor", "image", "scale"]', "\xff"):
        assert not MlStruct().sniff(write(tmp_path, content))
    assert not MlStruct().sniff(tmp_path) and not MlStruct().accompanies(path)


def test_real_floors_hang_together():
    folder = DATA / "residential_samples" / "dev"
    if not folder.is_dir():
        pytest.skip(f"no floors in {folder}: set HINTERLAND_DATA to the folder that holds residential_samples")
    paths = sorted(folder.glob("mlstruct_*.json"))
    assert len(paths) >= 5
    for path in paths[:3]:
        (plan,) = read_plan_file(path)
        slab = json.loads(path.read_text())["slab"]
        area = sum(shapely.Polygon(zip(each["x"], each["y"], strict=True)).area for each in slab.values())
        assert 0.7 * area < plan.free.area < area
        assert inspect(plan).largest_free_share > 0.9
        assert plan.building == f"mlstruct-{path.stem.rpartition('_')[2]}"
