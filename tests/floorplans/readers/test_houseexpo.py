import gzip
import json
import os
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import affinity

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.plan import Bounds, FloorPlan
from pipeline.floorplans.readers import READERS, read_plan_file
from pipeline.floorplans.readers.houseexpo import HouseExpo
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.grids.occupancy import FREE, OCCUPIED
from pipeline.grids.rasterize import rasterize

# An L as the file has it, y down: its foot is drawn at the bottom right, so in the world it lies at low y and high x.
ELL = [[0, 0], [4, 0], [4, 6], [10, 6], [10, 9], [0, 9]]
BOW_TIE = [[0, 0], [8, 6], [8, 0], [0, 6]]  # crosses itself in (4, 3)
quarters = st.integers(-80, 80).map(lambda k: k / 4)
DATA = Path(os.environ.get("HINTERLAND_DATA", Path(__file__).parents[3].parent / "shared" / "data"))


def house(verts: object = ELL, **changes) -> dict:
    record = {"id": "ab12", "room_num": 1, "bbox": {"min": [0, 0], "max": [10, 9]}}
    return record | {"verts": verts, "room_category": {}} | changes


def write(path: Path, *houses: object) -> Path:
    path.write_text("\n".join(each if isinstance(each, str) else json.dumps(each) for each in houses))
    return path


def read(path: Path) -> list[FloorPlan | PlanError]:
    return list(HouseExpo().read(path, ReadOptions()))


def test_a_house_is_read_in_metres_and_turned_over_not_mirrored(tmp_path):
    (plan,) = read(write(tmp_path / "ab12.json", house()))
    assert (plan.plan_id, plan.building, plan.floor) == ("ab12", "ab12", "ab12")
    assert (plan.environment, plan.source, plan.remarks) == ("houseexpo_houses", "ab12.json", ())
    assert plan.bounds == Bounds(0, 0, 10, 9)
    assert plan.free.equals(shapely.Polygon([(0, 0), (10, 0), (10, 3), (4, 3), (4, 9), (0, 9)]))


def test_a_house_is_turned_over_within_its_own_height(tmp_path):
    (plan,) = read(write(tmp_path / "a.json", house([[x + 5, y + 20] for x, y in ELL])))
    assert plan.bounds == Bounds(5, 20, 15, 29)
    assert plan.free.bounds == plan.bounds
    assert shapely.contains_xy(plan.free, 14, 21) and not shapely.contains_xy(plan.free, 14, 28)


def test_rooms_lie_where_their_floor_is_and_keep_their_labels(tmp_path):
    boxes = {"Kitchen": [[5, 6.5, 9, 8.5]], "Bed_room": [[0, 0, 4, 6], [4, 5, 0, 0]]}
    (plan,) = read(write(tmp_path / "a.json", house(room_category=boxes)))
    assert [room.label for room in plan.rooms] == ["Kitchen", "Bed_room", "Bed_room"]
    assert [room.outline.bounds for room in plan.rooms] == [(5, 0.5, 9, 2.5), (0, 3, 4, 9), (0, 4, 4, 9)]
    assert all(plan.free.covers(room.outline) for room in plan.rooms)


def test_damaged_boxes_are_left_out_and_said(tmp_path):
    bad = [[0, 0, 4], [0, 0, 0, 4], ["0", 0, 4, 4], [0, 0, 1e9, 4], None, [float("nan"), 0, 4, 4], [30, 30, 40, 40]]
    (plan,) = read(write(tmp_path / "a.json", house(room_category={"Hall": [[0, 0, 4, 6], *bad], "Attic": "none"})))
    assert [room.label for room in plan.rooms] == ["Hall"]
    assert plan.remarks == ("7 room boxes are damaged or mostly outside the house, and left out",)


def test_a_plan_that_touches_the_border_of_its_drawing_is_closed_on_the_grid(tmp_path):
    (plan,) = read(write(tmp_path / "a.json", house()))
    grid = rasterize(plan, 0.5)
    free = grid.cells == FREE
    assert grid.cells.shape == (18 + 2, 20 + 2)
    assert (grid.cells[[0, -1]] == OCCUPIED).all() and (grid.cells[:, [0, -1]] == OCCUPIED).all()
    assert free.sum() * 0.25 == plan.free.area == 54
    assert free[1, 20] and free[18, 1] and not free[18, 20]  # row 0 is the lowest y


def test_an_outline_that_crosses_itself_is_repaired_and_said(tmp_path):
    (plan,) = read(write(tmp_path / "a.json", house(BOW_TIE)))
    assert plan.remarks == ("the outline crossed itself and was repaired",)
    assert plan.free.is_valid
    assert plan.free.area == pytest.approx(24)
    assert inspect(plan).free_components == 2


