import json
import os
from pathlib import Path

import pytest
import shapely
from shapely import affinity
from shapely.geometry import (
    GeometryCollection,
    LineString,
    MultiLineString,
    MultiPoint,
    MultiPolygon,
    Polygon,
    box,
)

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.readers import COMPANION, PLAN, UNRECOGNISED, classify, read_plans
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.readers.wrld import Wrld
from pipeline.floorplans.sources import lone_file, open_source
from tests.floorplans.geojson_samples import ELL, feature, two_rooms, write_features

DATA = Path(os.environ.get("HINTERLAND_DATA", Path(__file__).parents[3].parent / "shared" / "data"))
OUTLINE = box(0, 0, 10, 4)
WALL = box(4.9, 0, 5.1, 4)
DOOR = box(4.9, 1.5, 5.1, 2.4)


def of(kind, shape):
    return feature(shape, type=kind)


def read(tmp_path, *features, name="house-floor-1.geojson"):
    return list(Wrld().read(write_features(tmp_path / name, list(features)), ReadOptions()))


def test_the_floor_is_the_outline_less_the_walls_with_doors_cut(tmp_path):
    (plan,) = read(
        tmp_path, of("building_outline", OUTLINE), of("wall", WALL), of("door", DOOR), of("stairs", box(0, 0, 1, 1))
    )
    assert (plan.plan_id, plan.building, plan.floor) == ("house-floor-1", "house", "house-floor-1")
    assert len(shapely.get_parts(plan.free)) == 1
    assert plan.free.area == pytest.approx(40 - 0.8 + 0.18, rel=1e-3)
    (door,) = plan.doors
    assert door.width == pytest.approx(0.9, abs=0.002)
    assert [room.label for room in plan.rooms] == ["stairs"]


def test_a_turned_door_keeps_its_width(tmp_path):
    turned = [affinity.rotate(shape, 30, origin=(0, 0)) for shape in (OUTLINE, WALL, DOOR)]
    kinds = ("building_outline", "wall", "door")
    (plan,) = read(tmp_path, *(of(kind, shape) for kind, shape in zip(kinds, turned, strict=True)))
    assert plan.doors[0].width == pytest.approx(0.9, abs=0.002)
    assert len(shapely.get_parts(plan.free)) == 1


def test_an_ell_is_not_mirrored_and_keeps_its_size(tmp_path):
    (plan,) = read(tmp_path, of("building_outline", ELL))
    west, south, east, north = plan.bounds
    assert (east - west, north - south) == pytest.approx((10.0, 8.0), rel=1e-3)
    assert shapely.contains_xy(plan.free, east - 1, south + 1)
    assert not shapely.contains_xy(plan.free, east - 1, north - 1)


@pytest.mark.parametrize(
    ("wall", "door", "area"),
    [
        (MultiPolygon([box(4.9, 0, 5.1, 1.5), box(4.9, 2.4, 5.1, 4)]), None, 40 - 0.2 * 3.1),
        (GeometryCollection([WALL, GeometryCollection([box(7, 0, 7.5, 2)])]), DOOR, 40 - 0.8 - 1.0 + 0.18),
        (LineString([(5, 0), (5, 4)]), LineString([(5, 1.5), (5, 2.4)]), 40 - 0.1 * 3.1),
        (MultiLineString([[(5, 0), (5, 4)], [(7, 0), (7, 2)]]), MultiPolygon([DOOR]), 40 - 0.4 - 0.205 + 0.09),
        (GeometryCollection([WALL, LineString([(7, 0), (7, 2)])]), GeometryCollection([DOOR]), 40 - 0.8 - 0.205 + 0.18),
    ],
)
def test_walls_and_doors_of_any_shape_are_read(tmp_path, wall, door, area):
    doors = [of("door", door)] if door is not None else []
    (plan,) = read(tmp_path, of("building_outline", GeometryCollection([OUTLINE])), of("wall", wall), *doors)
    assert plan.free.area == pytest.approx(area, abs=0.04)
    assert len(shapely.get_parts(plan.free)) == 1
    assert [each.width for each in plan.doors] == [pytest.approx(0.9, abs=0.002)] * len(doors)
    assert plan.remarks == ()


def test_doors_in_one_feature_are_doors_of_their_own(tmp_path):
    doors = MultiPolygon([box(4.9, 0.5, 5.1, 1.2), box(4.9, 2, 5.1, 3.3)])
    (plan,) = read(tmp_path, of("building_outline", OUTLINE), of("wall", WALL), of("door", doors))
    assert sorted(each.width for each in plan.doors) == pytest.approx([0.7, 1.3], abs=0.002)


