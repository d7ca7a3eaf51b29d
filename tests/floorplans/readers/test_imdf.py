import json
import zipfile

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
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.readers import COMPANION, PLAN, classify, read_plans
from pipeline.floorplans.readers.imdf import Imdf
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.sources import open_source
from tests.floorplans.geojson_samples import ELL, feature, two_rooms, write_features


def of(kind, shape, identity="", **properties):
    return feature(shape, members={"feature_type": kind, "id": identity}, **properties)


def unit(shape, level="l0", category="room"):
    return of("unit", shape, level_id=level, category=category)


def level(identity="l0", ordinal=0, **changes):
    given = {"ordinal": ordinal, "outdoor": False, "short_name": {"en": f"F{ordinal}"}, "building_ids": ["b1"]}
    return of("level", ELL, identity, **(given | changes))


def opening(*ends, level="l0", door=None):
    return of("opening", LineString(ends), level_id=level, category="pedestrian", door=door)


UNITS = [unit(box(0, 0, 5, 4)), unit(box(5, 0, 10, 4), category="office")]
LEVELS = (level(),)
DOOR = opening((5, 1.4), (5, 2.6), door={"type": "swinging", "automatic": False})


def venue(folder, units=UNITS, levels=LEVELS, openings=(DOOR,), **others):
    given = {"unit": units, "level": levels, "opening": openings, **others}
    for kind, features in given.items():
        if features is not None:
            write_features(folder / f"{kind}.geojson", list(features), name=kind)
    manifest = {"version": "1.0.0", "created": "2021-01-01T00:00:00Z", "language": "en-US"}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder / "unit.geojson"


def read(path, **options):
    return list(Imdf().read(path, ReadOptions(**options)))


def parts(plan):
    return len(shapely.get_parts(plan.free))


def test_units_are_rooms_and_openings_doors(tmp_path):
    (plan,) = read(venue(tmp_path / "museum"))
    assert (plan.plan_id, plan.building, plan.floor) == ("museum.0", "museum", "museum.0")
    assert [room.label for room in plan.rooms] == ["room", "office"]
    assert parts(plan) == 1
    (door,) = plan.doors
    assert door.width == pytest.approx(1.2, rel=1e-3)
    assert door.leaf
    assert plan.remarks == ()
    assert inspect(plan).warnings == ()


def test_an_ell_is_not_mirrored_and_keeps_its_size(tmp_path):
    (plan,) = read(venue(tmp_path / "museum", [unit(ELL)], openings=()))
    west, south, east, north = plan.bounds
    assert (east - west, north - south) == pytest.approx((10.0, 8.0), rel=1e-3)
    assert shapely.contains_xy(plan.free, east - 1, south + 1)
    assert not shapely.contains_xy(plan.free, east - 1, north - 1)


def test_an_opening_without_leaf_is_a_passage(tmp_path):
    (plan,) = read(venue(tmp_path / "museum", openings=[opening((5, 1), (5, 3), door={"type": "open"})]))
    assert [door.leaf for door in plan.doors] == [False]


def test_a_symbolic_opening_gets_the_usual_width(tmp_path):
    (plan,) = read(venue(tmp_path / "museum", openings=[opening((5, 2), (5, 2.01))]), door_width_m=1.1)
    assert [door.width for door in plan.doors] == [pytest.approx(1.1)]


@pytest.mark.parametrize(
    ("shape", "widths"),
    [
        (MultiLineString([[(5, 1.4), (5, 2.6)]]), [1.2]),
        (MultiLineString([[(5, 0.4), (5, 1.4)], [(5, 2.2), (5, 3.6)]]), [1.0, 1.4]),
        (MultiLineString([[(5, 1), (5, 1.5)], [(5, 1.5), (5, 2.3)]]), [1.3]),
        (GeometryCollection([Point(5, 2), GeometryCollection([LineString([(5, 1.4), (5, 2.6)])])]), [1.2]),
        (box(4.9, 1, 5.1, 2.1), [1.1]),
        (MultiPoint([(5, 1), (5, 3)]), [0.9, 0.9]),
    ],
)
def test_openings_of_any_shape_are_doors(tmp_path, shape, widths):
    (plan,) = read(venue(tmp_path / "museum", openings=[of("opening", shape, level_id="l0")]))
    assert sorted(door.width for door in plan.doors) == pytest.approx(widths, rel=2e-3)
    assert parts(plan) == 1
    symbols = ("2 openings are points or symbols and get the usual width",) if isinstance(shape, MultiPoint) else ()
    assert plan.remarks == symbols


@pytest.mark.parametrize(
    "shape",
    [
        MultiPolygon([box(0, 0, 5, 4), box(20, 0, 23, 2)]),
        GeometryCollection([box(0, 0, 5, 4), box(20, 0, 23, 2), Point(1, 1)]),
        GeometryCollection([MultiPolygon([box(0, 0, 5, 4)]), GeometryCollection([box(20, 0, 23, 2)])]),
    ],
)
def test_units_of_several_parts_are_units(tmp_path, shape):
    (plan,) = read(venue(tmp_path / "museum", [unit(shape), unit(box(5, 0, 10, 4))]))
    assert plan.free.area == pytest.approx(4.9 * 3.9 * 2 + 2.9 * 1.9 + 0.12, rel=2e-3)
    assert plan.remarks == ()


