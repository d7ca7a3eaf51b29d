import json
import re

import pytest
from shapely.geometry import Polygon, box

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Door, Layer, Location, Room
from pipeline.floorplans.readers import PLAN, classify, read_plan_file
from pipeline.floorplans.readers.plan_geojson import PlanGeoJson
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.sources import lone_file
from pipeline.floorplans.writers.geojson import GeoJson
from tests.floorplans.geojson_samples import two_rooms, write_features
from tests.floorplans.samples import KNOWN, floor_plan, grid_plan

ELL = Polygon([(0, 0), (10, 0), (10, 4), (4, 4), (4, 8), (0, 8)])
ENDS = (Location(1.0, 1.0), Location(9.0, 1.0))


def written(tmp_path, form="geometry"):
    """A whole file as the writer makes it, to be spoilt."""
    if form == "geometry":
        plan = floor_plan(ELL, rooms=(Room(box(0, 0, 2, 2), "OFFICE"),), doors=(Door(1.0, 2.0, 0.9),), endpoints=ENDS)
    else:
        cells = grid_plan(KNOWN).cells
        plan = grid_plan(KNOWN, layers={"kinds": Layer(cells.astype("uint16"), {1: "wall"})})
    (path,) = GeoJson().write(plan, tmp_path / "floor.geojson")
    return path, json.loads(path.read_text())


def read(path):
    (plan,) = PlanGeoJson().read(path, ReadOptions())
    return plan


def _spoil(content, where, value):
    *steps, last = where
    for step in steps:
        content = content[step]
    if value is ...:
        del content[last]
    else:
        content[last] = value


