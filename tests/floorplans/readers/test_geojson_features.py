import json

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
)

from pipeline.errors import PlanError
from pipeline.floorplans.projection import LocalFrame
from pipeline.floorplans.readers.geojson_features import (
    Feature,
    load_features,
    mentions,
    metres_of,
    openings_of,
    outline_of,
    say_left_out,
    say_repaired,
)
from tests.floorplans.geojson_samples import write_features

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
POLYGON = {"type": "Polygon", "coordinates": [SQUARE]}
LINE = {"type": "LineString", "coordinates": [[1, 2], [3, 5]]}
MULTILINE = {"type": "MultiLineString", "coordinates": [[[0, 0], [3, 1]], [[4, 4], [5, 7]]]}
SPOT = {"type": "Point", "coordinates": [9, 4]}


def _collection(*geometries):
    return {"type": "GeometryCollection", "geometries": list(geometries)}


def _nested(depth):
    shape = SPOT
    for _ in range(depth):
        shape = _collection(shape)
    return shape


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


@pytest.mark.parametrize(
    "geometry",
    [
        None,
        {"type": "MultiPoint", "coordinates": []},
        {"type": "MultiLineString", "coordinates": []},
        {"type": "GeometryCollection", "geometries": []},
        {"type": "GeometryCollection", "geometries": [{"type": "GeometryCollection", "geometries": []}]},
    ],
)
def test_empty_shapes_are_none_and_no_damage(tmp_path, geometry):
    found = load_features(_file(tmp_path, geometry))
    assert [feature.shape for feature in found.features] == [None]
    assert found.remarks() == ()


@pytest.mark.parametrize(
    ("geometry", "shape"),
    [
        ({"type": "MultiPoint", "coordinates": [[3, 1]]}, Point(3, 1)),
        ({"type": "MultiPoint", "coordinates": [[3, 1], [2, 5, 9]]}, MultiPoint([(3, 1), (2, 5)])),
        ({"type": "MultiLineString", "coordinates": [[[0, 0], [3, 1]]]}, LineString([(0, 0), (3, 1)])),
        (
            _collection(MULTILINE, _collection(LINE)),
            MultiLineString([[(0, 0), (3, 1)], [(4, 4), (5, 7)], [(1, 2), (3, 5)]]),
        ),
        (_collection(LINE), LineString([(1, 2), (3, 5)])),
        (_collection(_collection(POLYGON, None)), box(0, 0, 1, 1)),
        (
            _collection(POLYGON, LINE, SPOT),
            GeometryCollection([box(0, 0, 1, 1), LineString([(1, 2), (3, 5)]), Point(9, 4)]),
        ),
    ],
)
def test_parts_and_collections_are_read_flat(tmp_path, geometry, shape):
    (found,) = load_features(_file(tmp_path, geometry)).features
    assert shapely.equals_identical(shapely.normalize(found.shape), shapely.normalize(shape))
    assert found.shape.geom_type == shape.geom_type
    assert not any(hasattr(part, "geoms") for part in getattr(found.shape, "geoms", []))


