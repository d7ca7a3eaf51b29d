import os
from pathlib import Path

import pytest
import shapely
from shapely.geometry import (
    GeometryCollection,
    LineString,
    MultiLineString,
    MultiPoint,
    MultiPolygon,
    Point,
    Polygon,
    box,
    mapping,
)

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.plan import Room
from pipeline.floorplans.readers import COMPANION, PLAN, classify, read_plans
from pipeline.floorplans.readers.indoor_geojson import IndoorGeoJson
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
    assert plan.remarks[-1:] == ("1 door leads outside or to no outlined room and stays closed",)


def test_corridors_that_touch_are_one_space(tmp_path):
    corridors = [room(box(0, 0, 9, 2), indoor="corridor"), room(box(9, 0, 11, 9), indoor="area")]
    (plan,) = read(tmp_path, [*corridors, room(box(0, 2, 9, 6))])
    assert parts(plan) == 2
    assert [each.label for each in plan.rooms] == ["corridor", "area", "room"]


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
        "1 room without a level that can be read left out ('ground')",
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


# Two rooms that nobody can take for each other: 5 x 4 m, and 7 x 3 m to the east of it.
HALL, SIDE = box(0, 0, 5, 4), box(5, 0, 12, 3)


def hall_and_side(level="0"):
    return [room(HALL, level), room(SIDE, level)]


def off_corner(plan, opening):
    """Where a door lies, from the south-west corner of the plan [m]."""
    return opening.x - plan.bounds.min_x, opening.y - plan.bounds.min_y


@pytest.mark.parametrize(
    ("marked", "middle", "width"),
    [
        (feature(Point(5, 1), door="hinged"), (5, 1), 0.9),
        (feature(Point(5, 1), indoor="door"), (5, 1), 0.9),
        (feature(Point(5, 1), indoor="door", level="0", width="70 cm"), (5, 1), 0.7),
        (feature(MultiPoint([(5, 1)]), entrance="yes", level="0"), (5, 1), 0.9),
        (feature(LineString([(5, 0.6), (5, 1.8)]), door="yes", level="0"), (5, 1.2), 1.2),
        (feature(LineString([(5, 0.6), (5, 1.8)]), indoor="door"), (5, 1.2), 1.2),
        (feature(LineString([(5, 0.6), (5, 1.8)]), door="yes", level="0", width="0,8"), (5, 1.2), 0.8),
        (feature(MultiLineString([[(5, 0.6), (5, 1)], [(5, 1), (5, 2)]]), door="yes"), (5, 1.3), 1.4),
        (feature(box(4.9, 0.5, 5.1, 1.5), indoor="door", level="0"), (5, 1), 1.0),
        (feature(LineString([(5.2, 0.6), (5.2, 1.8)]), door="yes", level="0"), (5, 1.2), 1.2),  # beside the wall
        (feature(LineString([(4, 1), (6.5, 1.5)]), door="yes", level="0"), (5, 1.2), 0.9),  # a way through it
        (feature(LineString([(4.6, 1.2), (5.6, 1.2)]), door="yes", width="1"), (5, 1.2), 1.0),
        (feature(GeometryCollection([Point(5, 1.2), LineString([(5, 0.6), (5, 1.8)])]), door="yes"), (5, 1.2), 1.2),
    ],
)  # fmt: skip
def test_a_door_is_one_however_it_is_drawn(tmp_path, marked, middle, width):
    (plan,) = read(tmp_path, [*hall_and_side(), marked])
    (opening,) = plan.doors
    assert off_corner(plan, opening) == pytest.approx(middle, abs=0.02)
    assert opening.width == pytest.approx(width, rel=2e-3)
    assert parts(plan) == 1
    free = 4.9 * 3.9 + 6.9 * 2.9 + 0.1 * width
    assert plan.free.area == pytest.approx(free, rel=2e-3)


def test_several_doors_in_one_feature_are_several(tmp_path):
    rooms = [*hall_and_side(), room(box(0, 4, 12, 9))]
    both = feature(GeometryCollection([Point(5, 1), GeometryCollection([MultiPoint([(2, 4)])])]), door="yes")
    (plan,) = read(tmp_path, [*rooms, both])
    assert [off_corner(plan, each) for each in plan.doors] == [
        pytest.approx(spot, abs=0.02) for spot in ((5, 1), (2, 4))
    ]
    assert parts(plan) == 1