def test_what_has_no_outline_is_counted(tmp_path):
    others = [of("door", MultiPoint([(5, 1), (5, 2)])), of("stairs", LineString([(0, 0), (1, 1)])), of("wall", None)]
    (plan,) = read(tmp_path, of("building_outline", OUTLINE), *others)
    assert plan.remarks == ("3 features without an outline left out (LineString, MultiPoint, no geometry)",)


def test_without_its_door_a_wall_seals(tmp_path):
    (plan,) = read(tmp_path, of("building_outline", OUTLINE), of("wall", WALL))
    assert len(shapely.get_parts(plan.free)) == 2


@pytest.mark.parametrize("kind", ["window", "inaccessible_space", "elevator"])
def test_what_cannot_be_entered_is_no_floor(tmp_path, kind):
    (plan,) = read(tmp_path, of("building_outline", OUTLINE), of(kind, box(0, 0, 2, 4)))
    assert plan.free.area == pytest.approx(32, rel=1e-3)


def test_slivers_and_doors_beyond_the_outline_are_no_floor(tmp_path):
    walls = [of("wall", box(0, 3, 10, 3.8)), of("door", box(9.5, 1, 12, 2))]
    (plan,) = read(tmp_path, of("building_outline", OUTLINE), *walls)
    assert plan.free.area == pytest.approx(30, rel=1e-3)


def test_a_crossed_wall_is_repaired_and_said(tmp_path):
    wall = Polygon([(4, 1), (5, 3), (5, 1), (4, 3)])
    (plan,) = read(tmp_path, of("building_outline", OUTLINE), of("wall", wall))
    assert plan.free.is_valid
    assert plan.remarks == ("1 outline crossed itself and was repaired",)


@pytest.mark.parametrize(
    ("features", "said"),
    [
        ([], "nothing with coordinates"),
        ([of("wall", WALL)], "no building_outline with a shape, expected the outline of the floor"),
        ([of("building_outline", LineString([(0, 0), (1, 1)]))], "no building_outline with a shape"),
        (
            [of("building_outline", OUTLINE), feature(WALL, around=(14.9, 51.0), type="wall")],
            "a coordinate lies more than",
        ),
        (
            [{"properties": {"type": "building_outline"}, "geometry": shapely.geometry.mapping(box(0, 0, 900, 900))}],
            "degrees",
        ),
    ],
)
def test_bad_files_are_refused(tmp_path, features, said):
    with pytest.raises(PlanError, match=said) as caught:
        read(tmp_path, *features)
    assert str(tmp_path / "house-floor-1.geojson") in str(caught.value)


def test_files_are_recognised(tmp_path):
    floor = write_features(tmp_path / "house-floor-1.geojson", [of("building_outline", OUTLINE)])
    routes = write_features(tmp_path / "house-floor-1-paths.geojson", [of("pathway", LineString([(0, 0), (1, 1)]))])
    index = tmp_path / "main.json"
    index.write_text(json.dumps({"levels": [{"id": "1", "z_order": 0}]}))
    foreign = write_features(tmp_path / "garden-paths.geojson", [of("pathway", LineString([(0, 0), (1, 1)]))])
    campus = write_features(tmp_path / "campus-paths.geojson", two_rooms())
    entries = classify([lone_file(path) for path in (floor, routes, index, foreign, campus)])
    assert [entry.role for entry in entries][:3] == [PLAN, COMPANION, COMPANION]
    assert [entry.reader.name for entry in entries[:3]] == ["wrld"] * 3
    assert entries[3].role not in (PLAN, COMPANION, UNRECOGNISED)
    assert (entries[4].role, entries[4].reader.name) == (PLAN, "indoor_geojson")


def test_a_real_office_building_is_read():
    folder = DATA / "wrld_westport_house" / "dev"
    if not folder.is_dir():
        pytest.skip(f"no building in {folder}: set HINTERLAND_DATA to the folder that holds wrld_westport_house")
    with open_source(folder) as files:
        entries = [entry for entry in classify(files) if entry.role != COMPANION]
        plans = [plan for entry in entries for plan in read_plans(entry.file, entry.reader)]
    assert len(plans) == 7
    assert len({plan.building for plan in plans}) == 1
    reports = {plan.plan_id: inspect(plan) for plan in plans}
    assert all(max(report.width_m, report.height_m) < 65 for report in reports.values())
    for level in (1, 2, 4, 5):
        assert reports[f"westport-house-floor-{level}"].free_components == 1
    assert all(plan.doors and plan.free.is_valid for plan in plans)