def test_tags_that_stand_in_one_property_are_read(tmp_path):
    nested = {"type": "way", "id": 3, "tags": {"indoor": "room", "level": "2", "type": "multipolygon"}}
    packed = {"osm_id": "7", "other_tags": '"indoor"=>"area","level"=>"1","note"=>"a \\"b\\", c"'}
    as_text = {"other_tags": '{"indoor": "wall", "level": "-1"}'}
    records = [{"geometry": None, "properties": properties} for properties in (nested, packed, as_text)]
    found = load_features(write_features(tmp_path / "a.geojson", records)).features
    assert [(each.text("indoor"), each.text("level")) for each in found] == [
        ("room", "2"),
        ("area", "1"),
        ("wall", "-1"),
    ]
    assert found[0].text("type") == "way"  # what stands outside wins
    assert found[1].text("note") == 'a "b", c'


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
        {"type": "MultiPoint", "coordinates": [[1, 2], [1, float("nan")]]},
        {"type": "MultiPoint", "coordinates": 7},
        {"type": "MultiLineString", "coordinates": [[[0, 0]]]},
        {"type": "MultiLineString"},
        {"type": "GeometryCollection", "coordinates": []},
        {"type": "GeometryCollection", "geometries": [SPOT, 7]},
        {"type": "GeometryCollection", "geometries": {"a": 1}},
        _nested(17),
        _nested(400),
        {"type": "MultiPoint", "coordinates": [[0, 0]] * 100_001},
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
    ("shape", "outline"),
    [
        (GeometryCollection([Point(9, 9), box(0, 0, 2, 3)]), box(0, 0, 2, 3)),
        (MultiPolygon([box(0, 0, 2, 3), box(2, 0, 5, 3)]), box(0, 0, 5, 3)),  # a room that a map was cut through
        (GeometryCollection([box(0, 0, 2, 3), box(1, 1, 4, 2)]), box(0, 0, 2, 3).union(box(1, 1, 4, 2))),
        (MultiLineString([[(0, 0), (4, 0), (4, 3)], [(4, 3), (0, 3), (0, 0)]]), box(0, 0, 4, 3)),
        (
            MultiLineString([box(0, 0, 6, 5).exterior.coords, box(1, 1, 3, 2).exterior.coords]),
            box(0, 0, 6, 5).difference(box(1, 1, 3, 2)),
        ),
        (GeometryCollection([LineString([(7, 7), (8, 8)]), LineString(box(0, 0, 1, 2).exterior)]), box(0, 0, 1, 2)),
    ],
)
def test_outlines_are_put_together_without_a_repair(shape, outline):
    found, repaired = outline_of(shape)
    assert found.equals(outline)
    assert not repaired


@pytest.mark.parametrize(
    ("shape", "openings"),
    [
        (None, []),
        (Point(3, 1), [((3, 1), None)]),
        (MultiPoint([(3, 1), (2, 5)]), [((3, 1), None), ((2, 5), None)]),
        (LineString([(1, 2), (4, 6)]), [((2.5, 4), 5.0)]),
        (LineString([(0, 0), (0.2, 0)]), [((0.1, 0), None)]),  # a symbol
        (LineString([(0, 0), (40, 0)]), [((20, 0), None)]),
        (MultiLineString([[(0, 0), (1, 0)], [(1, 0), (3, 0)]]), [((1.5, 0), 3.0)]),
        (MultiLineString([[(0, 0), (1, 0)], [(7, 1), (7, 3)]]), [((0.5, 0), 1.0), ((7, 2), 2.0)]),
        (box(2, 1, 2.2, 2.4), [((2.1, 1.7), 1.4)]),
        (LineString(box(2, 1, 2.2, 2.4).exterior), [((2.1, 1.7), 1.4)]),
        (GeometryCollection([Point(0.5, 0), LineString([(0, 0), (1, 0)])]), [((0.5, 0), 1.0)]),
        (GeometryCollection([Point(0.5, 2), LineString([(0, 0), (1, 0)])]), [((0.5, 0), 1.0), ((0.5, 2), None)]),
    ],
)
def test_openings_are_points_and_the_middles_of_lines_and_areas(shape, openings):
    found = openings_of(shape)
    assert [(each.middle.x, each.middle.y) for each in found] == [pytest.approx(spot) for spot, _ in openings]
    assert [each.length for each in found] == [pytest.approx(length) for _, length in openings]


def test_what_is_left_out_for_its_shape_is_counted():
    shapes = [Point(0, 0), None, Point(1, 1)]
    assert say_left_out(shapes, "unit", "an outline") == ("3 units without an outline left out (Point, no geometry)",)
    assert say_left_out([], "unit", "an outline") == ()


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


@pytest.mark.parametrize("before", [100, (1 << 20) - 300, (1 << 20) - 4, 3_000_000])
def test_words_are_found_however_far_behind(tmp_path, before):
    path = _file(tmp_path, {"type": "Point", "coordinates": [1, 2]})
    path.write_text(path.read_text().replace('"features"', f'"name": "{"x" * before}", "features"'))
    assert mentions(path, "kind")
    assert not mentions(path, "level")


def test_words_in_packed_tags_are_found(tmp_path):
    record = {"geometry": None, "properties": {"other_tags": '"indoor"=>"room"'}}
    assert mentions(write_features(tmp_path / "a.geojson", [record]), "indoor")
