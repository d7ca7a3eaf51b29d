import os
from pathlib import Path

import pytest
import shapely
from shapely.geometry import LineString, Point, Polygon, box, mapping

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.plan import Room
from pipeline.floorplans.readers import COMPANION, PLAN, classify, read_plans
from pipeline.floorplans.readers.geojson_features import Feature
from pipeline.floorplans.readers.indoor_geojson import IndoorGeoJson, levels_of
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.sources import lone_file, open_source
from tests.floorplans.geojson_samples import ELL, door, feature, room, two_rooms, write_features

DATA = Path(os.environ.get("HINTERLAND_DATA", Path(__file__).parents[3].parent / "shared" / "data"))


def read(tmp_path, features, **options):
    path = write_features(tmp_path / "site.geojson", features)
    return list(IndoorGeoJson().read(path, ReadOptions(**options)))


def parts(plan):
    return len(shapely.get_parts(plan.free))


def test_an_ell_is_not_mirrored_and_keeps_its_size(tmp_path):
    (plan,) = read(tmp_path, [room(room="office")])
    assert (plan.plan_id, plan.building, plan.floor, plan.source) == ("site.0", "site", "site.0", "site.geojson")
    west, south, east, north = plan.bounds
    assert (east - west, north - south) == pytest.approx((10.0, 8.0), rel=1e-3)
    (only,) = plan.rooms
    assert only.label == "office"
    assert only.outline.area == pytest.approx(ELL.area, rel=1e-3)
    assert shapely.contains_xy(plan.free, east - 1, south + 1)  # the foot of the L points east
    assert shapely.contains_xy(plan.free, west + 1, north - 1)
    assert not shapely.contains_xy(plan.free, east - 1, north - 1)
    assert plan.free.area == pytest.approx(ELL.buffer(-0.05, join_style="mitre").area, rel=1e-3)


def test_a_door_opens_the_wall_between_two_rooms(tmp_path):
    (plan,) = read(tmp_path, two_rooms(), wall_m=0.2, door_width_m=0.8)
    assert parts(plan) == 1
    (opening,) = plan.doors
    assert opening.width == pytest.approx(0.8)
    assert opening.leaf
    cut = plan.free.intersection(box(opening.x - 0.05, plan.bounds.min_y, opening.x + 0.05, plan.bounds.max_y))
    assert cut.area / 0.1 == pytest.approx(0.8, rel=0.01)


def test_rooms_without_a_door_stay_sealed(tmp_path):
    (plan,) = read(tmp_path, two_rooms()[:2])
    assert parts(plan) == 2
    assert plan.doors == ()
    assert any("sealed rooms" in warning for warning in inspect(plan).warnings)


@pytest.mark.parametrize(("tags", "width", "leaf"), [({"width": "1.4 m"}, 1.4, True), ({"door": "no"}, 0.9, False)])
def test_doors_have_their_own_width_and_leaf(tmp_path, tags, width, leaf):
    (plan,) = read(tmp_path, [*two_rooms()[:2], door(5, 2, **tags)])
    assert [(each.width, each.leaf) for each in plan.doors] == [(pytest.approx(width), leaf)]


def test_a_door_to_the_outside_stays_closed_and_is_said(tmp_path):
    (plan,) = read(tmp_path, [*two_rooms(), door(0, 2, door="", entrance="main"), door(10, 2, door="", entrance="no")])
    assert len(plan.doors) == 1
    assert plan.remarks == ("1 door leads outside or to no outlined room and stays closed",)


def test_corridors_that_touch_are_one_space(tmp_path):
    corridors = [room(box(0, 0, 9, 2), indoor="corridor"), room(box(9, 0, 11, 9), indoor="area")]
    (plan,) = read(tmp_path, [*corridors, room(box(0, 2, 9, 6))])
    assert parts(plan) == 2
    assert [each.label for each in plan.rooms] == ["corridor", "area", "room"]


