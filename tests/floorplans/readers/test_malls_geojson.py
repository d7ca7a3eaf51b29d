import json
import os
from pathlib import Path

import pytest
import shapely
from shapely.geometry import GeometryCollection, LineString, MultiLineString, MultiPolygon, Point, Polygon, box, mapping

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.readers import COMPANION, PLAN, classify, read_plans
from pipeline.floorplans.readers.malls_geojson import MallsGeoJson
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.sources import lone_file, open_source
from tests.floorplans.geojson_samples import ELL, feature, two_rooms, write_features

DATA = Path(os.environ.get("HINTERLAND_DATA", Path(__file__).parents[3].parent / "shared" / "data"))
HANGZHOU = (120.131, 30.302)
DAMAGED = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [[[0, float("nan")]]]}}

SWAPPED = {"properties": {"floor": "F1"}, "geometry": mapping(box(30.302, 120.13, 30.303, 120.131))}  # latitude first


def floor(shape=ELL):
    return feature(shape, around=HANGZHOU, two_class=210103, floor="F1")


def shop(shape, name="shop"):
    return feature(shape, around=HANGZHOU, category=["5d56"], name=name)


def write(tmp_path, *features, width=None):
    path = write_features(tmp_path / "site7" / "F1" / "geojson_map.json", list(features))
    if width is not None:
        path.with_name("floor_info.json").write_text(json.dumps({"map_info": {"width": width, "height": 8.0}}))
    return path


def read(path):
    return list(MallsGeoJson().read(path, ReadOptions()))


def test_the_floor_is_the_outline_less_the_shops(tmp_path):
    (plan,) = read(write(tmp_path, floor(), shop(box(1, 5, 3, 7), "tea"), width=10.0))
    assert (plan.plan_id, plan.building, plan.floor) == ("site7.F1", "site7", "site7.F1")
    assert plan.source == "site7/F1/geojson_map.json"
    west, south, east, north = plan.bounds
    assert (east - west, north - south) == pytest.approx((10.0, 8.0), rel=1e-3)
    assert plan.free.area == pytest.approx(ELL.area - 4.0, rel=1e-3)
    assert [room.label for room in plan.rooms] == ["tea"]
    assert plan.remarks == ("1 shop or void closed: only the corridors are floor",)


def test_an_ell_is_not_mirrored(tmp_path):
    (plan,) = read(write(tmp_path, floor()))
    _, south, east, north = plan.bounds
    assert shapely.contains_xy(plan.free, east - 1, south + 1)
    assert not shapely.contains_xy(plan.free, east - 1, north - 1)


def test_slivers_between_shops_are_no_floor(tmp_path):
    shops = [shop(box(0, 2, 5, 8)), shop(box(5.1, 2, 10, 8))]
    (plan,) = read(write(tmp_path, floor(box(0, 0, 10, 8)), *shops, shop(box(5, 2, 5.1, 3))))
    assert len(shapely.get_parts(plan.free)) == 1
    assert plan.free.area == pytest.approx(20.0, rel=1e-3)


def test_another_size_than_stated_is_said(tmp_path):
    (plan,) = read(write(tmp_path, floor(), width=11.0))
    assert plan.remarks[1].startswith("floor_info.json states a width of 11.0 m, the coordinates give 10.0 m")


@pytest.mark.parametrize(
    "shape",
    [
        MultiPolygon([box(1, 5, 3, 7), box(5, 1, 8, 2)]),
        GeometryCollection([box(1, 5, 3, 7), Point(2, 6), GeometryCollection([box(5, 1, 8, 2)])]),
        MultiLineString([box(1, 5, 3, 7).exterior.coords, box(5, 1, 8, 2).exterior.coords]),
    ],
)
def test_shops_of_several_parts_are_closed(tmp_path, shape):
    (plan,) = read(write(tmp_path, floor(GeometryCollection([ELL])), shop(shape)))
    assert plan.free.area == pytest.approx(ELL.area - 7.0, rel=1e-3)
    assert plan.remarks == ("1 shop or void closed: only the corridors are floor",)


def test_what_has_no_outline_is_counted(tmp_path):
    signs = [shop(Point(1, 1)), shop(Point(2, 2)), shop(LineString([(1, 1), (2, 3)])), shop(None)]
    (plan,) = read(write(tmp_path, floor(), shop(box(1, 5, 3, 7)), *signs))
    assert plan.remarks[1] == "4 features without an outline left out (LineString, Point, no geometry)"


def test_a_crossed_outline_is_repaired_and_said(tmp_path):
    (plan,) = read(write(tmp_path, floor(box(0, 0, 9, 9)), shop(Polygon([(1, 1), (4, 4), (4, 1), (1, 4)]))))
    assert plan.free.area == pytest.approx(81 - 4.5, rel=1e-3)
    assert plan.remarks[-1] == "1 outline crossed itself and was repaired"


@pytest.mark.parametrize(
    ("features", "said"),
    [
        ([], "nothing with coordinates"),
        ([DAMAGED, floor(), shop(box(1, 1, 2, 2))], "the first feature has no outline, expected that of the floor"),
        ([feature(Point(0, 0), around=HANGZHOU), floor()], "the first feature has no outline"),
        ([SWAPPED], "expected degrees"),
        ([floor(), feature(ELL)], "feature without an id: a coordinate lies more than"),
    ],
)
def test_bad_files_are_refused(tmp_path, features, said):
    path = write(tmp_path, *features)
    with pytest.raises(PlanError, match=said) as caught:
        read(path)
    assert str(path) in str(caught.value)


def test_a_bad_size_is_refused(tmp_path):
    with pytest.raises(PlanError, match=r"floor_info\.json: map_info\.width is 'wide', expected a number"):
        read(write(tmp_path, floor(), width="wide"))


def test_files_are_recognised(tmp_path):
    path = write(tmp_path, floor(), shop(box(1, 1, 2, 2)), width=10.0)
    other = write_features(tmp_path / "other.geojson", two_rooms())
    entries = classify([lone_file(path), lone_file(path.with_name("floor_info.json")), lone_file(other)])
    assert [(entry.role, entry.reader.name) for entry in entries] == [
        (PLAN, "malls_geojson"),
        (COMPANION, "malls_geojson"),
        (PLAN, "indoor_geojson"),
    ]


def test_a_real_mall_has_its_stated_size():
    folder = DATA / "malls_geojson" / "dev"
    if not folder.is_dir():
        pytest.skip(f"no malls in {folder}: set HINTERLAND_DATA to the folder that holds malls_geojson")
    with open_source(folder) as files:
        entries = [entry for entry in classify(files) if entry.role != COMPANION]
        plans = [plan for entry in entries for plan in read_plans(entry.file, entry.reader)]
    assert len(plans) == 9
    assert len({plan.building for plan in plans}) == 1
    for plan in plans:
        assert inspect(plan).largest_free_share == 1.0
        assert not any("states" in remark for remark in plan.remarks)  # within 2 %