def test_a_part_drawn_twice_is_a_hole_by_the_even_odd_rule(tmp_path):
    loop = [[0, 0], [9, 0], [9, 9], [0, 9], [0, 0], [3, 3], [6, 3], [6, 6], [3, 6], [3, 3]]
    (plan,) = read(write(tmp_path / "a.json", house(loop)))
    assert plan.free.area == pytest.approx(72)


def test_lines_are_read_past_bad_ones(tmp_path):
    path = write(
        tmp_path / "houses.jsonl",
        house(id="one"),
        '{"verts": [[0, 0], [1',
        house([[0, 0], [5, 0]]),
        house([[0, 0], [5, 0], [float("nan"), 5]]),
        "",
        house(id="two"),
    )
    one, cut, short, nan, two = read(path)
    assert (one.plan_id, one.building, one.source) == ("houses.one", "one", "houses.jsonl")
    assert (two.plan_id, two.building) == ("houses.two", "two")
    assert f"{path}, line 2: not whole JSON" in str(cut)
    assert f"{path}, line 3: 2 corners, expected an outline of at least 3. Repair the house." in str(short)
    assert f"{path}, line 4: verts: a coordinate is not finite" in str(nan)


@pytest.mark.parametrize("start", ["", "\n \n", "\ufeff"])
@pytest.mark.parametrize("name", ["houses.json", "houses.jsonl", "houses.txt"])
def test_lines_are_known_by_their_content(tmp_path, start, name):
    path = write(tmp_path / name, start + json.dumps(house(id="one")), house(id="two"))
    assert HouseExpo().sniff(path)
    assert [plan.building for plan in read(path)] == ["one", "two"]


def test_a_damaged_first_line_does_not_hide_the_others(tmp_path):
    path = write(tmp_path / "houses.json", '{"id": "zero", "verts": [[0, 0], [', house(id="one"))
    bad, one = read(path)
    assert "line 1: not whole JSON" in str(bad)
    assert one.building == "one"


@pytest.mark.parametrize("indent", [None, 1])
def test_one_house_may_spread_over_many_lines(tmp_path, indent):
    (tmp_path / "a.json").write_text("\n" + json.dumps(house(id=""), indent=indent) + "\n")
    (plan,) = read(tmp_path / "a.json")
    assert (plan.plan_id, plan.building) == ("a", "a")  # without an id of its own


def test_a_list_of_houses_is_read_past_bad_ones(tmp_path):
    path = tmp_path / "list.json"
    path.write_text(json.dumps([house(id="one"), 7, house(id="../two")]))
    one, bad, two = read(path)
    assert f'{path}, house 2: 7, expected a house with "id" and "verts"' in str(bad)
    assert (one.plan_id, two.plan_id) == ("list.one", "list._two")


@pytest.mark.parametrize(
    ("record", "said"),
    [
        (house(None), r"verts is 'None', expected a list of points"),
        (house([]), "0 corners, expected an outline of at least 3"),
        (house([[0, 0], [5, 5], [9, 9]]), "the outline encloses no floor"),
        (house([[0, 0], [0, 0], [0, 0], [0, 0]]), "the outline encloses no floor"),
        (house([[0, 0], [1e-3, 0], [0, 1e-3]]), "the outline encloses no floor"),
        (house([[0, 0], [1, 0], [1e300, 1]]), "a coordinate is not finite or beyond"),
        (house([[0, 0], [1, 0], [10**400, 1]]), "a coordinate is not finite or beyond"),
        (house([[0, 0], [1, 0], ["9", 1]]), "a coordinate is not a number"),
        (house([[k % 7, k] for k in range(50_001)]), "50,001 points, at most 50,000"),
        (house(room_category=[1]), "room_category is a list of 1, expected boxes by room type"),
        (house(room_category={"Hall": [[0, 0, 1, 1]] * 10_001}), "10,001 room boxes, at most 10,000"),
        ({"id": "ab12"}, 'a mapping of 1, expected a house with "id" and "verts"'),
    ],
)
def test_what_is_no_house_is_refused_with_the_name_of_the_file(tmp_path, record, said):
    path = write(tmp_path / "a.json", record)
    (problem,) = read(path)
    assert isinstance(problem, PlanError)
    with pytest.raises(PlanError, match=said):
        raise problem
    assert str(problem).startswith(str(path)) and len(str(problem)) < 500


def test_a_scribble_is_refused_before_it_takes_minutes(tmp_path):
    corners = np.random.default_rng(0).uniform(0, 20, (2000, 2)).tolist()
    (problem,) = read(write(tmp_path / "a.json", house(corners)))
    assert "lines meet more than 300,000 times. Simplify the drawing" in str(problem)


@pytest.mark.parametrize(("name", "content"), [("a.jsonl", ""), ("a.jsonl", "\n\n"), ("a.json", "[]")])
def test_a_file_without_a_house_is_an_error(tmp_path, name, content):
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(PlanError, match=r'a.jsonl?: no house in it, expected JSON with "verts"'):
        read(path)