@pytest.mark.parametrize(
    ("level", "repeat_on", "levels"),
    [
        ("0", None, ["0"]),
        ("0;1", None, ["0", "1"]),
        ("0, 1", None, ["0", "1"]),
        ("0-2", None, ["0", "1", "2"]),
        ("-1-1", None, ["-1", "0", "1"]),
        ("-3--1", None, ["-3", "-2", "-1"]),
        ("1 - 2", None, ["1", "2"]),
        ("0.5", None, ["0.5"]),
        ("-0", None, ["0"]),
        ("1.0", None, ["1"]),
        (2, None, ["2"]),
        (0.5, None, ["0.5"]),
        ("1;1;1-2", None, ["1", "2"]),
        ("0", "2-3", ["0", "2", "3"]),
        ("-1", "1-3", ["-1", "1", "2", "3"]),
        ("0", "1;3", ["0", "1", "3"]),
        ("B1;1", None, ["1"]),
        ("2-0", None, []),
        ("0-1000", None, []),
        ("9" * 90 + "-" + "9" * 90, None, []),
        ("", None, []),
        (None, None, []),
        (["0"], None, []),
        (True, None, []),
    ],
)
def test_levels(level, repeat_on, levels):
    assert list(levels_of(Feature(None, {"level": level, "repeat_on": repeat_on}, "", {}))) == levels


def test_each_level_is_a_plan_in_one_frame(tmp_path):
    shaft = room(box(10, 0, 12, 2), "-1-1", room="stairs")
    lower, ground, upper = read(tmp_path, [shaft, *two_rooms("0"), *two_rooms("1"), room(level="-1")])
    assert [plan.floor for plan in (lower, ground, upper)] == ["site.-1", "site.0", "site.1"]
    assert [len(plan.rooms) for plan in (lower, ground, upper)] == [2, 3, 3]
    assert [len(plan.doors) for plan in (lower, ground, upper)] == [0, 1, 1]
    stairs = [room.outline for plan in (lower, ground, upper) for room in plan.rooms if room.label == "stairs"]
    assert stairs[0].equals(stairs[1])
    assert stairs[0].equals(stairs[2])
    assert len({plan.building for plan in (lower, ground, upper)}) == 1


def test_a_door_stands_again_on_the_levels_it_repeats(tmp_path):
    rooms = [each for level in "012" for each in two_rooms(level)[:2]]
    plans = read(tmp_path, [*rooms, door(5, 2, "0", repeat_on="1-2")])
    assert [(len(plan.doors), parts(plan)) for plan in plans] == [(1, 1)] * 3


def test_levels_are_chosen(tmp_path):
    (plan,) = read(tmp_path, [*two_rooms("0"), *two_rooms("1")], levels=("1",))
    assert plan.plan_id == "site.1"


def test_an_outline_that_crosses_itself_is_repaired_and_said(tmp_path):
    (plan,) = read(tmp_path, [room(Polygon([(0, 0), (8, 8), (8, 0), (0, 8)]))])
    assert plan.free.is_valid
    assert plan.remarks[0] == "1 outline crossed itself and was repaired"


def test_damage_and_missing_levels_are_said(tmp_path):
    damaged = {
        "type": "Feature",
        "properties": {},
        "geometry": {"type": "Polygon", "coordinates": [[[0, float("nan")]]]},
    }
    (plan,) = read(tmp_path, [room(), room(level="ground"), damaged])
    assert plan.remarks == (
        "1 feature with a damaged shape left out",
        "1 room without a level that can be read left out",
    )


def test_walls_and_columns_inside_a_room_are_no_floor(tmp_path):
    wall = feature(LineString([(5, 0), (5, 4)]), indoor="wall", level="0")
    column = feature(box(1, 1, 2, 2), indoor="column", level="0")
    (plan,) = read(tmp_path, [room(box(0, 0, 10, 4)), wall, column])
    assert parts(plan) == 2
    assert plan.free.area == pytest.approx(9.9 * 3.9 - 0.1 * 3.9 - 1.0, rel=1e-3)
    assert plan.remarks == ("2 walls mapped inside rooms taken off the floor",)


