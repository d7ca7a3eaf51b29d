import json

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from shapely import affinity
from shapely.geometry import MultiPolygon, Polygon, box, shape

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, Door, FloorPlan, GridPlan, Layer, Location, Room
from pipeline.floorplans.readers import read_plan_file
from pipeline.floorplans.writers import geojson
from pipeline.floorplans.writers.geojson import GeoJson
from pipeline.floorplans.writers.writer import Writer
from tests.floorplans.samples import KNOWN, floor_plan, grid_plan

NUMBERS = st.floats(-1e4, 1e4)
WORDS = st.text(st.characters(codec="utf-8", categories=["L", "N"]), min_size=1, max_size=20)
DOORS = st.lists(st.builds(Door, NUMBERS, NUMBERS, st.floats(0, 20), st.booleans()), max_size=3)
ELL = Polygon([(0, 0), (10, 0), (10, 4), (4, 4), (4, 8), (0, 8)])


def again(plan, folder):
    writer: Writer = GeoJson()
    (path,) = writer.write(plan, folder / f"floor{writer.ending}")
    (found,) = read_plan_file(path)
    return found


def same(one, other):
    """Whether two plans say the same; the source is the file itself."""
    keys = ("plan_id", "building", "floor", "environment", "split", "doors", "endpoints", "remarks")
    return all(getattr(one, key) == getattr(other, key) for key in keys)


@st.composite
def boxes(draw):
    """Boxes with a hole each, turned, one or several beside each other."""
    parts = []
    for number in range(draw(st.integers(1, 3))):
        width, height = draw(st.floats(1, 50)), draw(st.floats(1, 50))
        whole = box(0, 0, width, height) - box(width / 4, height / 4, width / 2, height / 2)
        parts.append(affinity.translate(affinity.rotate(whole, draw(st.floats(0, 90))), number * 200))
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)


@settings(max_examples=40, deadline=None)
@given(boxes(), boxes(), WORDS, DOORS, st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS), st.sampled_from([None, "train"]))
def test_geometry_is_written_and_read_back(tmp_path_factory, free, outline, label, doors, spots, split):
    plan = floor_plan(
        free,
        rooms=(Room(outline, label), Room(box(0, 0, 1, 1), "")),
        doors=tuple(doors),
        endpoints=(Location(*spots[:2]), Location(*spots[2:])),
        remarks=(("a remark " * 30).strip(), "another"),
        split=split,
    )
    found = again(plan, tmp_path_factory.mktemp("plan"))
    assert isinstance(found, FloorPlan)
    assert same(found, plan)
    assert found.free.equals(plan.free)
    assert found.free.geom_type == plan.free.geom_type
    assert found.bounds == plan.bounds
    assert [
        (room.label, room.outline.equals(had.outline)) for room, had in zip(found.rooms, plan.rooms, strict=True)
    ] == [
        (label, True),
        ("", True),
    ]


@settings(max_examples=40, deadline=None)
@given(
    arrays(np.uint8, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.integers(0, 3)),
    st.floats(0.01, 1.0),
    NUMBERS,
    NUMBERS,
    DOORS,
)
def test_a_grid_is_written_and_read_back(tmp_path_factory, cells, resolution, x, y, doors):
    labels = {1: "office", 2: "hall"}
    layers = {"rooms": Layer(cells.astype(np.uint16) * 1000, {}), "kinds": Layer(cells.astype(np.uint16), labels)}
    plan = grid_plan(
        KNOWN, cells=cells, resolution=resolution, origin=Location(x, y), doors=tuple(doors), layers=layers
    )
    found = again(plan, tmp_path_factory.mktemp("plan"))
    assert isinstance(found, GridPlan)
    assert same(found, plan)
    assert np.array_equal(found.cells, cells)
    assert found.cells.dtype == np.uint8
    assert (found.resolution, found.origin) == (resolution, (x, y))
    assert found.layers.keys() == layers.keys()
    for name, layer in layers.items():
        assert np.array_equal(found.layers[name].values, layer.values)
        assert found.layers[name].labels == layer.labels


def test_the_file_says_that_it_is_in_metres(tmp_path):
    plan = floor_plan(ELL, rooms=(Room(ELL, "OFFICE"),), doors=(Door(1.0, 2.0, 0.9, leaf=False),))
    (path,) = GeoJson().write(plan, tmp_path / "new" / "floor.geojson")
    content = json.loads(path.read_text())
    about = content["hinterland"]
    assert (about["version"], about["units"], about["form"]) == (1, "m", "geometry")
    assert about["frame"].startswith("local metres, x to the right, y up")
    assert about["bounds"] == [0, 0, 10, 8]
    kinds = [feature["properties"] for feature in content["features"]]
    assert kinds == [
        {"kind": "free"},
        {"kind": "room", "label": "OFFICE"},
        {"kind": "door", "width": 0.9, "leaf": False},
    ]
    assert shape(content["features"][0]["geometry"]).equals(ELL)
    assert len(path.read_text().splitlines()) == 3 + 2


def test_outlines_turn_as_the_standard_wants_it(tmp_path):
    free = shapely.reverse(ELL - box(1, 1, 2, 2))
    (path,) = GeoJson().write(floor_plan(free), tmp_path / "floor.geojson")
    written = shape(json.loads(path.read_text())["features"][0]["geometry"])
    assert written.exterior.is_ccw
    assert not written.interiors[0].is_ccw


def test_each_value_of_a_grid_is_an_area(tmp_path):
    (path,) = GeoJson().write(grid_plan(KNOWN, resolution=0.5, origin=Location(3.0, -1.0)), tmp_path / "floor.geojson")
    features = json.loads(path.read_text())["features"]
    assert [feature["properties"]["kind"] for feature in features] == ["free", "unknown", "clutter"]
    for feature in features:
        assert feature["properties"] | {"kind": ""} == {
            "kind": "",
            "resolution": 0.5,
            "origin": [3, -1],
            "shape": [6, 8],
        }
    clutter = shape(features[2]["geometry"])
    assert clutter.equals(box(3 + 3 * 0.5, -1 + 2 * 0.5, 3 + 4 * 0.5, -1 + 3 * 0.5))


@pytest.mark.parametrize("empty", [Polygon(), MultiPolygon()])
def test_a_plan_without_floor_is_written_and_read_back(tmp_path, empty):
    found = again(floor_plan(empty, bounds=Bounds(0, 0, 1, 1)), tmp_path)
    assert found.free.is_empty
    assert found.bounds == (0, 0, 1, 1)


def test_a_crossed_room_comes_back_repaired(tmp_path):
    found = again(floor_plan(ELL, rooms=(Room(Polygon([(0, 0), (2, 2), (2, 0), (0, 2)]), "bow"),)), tmp_path)
    assert found.rooms[0].outline.is_valid
    assert found.remarks == ("1 outline crossed itself and was repaired",)


def test_what_is_not_finite_is_refused_and_nothing_is_written(tmp_path):
    with pytest.raises(PlanError, match="plan drawn: a number is not finite, expected metres"):
        GeoJson().write(floor_plan(ELL, doors=(Door(float("nan"), 0.0, 0.9),)), tmp_path / "floor.geojson")
    assert list(tmp_path.iterdir()) == []


def test_too_many_corners_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(geojson, "MOST_COORDINATES", 6)
    with pytest.raises(PlanError, match="plan drawn: its outlines have 7 corners, at most 6 are written as GeoJSON"):
        GeoJson().write(floor_plan(ELL), tmp_path / "floor.geojson")