FREE, ROOM, DOOR, START = range(4)
SLANTED = {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [0, 1], [0, 0]]]}
FAR = {"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 1], [0, 1], [0, 0]]]}
WALL = {"type": "Polygon", "coordinates": [[[1, 1], [1.5, 1], [1.5, 1.5], [1, 1.5], [1, 1]]]}
POINT = {"type": "Point", "coordinates": [0, 0]}
NAN = {"type": "Point", "coordinates": [float("nan"), 0]}


@pytest.mark.parametrize(
    ("form", "where", "value", "said"),
    [
        ("geometry", ["hinterland"], ..., 'no member "hinterland", expected what the writer plan_geojson adds'),
        ("geometry", ["hinterland", "version"], 2, "version 2, expected 1"),
        ("geometry", ["hinterland", "units"], "mm", "units 'mm', expected 'm'. Scale"),
        ("geometry", ["hinterland", "form"], "mesh", "form 'mesh', expected 'geometry' or 'grid'"),
        ("geometry", ["hinterland", "bounds"], [0, 0, 1], "hinterland.bounds is a list of 3, expected a list of 4"),
        ("geometry", ["hinterland", "bounds"], [0, 0, float("inf"), 1], "hinterland.bounds is inf, expected a finite"),
        ("geometry", ["hinterland", "bounds"], [5, 0, 1, 1], "expected [min x, min y, max x, max y] in metres"),
        ("geometry", ["features", FREE], ..., "0 features of kind free, expected the one that is the floor"),
        ("geometry", ["features", ROOM, "properties", "kind"], "free", "2 features of kind free"),
        ("geometry", ["features", FREE, "geometry"], POINT, "the feature of kind free is a Point, expected a Polygon"),
        ("geometry", ["features", FREE, "geometry"], NAN, "1 feature with a damaged shape. Write the plan again"),
        ("geometry", ["features", ROOM, "geometry"], POINT, "room 0 is no area, expected a Polygon"),
        ("geometry", ["features", DOOR, "geometry"], WALL, "door 0 is no Point, expected its middle"),
        ("geometry", ["features", DOOR, "geometry"], None, "door 0 is no Point"),
        (
            "geometry",
            ["features", DOOR, "properties", "width"],
            "wide",
            "the width of door 0 is 'wide', expected a number",
        ),
        (
            "geometry",
            ["features", DOOR, "properties", "width"],
            -1,
            "the width of door 0 is -1 m, expected metres from 0",
        ),
        ("geometry", ["features", START], ..., "a goal without the other end, expected both or none"),
        ("geometry", ["features", START, "geometry"], WALL, "1 features of kind start, expected one Point or none"),
        ("geometry", ["features"], 7, "no list of features"),
        ("grid", ["hinterland", "resolution"], 0, "6 x 8 cells of 0 m, expected"),
        ("grid", ["hinterland", "resolution"], float("nan"), "hinterland.resolution is nan"),
        ("grid", ["hinterland", "resolution"], ..., "hinterland.resolution is 'None', expected a number"),
        ("grid", ["hinterland", "shape"], [0, 8], "0 x 8 cells of 0.5 m"),
        ("grid", ["hinterland", "shape"], [6.5, 8], "6.5 x 8 cells"),
        ("grid", ["hinterland", "shape"], [10**6, 10**6], "1e+06 x 1e+06 cells of 0.5 m, expected 1 to 100,000,000"),
        ("grid", ["hinterland", "shape"], [5, 8], "area unknown: it reaches beyond the grid of 5 x 8 cells"),
        ("grid", ["hinterland", "shape"], "6x8", "hinterland.shape is 6x8, expected a list of 2 numbers"),
        ("grid", ["hinterland", "origin"], [0.2, 0], "area free: an edge does not run along the cells of 0.5 m"),
        (
            "grid",
            ["hinterland", "layers"],
            {},
            "an area of layer 'kinds' with value 1 that hinterland.layers does not list",
        ),
        ("grid", ["hinterland", "layers"], {str(k): {} for k in range(17)}, "17 layers, at most 16 are read"),
        ("grid", ["features", 0, "geometry"], SLANTED, "area free: an edge does not run along the cells"),
        ("grid", ["features", 0, "geometry"], FAR, "area free: it reaches beyond the grid"),
        ("grid", ["features", 0, "geometry"], POINT, "area free: a Point, expected a Polygon or MultiPolygon"),
        ("grid", ["features", 1, "properties", "kind"], "free", "the area clutter overlaps"),
        ("grid", ["features", 3, "properties", "value"], 70000, "an area of layer 'kinds' with value 70000"),
        ("grid", ["features", 3, "properties", "value"], None, "the value of an area of layer kinds is 'None'"),
    ],
)
def test_spoilt_files_are_refused(tmp_path, form, where, value, said):
    path, content = written(tmp_path, form)
    _spoil(content, where, value)
    if "overlaps" in said:
        content["features"][2]["geometry"] = content["features"][0]["geometry"]
    path.write_text(json.dumps(content))
    with pytest.raises(PlanError, match=re.escape(said)) as caught:
        read(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("cut", [0.2, 0.9])
def test_a_cut_file_is_refused(tmp_path, cut):
    path, _ = written(tmp_path)
    path.write_text(path.read_text()[: int(cut * path.stat().st_size)])
    with pytest.raises(PlanError, match="not whole JSON"):
        read(path)


def test_what_is_not_said_comes_from_the_file(tmp_path):
    path, content = written(tmp_path)
    for key in ("plan_id", "building", "floor", "environment", "remarks", "split"):
        del content["hinterland"][key]
    path.write_text(json.dumps(content))
    plan = read(path)
    assert (plan.plan_id, plan.building, plan.floor, plan.source) == ("floor", "floor", "floor", "floor.geojson")
    assert (plan.split, plan.remarks) == (None, ())


@pytest.mark.parametrize("split", ["everything", ["train"], 1])
def test_an_unknown_split_is_left_to_be_decided(tmp_path, split):
    path, content = written(tmp_path)
    content["hinterland"]["split"] = split
    path.write_text(json.dumps(content))
    assert read(path).split is None


def test_names_cannot_lead_out_of_a_folder(tmp_path):
    path, content = written(tmp_path)
    content["hinterland"]["plan_id"] = "../../etc/plan"
    path.write_text(json.dumps(content))
    assert "/" not in read(path).plan_id


def test_a_crossed_floor_is_repaired_and_said(tmp_path):
    path, content = written(tmp_path)
    bow = [[[0, 0], [2, 2], [2, 0], [0, 2], [0, 0]]]
    content["features"][FREE]["geometry"] = {"type": "Polygon", "coordinates": bow}
    path.write_text(json.dumps(content))
    plan = read(path)
    assert plan.free.is_valid
    assert plan.remarks == ("1 outline crossed itself and was repaired",)


def test_what_other_tools_make_of_the_shapes_is_read(tmp_path):
    path, content = written(tmp_path)
    features = content["features"]
    for number, kind in ((DOOR, "MultiPoint"), (START, "MultiPoint")):
        features[number]["geometry"] = {"type": kind, "coordinates": [features[number]["geometry"]["coordinates"]]}
    features[DOOR]["geometry"]["coordinates"].append([3.5, 0.5])
    features[FREE]["geometry"] = {"type": "GeometryCollection", "geometries": [features[FREE]["geometry"]]}
    outline = {"type": "MultiPolygon", "coordinates": [features[ROOM]["geometry"]["coordinates"]]}
    features[ROOM]["geometry"] = {"type": "GeometryCollection", "geometries": [outline, POINT]}
    path.write_text(json.dumps(content))
    plan = read(path)
    assert plan.free.equals(ELL)
    assert plan.doors == (Door(1.0, 2.0, 0.9), Door(3.5, 0.5, 0.9))
    assert plan.endpoints == ENDS
    assert plan.rooms[0].outline.equals(box(0, 0, 2, 2))
    assert plan.remarks == ()


@pytest.mark.parametrize(
    ("form", "kinds", "said"),
    [
        ("geometry", ["note"], "1 feature not read: 1 of kind 'note'"),
        ("geometry", ["layer", "unknown", "layer"], "3 features not read: 2 of kind 'layer', 1 of kind 'unknown'"),
        ("grid", ["room", ""], "2 features not read: 1 of kind 'room', 1 of kind ''"),
    ],
)
def test_features_of_other_kinds_are_counted(tmp_path, form, kinds, said):
    path, content = written(tmp_path, form)
    content["features"] += [{"type": "Feature", "properties": {"kind": kind}, "geometry": POINT} for kind in kinds]
    path.write_text(json.dumps(content))
    assert read(path).remarks == (said,)


def test_a_member_far_behind_the_features_is_found(tmp_path):
    path, content = written(tmp_path)
    content["features"][ROOM]["properties"]["note"] = "x" * 3_000_000
    path.write_text(json.dumps({key: content[key] for key in ("type", "features", "hinterland")}))
    (entry,) = classify([lone_file(path)])
    assert (entry.role, entry.reader.name) == (PLAN, "plan_geojson")


def test_own_files_are_recognised_however_they_are_laid_out(tmp_path):
    path, content = written(tmp_path)
    for indent in (None, 2):
        path.write_text(json.dumps(content, indent=indent, sort_keys=True))
        (entry,) = classify([lone_file(path)])
        assert (entry.role, entry.reader.name) == (PLAN, "plan_geojson")
        assert read_plan_file(path)[0].free.equals(ELL)


def test_foreign_files_are_not_recognised(tmp_path):
    osm = two_rooms()
    osm[0]["properties"]["name"] = "hinterland"
    path = write_features(tmp_path / "osm.geojson", osm)
    assert not PlanGeoJson().sniff(path)
    assert not PlanGeoJson().sniff(tmp_path / "missing.geojson")
    assert not PlanGeoJson().sniff(tmp_path)
    assert not PlanGeoJson().accompanies(written(tmp_path)[0])