def test_a_door_opens_a_wall_inside_a_room(tmp_path):
    wall = feature(LineString([(5, 0), (5, 4)]), indoor="wall", level="0")
    (plan,) = read(tmp_path, [room(box(0, 0, 10, 4)), wall, door(5, 2)])
    assert parts(plan) == 1
    assert [each.width for each in plan.doors] == [0.9]
    assert not any("closed" in remark for remark in plan.remarks)


def test_outdoor_features_are_passed_over(tmp_path):
    outdoors = [feature(box(-900, -900, 900, 900), landuse="railway"), feature(Point(400, 0), highway="bus_stop")]
    (plan,) = read(tmp_path, [*outdoors, room()])
    assert plan.bounds.max_x - plan.bounds.min_x == pytest.approx(10, rel=1e-3)


@pytest.mark.parametrize(
    ("features", "said"),
    [
        ([], "no room, area or corridor with a level, expected indoor="),
        ([room(level="")], "no room, area or corridor with a level"),
        ([door(0, 0)], "no room, area or corridor with a level"),
        ([room(level=f"0;{low}-{low + 190}") for low in (-190, 1)], "382 levels, at most 200"),
        (
            [{"properties": {"indoor": "room", "level": "0"}, "geometry": mapping(box(4e5, 5e6, 4.1e5, 5.1e6))}],
            "expected degrees of longitude and latitude",
        ),
    ],
)  # fmt: skip
def test_bad_files_are_refused(tmp_path, features, said):
    with pytest.raises(PlanError, match=said) as caught:
        read(tmp_path, features)
    assert str(tmp_path / "site.geojson") in str(caught.value)


def test_a_far_feature_refuses_its_level_alone(tmp_path):
    far = feature(Point(0, 0), around=(14.9, 51.0), members={"id": "node/7"}, door="yes", level="1")
    ground, refused = read(tmp_path, [*two_rooms("0"), *two_rooms("1"), far])
    assert ground.plan_id == "site.0"
    assert isinstance(refused, PlanError)
    assert "site.geojson, level 1: feature node/7: a coordinate lies more than" in str(refused)


def test_own_files_are_recognised_and_foreign_ones_not(tmp_path):
    own = write_features(tmp_path / "own.geojson", two_rooms())
    other = write_features(tmp_path / "other.geojson", [feature(ELL, type="building_outline")])
    picture = tmp_path / "a.geojson"
    picture.write_bytes(b"\x89PNG\r\n")
    assert [IndoorGeoJson().sniff(path) for path in (own, other, picture, tmp_path, tmp_path / "no")] == [True] + [
        False
    ] * 4
    assert not IndoorGeoJson().accompanies(own)
    (entry,) = classify([lone_file(own)])
    assert (entry.role, entry.reader.name) == (PLAN, "indoor_geojson")


@pytest.fixture(scope="module")
def real_plans():
    folder = DATA / "osm_indoor" / "dev"
    if not folder.is_dir():
        pytest.skip(f"no indoor maps in {folder}: set HINTERLAND_DATA to the folder that holds osm_indoor")
    with open_source(folder) as files:
        entries = [entry for entry in classify(files) if entry.role != COMPANION]
        return {plan.plan_id: plan for entry in entries for plan in read_plans(entry.file, entry.reader)}


def test_real_buildings_are_read(real_plans):
    assert len(real_plans) == 10
    assert {plan.building for plan in real_plans.values()} == {"apb", "caserne", "garedelest"}
    for plan in real_plans.values():
        report = inspect(plan)
        assert 90 < max(report.width_m, report.height_m) < 420
        assert plan.free.is_valid
        assert all(isinstance(room, Room) and room.label for room in plan.rooms)


def test_a_real_university_building_is_one_connected_floor(real_plans):
    floors = [real_plans[f"apb.{level}"] for level in range(4)]
    assert min(len(floor.doors) for floor in floors) > 100
    assert min(inspect(floor).largest_free_share for floor in floors) > 0.98
