from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely.geometry import LinearRing, LineString, MultiPolygon, Polygon, box

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan
from pipeline.floorplans.readers import drawing as drawing_module
from pipeline.floorplans.readers.drawing import Drawing, is_any_of, plan_of, scale_of
from pipeline.floorplans.readers.reader import ReadOptions
from tests.floorplans.readers.drawing_samples import DOOR, HALL, OUTLINE, PARTITION, STUDY, check_house, contains


def house(unit: float = 1.0, **changes) -> Drawing:
    """The house as lines, with ``unit`` drawing units per metre."""
    lines = {"walls": [LinearRing(OUTLINE), LineString(PARTITION)], "openings": [LineString(DOOR)], "rooms": []}
    shapes = lines | changes
    rooms = [(enlarged(outline, unit), label) for outline, label in shapes["rooms"]]
    walls, openings = ([enlarged(shape, unit) for shape in shapes[key]] for key in ("walls", "openings"))
    return Drawing(walls=walls, openings=openings, rooms=rooms)


def enlarged(shape, unit: float):
    return shapely.transform(shape, lambda points: points * unit)


def plan(drawing: Drawing, scale: float = 1.0, **options) -> FloorPlan:
    return plan_of(
        drawing,
        scale,
        ReadOptions(**options),
        plan_id="home",
        building="b",
        environment="test",
        path=Path("a/home.abc"),
    )


def test_a_drawing_becomes_a_plan_in_metres():
    found = plan(house(1000.0), 0.001)
    check_house(found)
    assert (found.plan_id, found.floor, found.building) == ("home", "home", "b")
    assert (found.environment, found.source, found.remarks) == ("test", "home.abc", ())


@pytest.mark.parametrize("wall_m", [0.05, 0.2])
def test_walls_drawn_as_lines_have_the_asked_thickness(wall_m):
    found = plan(house(openings=[]), wall_m=wall_m)
    inner = LinearRing(OUTLINE).union(LineString(PARTITION)).buffer(wall_m / 2, cap_style="square", join_style="mitre")
    assert found.free.area == pytest.approx(Polygon(OUTLINE).difference(inner).area, abs=1e-6)


def test_rooms_keep_their_labels_and_are_the_floor():
    found = plan(house(rooms=[(Polygon(HALL), "Hall"), (Polygon(STUDY), "Study")]))
    check_house(found)
    assert [(room.label, room.outline.area) for room in found.rooms] == [("Hall", 40.0), ("Study", 20.0)]


def test_rooms_that_just_touch_are_one_floor_without_walls():
    found = plan(house(walls=[], openings=[], rooms=[(Polygon(HALL), ""), (Polygon(STUDY), "")]))
    assert len(shapely.get_parts(found.free)) == 1
    assert found.free.area == pytest.approx(60.0, rel=0.02)


def test_a_room_without_area_is_no_room():
    flat = Polygon([(1, 1), (2, 1), (3, 1)])
    found = plan(house(rooms=[(Polygon(HALL), "Hall"), (flat, "none")]))
    assert [room.label for room in found.rooms] == ["Hall"]


def test_a_door_between_rooms_apart_is_floor_and_a_front_door_is_no_niche():
    south, north = box(0, 0, 4, 3.9), box(0, 4.1, 4, 8)
    inner, front = box(1, 3.9, 1.9, 4.1), box(1, -0.2, 2, 0)
    found = plan(Drawing(walls=[], openings=[inner, front], rooms=[(south, "a"), (north, "b")]))
    assert contains(found, [(1.5, 4.0), (1.5, -0.1)]) == [True, False]
    assert len(shapely.get_parts(found.free)) == 1
    assert len(found.doors) == 2  # both are marked; only one is a way


def test_an_outline_that_crosses_itself_is_repaired():
    eight = Polygon([(0, 0), (4, 4), (4, 0), (0, 4)])
    found = plan(Drawing(rooms=[(eight, "eight")]))
    assert found.free.is_valid
    assert found.rooms[0].outline.area == pytest.approx(8.0)


def test_remarks_of_the_reader_are_kept():
    drawn = house()
    drawn.remarks.append("3 copies were left out")
    assert plan(drawn).remarks == ("3 copies were left out",)


@pytest.mark.parametrize(
    ("scale", "said"),
    [
        (1.0, ()),
        (0.5, ("half of its doors are 0.45 m wide or less: check the scale",)),
        (4.0, ("half of its doors are 3.6 m wide or more: check the scale",)),
    ],
)
def test_a_scale_at_which_no_door_is_one_is_said(scale, said):
    assert plan(house(), scale).remarks == said


def test_nothing_drawn_is_an_error_that_names_the_file():
    with pytest.raises(PlanError, match=r"^a/home.abc \(home\): neither walls nor rooms were found. Check its layers"):
        plan(Drawing(openings=[box(0, 0, 1, 1)]))


def test_too_many_coordinates_are_refused(monkeypatch):
    monkeypatch.setattr(drawing_module, "MOST_COORDINATES", 10)
    with pytest.raises(PlanError, match=r"home.abc \(home\): 11 coordinates, at most 10 are read. Simplify"):
        plan(house())


@pytest.mark.parametrize("far", [np.nan, np.inf, 2e10])
def test_coordinates_that_are_no_place_are_refused(far):
    with np.errstate(invalid="ignore"):
        line = LineString([(0, 0), (far, 1)])
    with pytest.raises(PlanError, match=r"home.abc \(home\): a coordinate is not finite or beyond 1e\+10. Repair"):
        plan(Drawing(walls=[line]))


def test_geometry_that_cannot_be_combined_is_one_clear_error():
    scribble = MultiPolygon([Polygon([(k, 0), (1000 - k, 9), (k, 9)]) for k in range(1100)])
    with pytest.raises(PlanError, match=r"home.abc \(home\): lines meet more than .* times. Simplify the drawing."):
        plan(Drawing(rooms=[(scribble, "")]))


def test_the_scale_of_a_person_is_taken():
    assert scale_of("a", house(), ReadOptions(metres_per_unit=0.02)) == 0.02


def test_without_a_scale_the_doors_propose_one():
    with pytest.raises(PlanError) as problem:
        scale_of("home.abc", house(50.0), ReadOptions())
    assert str(problem.value) == (
        "home.abc: the file does not say how many metres a unit of it has. Set plans.read.metres_per_unit. "
        "Its doors are 45 units wide: 0.9 m at 0.02."
    )
    with pytest.raises(PlanError, match=r"Its doors are 45 units wide: 1 m at 0.0222\.$"):
        scale_of("home.abc", house(50.0), ReadOptions(door_width_m=1.0))
    with pytest.raises(PlanError, match=r"Set plans.read.metres_per_unit.$"):
        scale_of("home.abc", house(openings=[]), ReadOptions())


@pytest.mark.parametrize(
    ("name", "patterns", "fits"),
    [("A-WALL", ("*wall*",), True), ("Wall", ("wall",), True), ("Wallpaper", ("wall",), False), ("x", (), False)],
)
def test_names_fit_patterns_whatever_their_case(name, patterns, fits):
    assert is_any_of(name, patterns) is fits