def test_doors_without_a_level_stand_on_that_of_their_rooms(tmp_path):
    upper = [room(box(0, 0, 2, 4), "1"), room(box(2, 0, 12, 4), "1")]
    doors = [feature(Point(5, 1), door="yes"), feature(Point(2, 3), door="yes")]
    ground, first = read(tmp_path, [*hall_and_side("0"), *upper, *doors])
    assert [off_corner(ground, each) for each in ground.doors] == [pytest.approx((5, 1), abs=0.02)]
    assert [off_corner(first, each) for each in first.doors] == [pytest.approx((2, 3), abs=0.02)]
    assert "2 doors without a level taken on that of their rooms" in ground.remarks


def test_a_door_that_is_a_corner_of_rooms_belongs_to_them_alone(tmp_path):
    """On level 1 the same wall has no door: its outlines run through the spot without a node."""
    nodes = [Polygon([(0, 0), (5, 0), (5, 1), (5, 4), (0, 4)]), Polygon([(5, 0), (12, 0), (12, 3), (5, 3), (5, 1)])]
    ground, first = read(
        tmp_path, [*(room(each, "0") for each in nodes), *hall_and_side("1"), feature(Point(5, 1), door="yes")]
    )
    assert [len(plan.doors) for plan in (ground, first)] == [1, 0]


def test_doors_that_belong_nowhere_are_counted(tmp_path):
    lost = [
        feature(Point(30, 30), door="yes"),
        door(5, 1, "EG"),
        door(5, 1, "7"),
        feature(None, door="yes", level="0"),
    ]
    (plan,) = read(tmp_path, [*hall_and_side(), *lost])
    assert plan.doors == ()
    assert plan.remarks == (
        "1 door without a level that can be read left out ('EG')",
        "1 door without a shape left out (no geometry)",
        "1 door without a level in no room left out",
        "1 door on levels without a room left out",
    )


def test_the_entrance_of_a_building_outline_is_no_door_as_large_as_the_building(tmp_path):
    around = feature(box(-1, -1, 13, 5), building="yes", entrance="yes", level="0")
    (plan,) = read(tmp_path, [*hall_and_side(), around])
    assert plan.doors == ()
    assert plan.remarks[0] == "1 feature not read: 1 without indoor=..."


@pytest.mark.parametrize(
    ("walls", "area"),
    [
        (MultiLineString([[(4, 0), (4, 6)], [(7, 0), (7, 6)]]), 9.9 * 5.9 - 2 * 0.1 * 5.9),
        (GeometryCollection([LineString([(4, 0), (4, 6)]), box(7, 1, 8, 3)]), 9.9 * 5.9 - 0.1 * 5.9 - 2.0),
        (GeometryCollection([GeometryCollection([MultiPolygon([box(1, 1, 2, 2), box(5, 2, 7, 5)])])]), 9.9 * 5.9 - 7.0),
        (LineString(box(2, 1, 6, 4).exterior), 9.9 * 5.9 - (4.1 * 3.1 - 3.9 * 2.9)),  # runs around, is not filled
    ],
)
def test_walls_of_several_parts_are_walls(tmp_path, walls, area):
    (plan,) = read(tmp_path, [room(box(0, 0, 10, 6)), feature(walls, indoor="wall", level="0")])
    assert plan.free.area == pytest.approx(area, rel=2e-3)
    assert plan.remarks == ("1 wall mapped inside rooms taken off the floor",)


@pytest.mark.parametrize(
    "shape",
    [
        MultiPolygon([HALL, box(20, 0, 23, 2)]),
        GeometryCollection([HALL, Point(1, 1), box(20, 0, 23, 2)]),
        MultiLineString([HALL.exterior.coords, box(20, 0, 23, 2).exterior.coords]),
    ],
)
def test_rooms_of_several_parts_are_rooms(tmp_path, shape):
    (plan,) = read(tmp_path, [room(shape)])
    assert plan.free.area == pytest.approx(4.9 * 3.9 + 2.9 * 1.9, rel=1e-3)
    assert len(plan.rooms) == 1


@pytest.mark.parametrize(
    ("level", "floors"),
    [("0,5", ["0.5"]), ("2-0", ["0", "1", "2"]), ("+1", ["1"]), ("\u22123", ["-3"]), ("-1,0", ["-1", "0"])],
)
def test_levels_as_people_write_them(tmp_path, level, floors):
    rooms = [room(HALL, level), room(SIDE, level), door(5, 1, level)]
    plans = read(tmp_path, rooms)
    assert [plan.floor for plan in plans] == [f"site.{floor}" for floor in floors]
    assert [(len(plan.doors), parts(plan)) for plan in plans] == [(1, 1)] * len(floors)
    guessed = "3 levels with a comma are taken as numbers, not as a list ('0,5')"
    assert all((guessed in plan.remarks) == (level == "0,5") for plan in plans)


