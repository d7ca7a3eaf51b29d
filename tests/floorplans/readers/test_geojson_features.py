import json

import pytest
from shapely.geometry import LineString, MultiPolygon, Point, Polygon, box

from pipeline.errors import PlanError
from pipeline.floorplans.projection import LocalFrame
from pipeline.floorplans.readers.geojson_features import (
    Feature,
    load_features,
    mentions,
    metres_in,
    metres_of,
    outline_of,
    say_repaired,
)
from tests.floorplans.geojson_samples import write_features

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]


def _file(tmp_path, *geometries):
    features = [{"type": "Feature", "properties": {"kind": "a"}, "geometry": geometry} for geometry in geometries]
    return write_features(tmp_path / "plan.geojson", features)


@pytest.mark.parametrize(
    ("geometry", "shape"),
    [
        ({"type": "Point", "coordinates": [1, 2]}, Point(1, 2)),
        ({"type": "Point", "coordinates": [1, 2, 30.5]}, Point(1, 2)),
        ({"type": "LineString", "coordinates": [[0, 0], [1, 1]]}, LineString([(0, 0), (1, 1)])),
        ({"type": "Polygon", "coordinates": [SQUARE]}, box(0, 0, 1, 1)),
        ({"type": "MultiPolygon", "coordinates": [[SQUARE]]}, MultiPolygon([box(0, 0, 1, 1)])),
    ],
)
def test_shapes_are_read(tmp_path, geometry, shape):
    (found,) = load_features(_file(tmp_path, geometry)).features
    assert found.shape.equals(shape)
    assert not found.shape.has_z


def test_holes_stay_holes(tmp_path):
    hole = [[0.2, 0.2], [0.2, 0.4], [0.4, 0.4], [0.2, 0.2]]
    (found,) = load_features(_file(tmp_path, {"type": "Polygon", "coordinates": [SQUARE, hole]})).features
    assert found.shape.area == pytest.approx(0.98)


@pytest.mark.parametrize("kind", ["MultiPoint", "MultiLineString", "GeometryCollection"])
def test_other_shapes_are_none_and_no_damage(tmp_path, kind):
    found = load_features(_file(tmp_path, {"type": kind, "coordinates": []}, None))
    assert [feature.shape for feature in found.features] == [None, None]
    assert found.remarks() == ()


@pytest.mark.parametrize(
    "geometry",
    [
        {"type": "Point", "coordinates": [float("nan"), 2]},
        {"type": "Point", "coordinates": [float("inf"), 2]},
        {"type": "Point", "coordinates": [10**400, 2]},
        {"type": "Point", "coordinates": ["13.7", "51"]},
        {"type": "Point", "coordinates": []},
        {"type": "Point"},
        {"type": "LineString", "coordinates": [[0, 0]]},
        {"type": "Polygon", "coordinates": []},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, 1]]]},
        {"type": "Polygon", "coordinates": [[[0, 0], [1, None], [1, 1], [0, 0]]]},
        {"type": "MultiPolygon", "coordinates": []},
        {"type": "MultiPolygon", "coordinates": [7]},
        {"type": "Circle", "coordinates": [0, 0]},
        {"coordinates": [0, 0]},
        "POINT (0 0)",
        [],
    ],
)
def test_damaged_shapes_are_counted(tmp_path, geometry):
    found = load_features(_file(tmp_path, geometry, {"type": "Point", "coordinates": [1, 2]}))
    assert [feature.shape for feature in found.features] == [Point(1, 2)]
    assert found.remarks() == ("1 feature with a damaged shape left out",)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "not whole JSON"),
        ('{"type": "FeatureCollection", "features": [', "not whole JSON"),
        ("[" * 100_000, "nested too deeply"),
        ("[]", "no list of features, expected a GeoJSON FeatureCollection"),
        ('{"type": "Topology", "objects": {}}', "no list of features"),
        ('{"features": {"a": 1}}', "no list of features"),
        ('{"features": [1, null, "x"]}', "all 3 features are damaged"),
        (json.dumps({"features": [{}] * 100_001}), "100,001 features, at most 100,000"),
    ],
)
def test_bad_files_are_refused(tmp_path, content, said):
    path = tmp_path / "plan.geojson"
    path.write_text(content)
    with pytest.raises(PlanError, match=said) as caught:
        load_features(path)
    assert str(path) in str(caught.value)


def test_too_many_coordinates_are_refused(tmp_path):
    line = {"type": "LineString", "coordinates": [[0, 0]] * 600_000}
    with pytest.raises(PlanError, match="more than 1,000,000 coordinates"):
        load_features(_file(tmp_path, line, line))


def test_properties_become_short_text():
    tags = {"a": " hall\n 7 ", "b": 1, "c": 0.5, "d": None, "e": True, "f": [1], "g": {}, "h": "x" * 500}
    feature = Feature(None, tags, "", {})
    texts = {key: feature.text(key) for key in "abcdefghi"}
    assert texts | {"h": ""} == {
        "a": "hall 7",
        "b": "1",
        "c": "0.5",
        "d": "",
        "e": "",
        "f": "",
        "g": "",
        "h": "",
        "i": "",
    }
    assert len(texts["h"]) == 120


def test_properties_and_ids_of_strangers(tmp_path):
    path = write_features(tmp_path / "a.json", [{"properties": [1], "id": {}, "geometry": None}, {"id": 7}])
    first, second = load_features(path).features
    assert (first.properties, first.identity, second.identity) == ({}, "", "7")


def test_an_outline_that_crosses_itself_is_repaired():
    bow = Polygon([(0, 0), (2, 2), (2, 0), (0, 2)])
    outline, repaired = outline_of(bow)
    assert repaired
    assert outline.is_valid
    assert outline.area == pytest.approx(2.0)


def test_what_encloses_no_floor_has_no_outline():
    flat = Polygon([(0, 0), (1, 0), (2, 0)])
    assert [outline_of(shape) for shape in (None, Point(0, 0), LineString([(0, 0), (1, 0)]), flat)] == [None] * 4


def test_a_closed_line_runs_around_an_outline():
    outline, repaired = outline_of(LineString(SQUARE))
    assert outline.equals(box(0, 0, 1, 1))
    assert not repaired


@pytest.mark.parametrize(
    ("text", "width"),
    [
        ("0.9", 0.9),
        ("1.2 m", 1.2),
        ("1.2M", 1.2),
        ("2m", 2.0),
        *((text, None) for text in ("0.1", "90", "nan", "inf", "-1", "", "wide", "3'")),
    ],
)
def test_widths(text, width):
    assert metres_in(text) == width


def test_a_far_feature_is_named():
    far = Feature(Point(20, 51), {}, "node/7", {})
    with pytest.raises(PlanError, match="feature node/7: a coordinate lies more than"):
        metres_of(far, LocalFrame(13.7, 51.0))
    assert metres_of(Feature(None, {}, "", {}), LocalFrame(13.7, 51.0)) is None


def test_repairs_are_said():
    assert [say_repaired(number) for number in range(3)] == [
        (),
        ("1 outline crossed itself and was repaired",),
        ("2 outlines crossed themselves and were repaired",),
    ]


def test_a_collection_is_told_by_its_words(tmp_path):
    path = _file(tmp_path, None)
    assert mentions(path, "kind")
    assert not mentions(path, "kind", "level")
    assert not mentions(tmp_path / "none.geojson", "kind")
    assert not mentions(tmp_path, "kind")
    (tmp_path / "text").write_text('I say "FeatureCollection" of "kind"')
    assert not mentions(tmp_path / "text", "kind")