def test_what_is_left_out_is_counted(tmp_path):
    others = {
        "fixture": [of("fixture", Point(1, 1), level_id="l0"), of("fixture", box(1, 1, 2, 3), level_id="l0")],
        "openings": [DOOR, opening((0, 0), (1, 0), level="l9"), of("opening", None, level_id="l0"), {"geometry": 7}],
    }
    units = [*UNITS, unit(Point(1, 1)), unit(None)]
    (plan,) = read(venue(tmp_path / "museum", units, **others))
    assert plan.remarks == (
        "2 units without an outline left out (Point, no geometry)",
        "opening.geojson: 1 feature with a damaged shape left out",
        "1 opening on a level without units left out",
        "1 opening without a shape left out (no geometry)",
        "1 fixture taken off the floor",
        "1 fixture without an outline left out (Point)",
    )


def test_without_openings_rooms_stay_sealed_and_it_is_said(tmp_path):
    (plan,) = read(venue(tmp_path / "museum", openings=None))
    assert parts(plan) == 2
    assert plan.remarks == ("the venue has no opening.geojson: its rooms stay closed",)


def test_walkways_are_one_space(tmp_path):
    walkways = [unit(box(0, 0, 5, 4), category="walkway"), unit(box(5, 0, 10, 4), category="ramp")]
    (plan,) = read(venue(tmp_path / "museum", walkways, openings=()))
    assert parts(plan) == 1


@pytest.mark.parametrize("category", ["column", "structure", "opentobelow", "drywall"])
def test_some_units_are_no_floor(tmp_path, category):
    (plan,) = read(venue(tmp_path / "museum", [*UNITS, unit(box(1, 1, 2, 3), category=category)]))
    assert [room.label for room in plan.rooms] == ["room", "office"]
    assert not shapely.contains_xy(plan.free, plan.bounds.min_x + 1.5, plan.bounds.min_y + 2)
    assert shapely.contains_xy(plan.free, plan.bounds.min_x + 0.5, plan.bounds.min_y + 2)
    assert plan.free.area < 9.8 * 3.9 - 2


def test_fixtures_and_kiosks_are_taken_off_the_floor_of_their_level(tmp_path):
    things = {
        "fixture": [of("fixture", box(1, 1, 2, 2), level_id="l0")],
        "kiosk": [of("kiosk", box(7, 1, 8, 3), level_id="l0")],
    }
    things["fixture"].append(of("fixture", box(0, 0, 5, 4), level_id="l9"))
    bare, furnished = (read(venue(tmp_path / name, **more))[0] for name, more in (("a", {}), ("b", things)))
    assert bare.free.area - furnished.free.area == pytest.approx(3.0, rel=1e-3)
    assert furnished.remarks == ("1 fixture on a level without units left out", "2 fixtures taken off the floor")


def test_levels_come_from_the_lowest_up_in_one_frame(tmp_path):
    units = [*UNITS, unit(box(0, 0, 5, 4), "l1"), unit(box(0, 0, 5, 4), "lb"), unit(ELL, "garden")]
    levels = [level("l1", 1), level("l0", 0), level("lb", -1), level("garden", 0, outdoor=True), level("roof", 2)]
    plans = read(venue(tmp_path / "museum", units, levels))
    assert [plan.floor for plan in plans] == ["museum.-1", "museum.0", "museum.1"]
    assert {plan.building for plan in plans} == {"museum"}
    assert [len(plan.doors) for plan in plans] == [0, 1, 0]
    assert plans[0].rooms[0].outline.equals(plans[2].rooms[0].outline)


@pytest.mark.parametrize("chosen", ["1", "F1", "First floor"])
def test_levels_are_chosen_by_ordinal_or_name(tmp_path, chosen):
    levels = [level(), level("l1", 1, name={"en": "First floor"})]
    (plan,) = read(venue(tmp_path / "museum", [*UNITS, unit(ELL, "l1")], levels), levels=(chosen,))
    assert plan.plan_id == "museum.1"


def test_levels_of_two_buildings_are_two_buildings(tmp_path):
    units = [unit(box(0, 0, 5, 4), "a"), unit(box(20, 0, 25, 4), "b")]
    apart = [level("a", building_ids=["east"]), level("b", building_ids=["west"])]
    plans = read(venue(tmp_path / "campus", units, apart))
    assert [plan.building for plan in plans] == ["campus.east", "campus.west"]
    assert len({plan.plan_id for plan in plans}) == 2
    shared = [level("a", building_ids=["east", "west"]), level("b", building_ids=["west"])]
    assert {plan.building for plan in read(venue(tmp_path / "mall", units, shared))} == {"mall"}


def test_without_levels_they_are_named_by_their_ids(tmp_path):
    (plan,) = read(venue(tmp_path / "museum", levels=None))
    assert plan.plan_id == "museum.l0"