def test_levels_that_cannot_be_read_are_said(tmp_path):
    (plan,) = read(
        tmp_path, [*hall_and_side(), room(level="B1"), room(box(0, 9, 3, 12), "0;UG"), door(5, 1, repeat_on="x")]
    )
    assert plan.remarks == (
        "1 room without a level that can be read left out ('B1')",
        "2 levels beside others that cannot be read left out ('UG', 'x')",
    )
    with pytest.raises(PlanError, match=r"or 0-2; the levels are 'B1', 'EG'"):
        read(tmp_path, [room(level="B1"), room(level="B1"), room(level="EG")])


def test_a_map_without_any_level_has_one(tmp_path):
    bare = [feature(HALL, indoor="room"), feature(SIDE, indoor="corridor"), feature(Point(5, 1), door="yes")]
    (plan,) = read(tmp_path, bare)
    assert (plan.floor, len(plan.doors), parts(plan)) == ("site.0", 1, 1)
    assert plan.remarks[0] == "no feature has a level: all rooms are taken as one level, 0"


def test_areas_that_are_only_said_to_be_indoors_are_rooms_where_none_is(tmp_path):
    (plan,) = read(
        tmp_path, [*(each | {"properties": {"indoor": "yes", "level": "0"}} for each in hall_and_side()), door(5, 1)]
    )
    assert (len(plan.rooms), parts(plan)) == (2, 1)
    assert plan.remarks == ("2 areas with indoor=yes taken as rooms",)
    within = [
        feature(box(1, 1, 2, 2), indoor="yes", level="0"),
        feature(box(-9, -9, 20, 20), indoor="yes", building="yes"),
    ]
    (plan,) = read(tmp_path, [*hall_and_side(), door(5, 1), *within, feature(Point(1, 1), indoor="yes", level="0")])
    assert plan.free.area == pytest.approx(4.9 * 3.9 + 6.9 * 2.9 + 0.09, rel=2e-3)
    assert plan.remarks == (
        "2 features not read: 2 with indoor=yes",
        "1 area with indoor=yes inside or around rooms left out",
    )


def test_what_is_not_read_is_counted_by_kind(tmp_path):
    others = [
        feature(Point(1, 1), indoor="wall", level="0"),
        feature(LineString([(0, 0), (1, 1)]), indoor="room", level="0"),
        feature(box(1, 1, 2, 2), indoor="pathway", level="0"),
        *[feature(Point(9, 9), shop="kiosk")] * 3,
    ]
    (plan,) = read(tmp_path, [*hall_and_side(), door(5, 1), *others])
    assert plan.remarks == (
        "1 room without an outline left out (LineString)",
        "1 wall without a line or outline left out (Point)",
        "4 features not read: 3 without indoor=..., 1 with indoor=pathway",
    )


@pytest.mark.parametrize(
    ("tags", "width"),
    [({"width": "1,2"}, 1.2), ({"width": "75 cm"}, 0.75), ({"width": "2'6\""}, 0.762), ({"door:width": "800 mm"}, 0.8)],
)
def test_widths_as_people_write_them(tmp_path, tags, width):
    (plan,) = read(tmp_path, [*hall_and_side(), door(5, 1, **tags)])
    assert plan.doors[0].width == pytest.approx(width)
    assert plan.remarks == ()


def test_widths_that_cannot_be_read_are_counted(tmp_path):
    rooms = [*hall_and_side(), room(box(0, 4, 12, 9))]
    (plan,) = read(tmp_path, [*rooms, door(5, 1, width="wide"), door(2, 4, width=[1]), door(8, 9, width="1.1")])
    assert [each.width for each in plan.doors] == [pytest.approx(0.9)] * 2
    assert plan.remarks[0] == (
        "2 doors have widths that are no door's or cannot be read ('wide', 'a list of 1'): the usual one is taken"
    )


def test_a_building_on_the_180th_meridian_is_one(tmp_path):
    taveuni = (179.99999, -16.8)
    shapes = [(HALL, {"indoor": "room"}), (SIDE, {"indoor": "room"}), (Point(5, 1), {"door": "yes"})]
    features = [feature(shape, around=taveuni, level="0", **tags) for shape, tags in shapes]
    longitudes = [spot[0] for each in features[:2] for spot in each["geometry"]["coordinates"][0]]
    assert min(longitudes) < -179.9
    assert max(longitudes) > 179.9
    (plan,) = read(tmp_path, features)
    assert parts(plan) == 1
    assert plan.free.area == pytest.approx(4.9 * 3.9 + 6.9 * 2.9 + 0.09, rel=2e-3)
    assert off_corner(plan, plan.doors[0]) == pytest.approx((5, 1), abs=0.02)