@pytest.mark.parametrize("keep", [1, 20, 60, 100])
def test_a_truncated_file_is_an_error(tmp_path, keep):
    path = tmp_path / "a.json"
    path.write_text(json.dumps(house())[:keep])
    with pytest.raises(PlanError, match=r"a.json: not whole JSON .* Get the file again"):
        read(path)


def test_only_houses_are_recognised(tmp_path):
    sniff = HouseExpo().sniff
    assert sniff(write(tmp_path / "a.json", house()))
    assert sniff(write(tmp_path / "a.txt", json.dumps([house()])))
    few_keys = {"verts": [[0.5, 1], [2, 3]]}
    assert sniff(write(tmp_path / "b.json", few_keys))
    for other in ("", "{}", "[]", '{"verts": 3}', '{"rect": {}}', "verts", '<svg verts="[[">', '"verts": [[0, 0]]'):
        assert not sniff(write(tmp_path / "c.json", other))
    assert not sniff(tmp_path / "gone.json")
    assert not sniff(tmp_path)
    assert not HouseExpo().accompanies(tmp_path / "a.json")
    assert [name for name, reader in READERS.items() if reader.sniff(tmp_path / "a.json")] == ["houseexpo"]


def even_odd(corners: np.ndarray, spots: np.ndarray) -> np.ndarray:
    """Whether a ray from each spot to the right crosses the closed outline an odd number of times."""
    (x0, y0), (x1, y1) = corners.T[..., None], np.roll(corners, -1, axis=0).T[..., None]
    x, y = spots.T
    with np.errstate(all="ignore"):
        met = (y0 > y) != (y1 > y)
        return (met & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))).sum(axis=0) % 2 == 1


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(quarters, quarters), min_size=3, max_size=12))
def test_any_outline_without_doubled_sides_is_filled_by_the_even_odd_rule(tmp_path_factory, corners):
    ring = shapely.LinearRing(corners)
    assume(shapely.union_all([ring]).length == pytest.approx(ring.length))
    (plan,) = read(write(tmp_path_factory.mktemp("house") / "a.json", house([list(corner) for corner in corners])))
    if isinstance(plan, PlanError):
        assert "encloses no floor" in str(plan)
        return
    assert plan.free.is_valid
    turned = np.array(corners) * [1, -1] + [0, plan.bounds.min_y + plan.bounds.max_y]
    spots = np.random.default_rng(0).uniform(plan.bounds[:2], plan.bounds[2:], (500, 2))
    spots = spots[shapely.distance(shapely.LinearRing(turned), shapely.points(spots)) > 0.01]
    assert (shapely.contains_xy(plan.free, *spots.T) == even_odd(turned, spots)).all()


@pytest.fixture(scope="module")
def real_houses(tmp_path_factory) -> Path:
    packed = DATA / "houseexpo" / "dev" / "houses_dev.jsonl.gz"
    if not packed.is_file():
        pytest.skip(f"no houses in {packed.parent}: set HINTERLAND_DATA to the folder that holds houseexpo")
    path = tmp_path_factory.mktemp("houses") / "houses_dev.jsonl"
    with gzip.open(packed) as stream:
        path.write_bytes(b"".join(islice(stream, 60)))
    return path


def test_real_houses_are_read_whole(real_houses):
    records = [json.loads(line) for line in real_houses.read_text().splitlines()]
    plans = read_plan_file(real_houses)
    assert len(plans) == 60
    for plan, record in zip(plans, records, strict=True):
        assert plan.plan_id == f"houses_dev.{record['id']}"
        low, high = record["bbox"]["min"], record["bbox"]["max"]
        assert plan.bounds == pytest.approx((*low, *high), abs=0.02)
        assert shapely.get_num_geometries(plan.free) == 1 or plan.remarks
        assert rasterize(plan, 0.1).cells.any()
    assert {room.label for plan in plans for room in plan.rooms} >= {"Kitchen", "Bathroom", "Bedroom"}
    assert sum(len(plan.rooms) for plan in plans) > 300


def test_rooms_of_real_houses_lie_on_their_floor_and_not_on_its_mirror_image(real_houses):
    covered = {1.0: [], -1.0: []}
    for plan in (plan for plan in read(real_houses) if len(plan.rooms) > 3):
        for side, shares in covered.items():
            floor = affinity.scale(plan.free, yfact=side, origin=shapely.box(*plan.bounds).centroid)
            shares += [room.outline.intersection(floor).area / room.outline.area for room in plan.rooms]
    assert np.mean(covered[1.0]) > np.mean(covered[-1.0]) + 0.05
    assert np.mean(covered[1.0]) > 0.8