def test_units_on_an_unknown_level_are_refused_alone(tmp_path):
    plan, refused = read(venue(tmp_path / "museum", [*UNITS, unit(ELL, "l7")]))
    assert plan.plan_id == "museum.0"
    assert isinstance(refused, PlanError)
    assert "unit.geojson: 1 unit on level 'l7', expected a level of level.geojson" in str(refused)


def test_a_level_without_floor_is_refused_alone(tmp_path):
    units = [*UNITS, unit(ELL, "l1", "opentobelow")]
    plan, refused = read(venue(tmp_path / "museum", units, [level(), level("l1", 1)]))
    assert plan.plan_id == "museum.0"
    assert "unit.geojson, level 1: there is no room" in str(refused)


def test_a_crossed_unit_is_repaired_and_said(tmp_path):
    bow = Polygon([(0, 0), (8, 8), (8, 0), (0, 8)])
    (plan,) = read(venue(tmp_path / "museum", [unit(bow)], openings=()))
    assert plan.free.is_valid
    assert plan.remarks == ("1 outline crossed itself and was repaired",)


def test_damaged_units_are_said(tmp_path):
    damaged = {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": [[[float("nan"), 0]]]}}
    (plan,) = read(venue(tmp_path / "museum", [*UNITS, damaged]))
    assert plan.remarks == ("1 feature with a damaged shape left out",)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"units": []}, r"unit\.geojson: no unit has an outline, expected IMDF units as polygons"),
        ({"units": [unit(Point(0, 0))]}, r"unit\.geojson: no unit has an outline"),
        ({"units": [unit(ELL, f"l{number}") for number in range(201)]}, r"unit\.geojson: 201 levels, at most 200"),
        ({"units": [{"properties": {"level_id": "l0"}, "geometry": shapely.geometry.mapping(ELL)}]}, "0.05 degrees"),
        ({"levels": [level(ordinal="ground")]}, r"level\.geojson, level l0: ordinal is 'ground', expected a number"),
        (
            {"levels": [level(ordinal=float("nan"))]},
            r"level\.geojson, level l0: ordinal is nan, expected a finite number",
        ),
    ],
)
def test_bad_files_are_refused(tmp_path, changes, said):
    def raised():
        for found in read(venue(tmp_path / "museum", **changes)):
            if isinstance(found, PlanError):
                raise found

    with pytest.raises(PlanError, match=said) as caught:
        raised()
    assert str(tmp_path / "museum") in str(caught.value)


def test_a_far_opening_refuses_its_level_and_is_named(tmp_path):
    far = feature(LineString([(0, 0), (1, 0)]), around=(14.9, 51.0), members={"id": "o7"}, level_id="l0")
    (refused,) = read(venue(tmp_path / "museum", openings=[far]))
    assert "level 0: feature o7: a coordinate lies more than" in str(refused)


@pytest.mark.parametrize("packed", [False, True])
def test_a_folder_or_archive_is_one_venue(tmp_path, packed):
    others = {
        "venue": [of("venue", ELL)],
        "address": [of("address", None)],
        "occupant": [],
        "building": [of("building", None)],
    }
    root = tmp_path / "museum"
    venue(root, **others)
    (root / "notes.json").write_text("{}")
    if packed:
        with zipfile.ZipFile(tmp_path / "museum.zip", "w") as archive:
            for path in sorted(root.iterdir()):
                archive.write(path, path.name)
        root = tmp_path / "museum.zip"
    with open_source(root) as files:
        entries = {entry.file.path.name: entry for entry in classify(files)}
        plans = list(read_plans(entries["unit.geojson"].file, entries["unit.geojson"].reader))
    kinds = ("level", "opening", "venue", "address", "occupant", "building")
    companions = [entries.pop(name) for name in (*(f"{kind}.geojson" for kind in kinds), "manifest.json")]
    assert {(entry.role, entry.reader.name) for entry in companions} == {(COMPANION, "imdf")}
    assert (entries["unit.geojson"].role, entries["unit.geojson"].reader.name) == (PLAN, "imdf")
    assert entries["notes.json"].role not in (PLAN, COMPANION)
    assert [(plan.plan_id, len(plan.doors)) for plan in plans] == [("museum.0", 1)]


def test_files_of_a_venue_are_told_however_far_behind_they_say_it(tmp_path):
    path = venue(tmp_path / "museum")
    for beside in (path, path.with_name("opening.geojson")):
        beside.write_text(beside.read_text().replace('"features"', f'"note": "{"x" * 2_000_000}", "features"'))
    assert Imdf().sniff(path)
    assert Imdf().accompanies(path.with_name("opening.geojson"))


def test_foreign_files_are_not_recognised(tmp_path):
    osm = write_features(tmp_path / "unit.geojson", two_rooms())
    lone = write_features(tmp_path / "alone" / "level.geojson", [level()])
    beside = tmp_path / "manifest.json"
    beside.write_text('{"name": "an app"}')
    assert not Imdf().sniff(osm)
    assert not Imdf().sniff(tmp_path / "missing.geojson")
    assert not Imdf().accompanies(lone)
    assert not Imdf().accompanies(beside)
    assert not Imdf().accompanies(osm)