def test_a_room_that_is_cut_in_two_at_the_180th_meridian_is_one(tmp_path):
    """As RFC 7946 wants it: the halves end at 180 and begin at -180."""
    halves = [[[west, -16.8], [east, -16.8], [east, -16.79995], [west, -16.79995], [west, -16.8]] for west, east in
              ((179.99996, 180.0), (-180.0, -179.99993))]  # fmt: skip
    geometry = {"type": "MultiPolygon", "coordinates": [[half] for half in halves]}
    record = {"type": "Feature", "properties": {"indoor": "room", "level": "0"}, "geometry": geometry}
    (plan,) = read(tmp_path, [record])
    wide, high = 0.00011 * 106_590, 0.00005 * 110_667  # metres of a degree at 16.8 degrees south
    assert plan.free.area == pytest.approx((wide - 0.1) * (high - 0.1), rel=2e-3)
    assert (parts(plan), plan.remarks) == (1, ())


def test_tags_inside_a_property_and_far_behind_are_found(tmp_path):
    nested = [each | {"properties": {"type": "way", "tags": each["properties"], "meta": {}}} for each in two_rooms()]
    road = feature(LineString([(k % 90, k) for k in range(300)]), highway="footway")
    path = write_features(tmp_path / "site.geojson", [*[road] * 150, *nested])
    assert path.read_bytes().index(b'"indoor"') > 1 << 20
    (entry,) = classify([lone_file(path)])
    (plan,) = read_plans(entry.file, entry.reader)
    assert (entry.reader.name, parts(plan), len(plan.doors)) == ("indoor_geojson", 1, 1)


CASES = DATA.parent / "cases"


@pytest.mark.parametrize(
    ("name", "plan_id", "area", "pieces", "widths"),
    [
        ("07_geojson_doors_lost/door_nolevel.geojson", "door_nolevel.0", 58.0, 1, [0.9]),
        ("08_multi_geometry_dropped/multipoint_doors.geojson", "multipoint_doors.0", 58.0, 1, [0.9]),
        ("08_multi_geometry_dropped/wall_multilines.geojson", "wall_multilines.0", 28.3, 2, []),
        ("09_level_decimal_comma/level_comma.geojson", "level_comma.0.5", 58.0, 1, [0.9]),
        ("21_door_width_units/w_comma.geojson", "w_comma.0", 58.0, 1, [1.2]),
        ("21_door_width_units/w_cm.geojson", "w_cm.0", 58.0, 1, [0.9]),
        ("21_door_width_units/w_in.geojson", "w_in.0", 58.0, 1, [0.914]),
        ("22_messages/late_indoor.geojson.gz", "late_indoor.0", 58.0, 1, [0.9]),
        ("22_messages/nested_tags.geojson", "nested_tags.0", 58.0, 1, [0.9]),
        # A degree of latitude has 110.66 km there, not the 111.32 km of a sphere with which the file was drawn.
        ("22_messages/antimeridian.geojson", "antimeridian.0", 57.6, 1, [0.9]),
    ],
)
def test_the_collected_cases_give_their_values(name, plan_id, area, pieces, widths):
    if not (CASES / name).is_file():
        pytest.skip(f"no cases in {CASES}")
    with open_source(CASES / name) as files:
        ((plan,),) = [list(read_plans(entry.file, entry.reader)) for entry in classify(files)]
    assert (plan.plan_id, parts(plan)) == (plan_id, pieces)
    assert plan.free.area == pytest.approx(area, abs=0.06)
    assert [each.width for each in plan.doors] == widths


def test_outdoor_features_are_passed_over(tmp_path):
    outdoors = [feature(box(-900, -900, 900, 900), landuse="railway"), feature(Point(400, 0), highway="bus_stop")]
    (plan,) = read(tmp_path, [*outdoors, room()])
    assert plan.bounds.max_x - plan.bounds.min_x == pytest.approx(10, rel=1e-3)


@pytest.mark.parametrize(
    ("features", "said"),
    [
        ([], "no room, area or corridor with a level, expected indoor="),
        ([room(level="EG")], "no room, area or corridor with a level.*the levels are 'EG'"),
        ([room(level=""), door(0, 0)], "no room, area or corridor with a level"),
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
