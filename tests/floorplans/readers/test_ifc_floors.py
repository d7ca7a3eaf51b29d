"""Which levels of a model are floors: each is read once, through its own bodies."""

from pathlib import Path

import pytest
import shapely

from pipeline.floorplans.readers.ifc import Ifc
from tests.floorplans.readers.drawing_samples import check_house, contains, read_all, read_one, refusal

pytest.importorskip("ifcopenshell", reason="the extra `ifc` is not installed")
from tests.floorplans.readers.ifc_samples import UNITS, Model, api, strip

NO_SPACES = "the storey has no spaces: rooms are not known"
CASES = Path(__file__).parents[3].parent / "shared" / "cases"


def parts(plan) -> list[float]:
    """The areas of the parts of the floor, the smallest first."""
    return sorted(shapely.area(shapely.get_parts(plan.free)).tolist())


def by_level(path: Path) -> dict[str, list[float]]:
    return {plan.plan_id.partition(".")[2]: parts(plan) for plan in read_all(Ifc(), path)}


def block(left, bottom, right, top) -> list[tuple[float, float]]:
    return [(left, bottom), (right, bottom), (right, top), (left, top)]


# Several buildings
@pytest.mark.parametrize(
    ("second", "expected"),
    [("Annex", ["House", "Annex"]), ("House", ["House", "House (2)"]), (None, ["House", "building"])],
)
def test_each_building_of_a_model_has_floors_of_its_own(tmp_path, second, expected):
    """A house of 10 x 6 m, and another of 7 x 3 m 30 m away at the same heights, with one storey more."""
    model = Model(UNITS["mm"]).storey("Ground").box(0, 0, 10, 6)
    model.new_building(second).storey("Ground").box(30, 1, 37, 4).storey("Upper", 3.0).box(30, 1, 34, 4)
    plans = read_all(Ifc(), model.save(tmp_path))
    house, annex = expected
    assert [plan.plan_id for plan in plans] == [
        f"home.{house}.Ground",
        f"home.{annex}.Ground",
        f"home.{annex}.Upper",
    ]
    assert [plan.building for plan in plans] == [f"home.{house}", f"home.{annex}", f"home.{annex}"]
    assert [parts(plan) for plan in plans] == [
        [pytest.approx(9.8 * 5.8)],
        [pytest.approx(6.8 * 2.8)],
        [pytest.approx(3.8 * 2.8)],
    ]
    assert plans[1].bounds == pytest.approx((29.9, 0.9, 37.1, 4.1))
    assert [plan.plan_id for plan in read_all(Ifc(), tmp_path / "home.ifc", levels=("Upper",))] == [
        f"home.{annex}.Upper"
    ]


def test_a_tower_does_not_reach_into_the_floors_of_the_building_beside_it(tmp_path):
    model = Model().storey("T0").box(0, 0, 5, 4, height=12.0)
    model.new_building("Low").storey("L0").box(8, 0, 14, 4).storey("L1", 3.0).box(8, 0, 11, 4)
    assert by_level(model.save(tmp_path)) == {
        "House.T0": [pytest.approx(4.8 * 3.8)],
        "Low.L0": [pytest.approx(5.8 * 3.8)],
        "Low.L1": [pytest.approx(2.8 * 3.8)],
    }


def test_a_building_without_floors_does_not_rename_the_other(tmp_path):
    model = Model().storey("Ground").box(0, 0, 7, 4).new_building("Site").storey("Yard")
    plan = read_one(Ifc(), model.save(tmp_path))
    assert (plan.plan_id, plan.building, plan.remarks) == ("home.Ground", "home", (NO_SPACES,))


# Levels side by side
@pytest.mark.parametrize("rise", [0.0, 0.3, 1.4])
def test_wings_at_one_height_and_split_levels_are_floors_of_their_own(tmp_path, rise):
    """The wall between them belongs to the north wing alone, and so does its partition."""
    model = Model().storey("North").box(0, 0, 6, 4, height=3.0)
    model.wall((2.0, 0.0), (2.0, 4.0), height=3.0)
    model.storey("South", rise).box(6, 0, 10, 4, sides="brt", height=3.0)
    assert by_level(model.save(tmp_path)) == {
        "North": [pytest.approx(1.8 * 3.8), pytest.approx(3.8 * 3.8)],
        "South": [pytest.approx(3.8 * 3.8)],
    }


def test_a_wing_around_another_is_a_floor_of_its_own(tmp_path):
    """The inner one stands in the corner of an L that has no walls towards it."""
    model = Model().storey("Inner").box(5, 4, 10, 8)
    model.storey("Outer").box(0, 0, 10, 8, sides="lb")
    model.wall((10.0, 0.0), (10.0, 4.0))
    model.wall((0.0, 8.0), (5.0, 8.0))
    assert by_level(model.save(tmp_path)) == {
        "Inner": [pytest.approx(4.8 * 3.8)],
        "Outer": [pytest.approx(9.8 * 3.8 + 4.8 * 4.0)],
    }


def test_a_closed_wing_around_a_court_does_not_take_in_the_pavilion_within(tmp_path):
    """A ring of 12 x 10 m around a court of 6 x 4 m, in which a pavilion of 3 x 2 m stands on a level of its own."""
    model = Model().storey("Ring").box(0, 0, 12, 10).box(3, 3, 9, 7).storey("Pavilion", 0.2).box(4, 4, 7, 6)
    found = by_level(model.save(tmp_path))
    assert found.pop("Pavilion", [pytest.approx(2.8 * 1.8)]) == [pytest.approx(2.8 * 1.8)]
    ((_, ring),) = found.items()
    assert ring[-1] == pytest.approx(11.8 * 9.8 - 6.2 * 4.2)


# Levels that are one floor
@pytest.mark.parametrize("lower", [-0.15, 0.0, 0.1])
def test_a_finish_and_a_slab_level_are_one_floor(tmp_path, lower):
    """The walls stand on the slab; door and spaces belong to the finish."""
    model = Model(UNITS["mm"]).storey("Slab", lower).walls()
    model.storey("Finish").opening(filling="IfcDoor").spaces()
    path = model.save(tmp_path)
    plan = read_one(Ifc(), path)
    check_house(plan)
    assert plan.plan_id == "home.Slab"
    assert [room.label for room in plan.rooms] == ["Hall", "Study"]
    assert plan.remarks == ("storeys at the height of this floor were read with it: Finish",)
    assert [each.plan_id for each in read_all(Ifc(), path, levels=("Finish",))] == ["home.Slab"]


def test_levels_for_each_trade_are_one_floor(tmp_path):
    model = Model().storey("Architecture").box(0, 0, 10, 6).storey("Structure", 0.05)
    for x in (3.0, 7.0):
        model.prism("IfcColumn", block(x, 2, x + 0.4, 2.5))
    model.storey("Partitions").wall((4.5, 0.0), (4.5, 6.0))
    plan = read_one(Ifc(), model.save(tmp_path))
    assert parts(plan) == [pytest.approx(4.3 * 5.8 - 0.2), pytest.approx(5.3 * 5.8 - 0.2)]
    assert set(plan.remarks[0].rpartition(": ")[2].split(", ")) == {"Partitions", "Structure"}


def test_an_empty_level_at_the_height_of_another_is_passed_over(tmp_path):
    model = Model().storey("Empty").storey("Ground").box(0, 0, 10, 6).storey("Ceiling", 2.3).storey("Zero", 0.4)
    plan = read_one(Ifc(), model.save(tmp_path))
    assert plan.plan_id == "home.Ground"
    assert parts(plan) == [pytest.approx(9.8 * 5.8)]
    passed_over = "storeys without walls 1.1 m above them were passed over: Empty, Zero, Ceiling"
    assert plan.remarks == (passed_over, NO_SPACES)


# Bodies that reach through several levels
def test_a_facade_that_stands_on_the_ground_bounds_every_floor_above(tmp_path):
    """Level 1 has a partition, level 2 a slab alone; the levels of a ceiling and of the roof have nothing."""
    model = Model().storey("0").box(0, 0, 10, 6, height=10.0)
    model.storey("1", 3.0).wall((4.0, 0.0), (4.0, 6.0))
    model.storey("Ceiling", 5.4).storey("2", 6.0).prism("IfcSlab", block(0, 0, 10, 6), height=0.3, above=-0.3)
    model.storey("Roof", 9.5)
    assert by_level(model.save(tmp_path)) == {
        "0": [pytest.approx(9.8 * 5.8)],
        "1": [pytest.approx(3.8 * 5.8), pytest.approx(5.8 * 5.8)],
        "2": [pytest.approx(9.8 * 5.8)],
    }


def test_a_tall_wing_does_not_make_floors_of_the_split_level_beside_it(tmp_path):
    model = Model().storey("Hall").box(0, 0, 6, 4, height=8.0)
    model.storey("Low", 1.0).box(6, 0, 10, 4, sides="brt").storey("High", 4.0).box(6, 0, 8, 4, sides="brt")
    assert by_level(model.save(tmp_path)) == {
        "Hall": [pytest.approx(5.8 * 3.8)],
        "Low": [pytest.approx(3.8 * 3.8)],
        "High": [pytest.approx(1.8 * 3.8)],
    }


def test_walls_of_the_level_above_that_hang_down_count(tmp_path):
    model = Model().storey("0").box(0, 0, 10, 6, sides="lbr").storey("1", 3.0).box(0, 0, 10, 6, sides="lbr")
    model.wall((0.0, 6.0), (10.0, 6.0), above=-3.0, height=5.5)
    assert by_level(model.save(tmp_path)) == {"0": [pytest.approx(9.8 * 5.8)], "1": [pytest.approx(9.8 * 5.8)]}


def test_a_wall_that_belongs_to_the_building_alone_counts_on_every_floor_of_it(tmp_path):
    model = Model().storey("0").box(0, 0, 10, 6).storey("1", 3.0).box(0, 0, 10, 6)
    model.floor, model.z = model.building, 0.0
    model.wall((7.0, 0.0), (7.0, 6.0), height=5.0)
    rooms = [pytest.approx(2.8 * 5.8), pytest.approx(6.8 * 5.8)]
    assert by_level(model.save(tmp_path)) == {"0": rooms, "1": rooms}


@pytest.mark.parametrize("within", ["building", "nothing"])
def test_walls_that_belong_to_no_level_stand_on_every_one_they_reach(tmp_path, within):
    model = Model().storey("0").storey("1", 3.0).storey("Roof", 6.0)
    model.floor, model.z = model.building, 0.0
    model.box(0, 0, 7, 4, height=6.0)
    if within == "nothing":
        for relation in model.file.by_type("IfcRelContainedInSpatialStructure"):
            model.file.remove(relation)
    assert by_level(model.save(tmp_path)) == {"0": [pytest.approx(6.8 * 3.8)], "1": [pytest.approx(6.8 * 3.8)]}


def test_a_wall_that_a_split_level_refers_to_is_its_own_as_well(tmp_path):
    """The wall of the lower level, far from the walls of the upper one, closes its floor."""
    model = Model().storey("Low").box(0, 0, 6, 4, sides="lbt", height=4.0)
    far = model.wall((6.0, 0.0), (6.0, 4.0), height=4.0)
    model.storey("High", 1.5).box(6, 0, 11, 4, sides="rb")
    model.wall((8.0, 4.0), (11.0, 4.0))
    model.floor = model.file.by_type("IfcBuildingStorey")[0]
    top = model.wall((6.0, 4.0), (8.0, 4.0), height=2.0)
    for wall in (far, top):
        api.spatial.reference_structure(
            model.file, products=[wall], relating_structure=model.file.by_type("IfcBuildingStorey")[1]
        )
    assert by_level(model.save(tmp_path))["High"] == [pytest.approx(4.8 * 3.8)]


# Classes that are not walls by name
@pytest.mark.parametrize("kind", ["IfcBuildingElementProxy", "IfcRailing", "IfcMember", "IfcChimney"])
def test_what_closes_rooms_without_being_a_wall_by_name_is_read_as_one(tmp_path, kind):
    model = Model().storey("0").box(0, 0, 10, 6)
    model.prism(kind, strip((3.0, 0.0), (3.0, 6.0), 0.2))
    plan = read_one(Ifc(), model.save(tmp_path))
    assert parts(plan) == [pytest.approx(2.8 * 5.8), pytest.approx(6.8 * 5.8)]
    assert plan.remarks == (f"read as walls, though of classes that need not be: 1 {kind}", NO_SPACES)


def test_what_is_not_read_is_counted_where_it_stands_in_the_cut(tmp_path):
    model = Model().storey("0").box(0, 0, 10, 6)
    model.prism("IfcFurniture", block(1, 1, 2, 1.5), height=2.0)
    model.prism("IfcFurniture", block(4, 1, 5, 2), height=0.8)  # a table
    for x in (7.0, 8.0):
        model.prism("IfcStairFlight", block(x, 1, x + 0.9, 4), height=1.5)
    model.prism("IfcBuildingElementProxy", block(-1, -1, 5, 7))  # the volume of a zone
    model.storey("1", 3.0).box(0, 0, 10, 6)
    lower, upper = read_all(Ifc(), model.save(tmp_path))
    assert parts(lower) == parts(upper) == [pytest.approx(9.8 * 5.8)]
    counted = "1 IfcBuildingElementProxy, 1 IfcFurniture, 2 IfcStairFlight"
    assert lower.remarks == (f"what stands 1.1 m above the floor and is not read: {counted}", NO_SPACES)
    assert upper.remarks == (NO_SPACES,)


def test_a_model_of_proxies_alone_is_read(tmp_path):
    model = Model().storey("0")
    for start, end in (((0, 0), (7, 0)), ((7, 0), (7, 4)), ((7, 4), (0, 4)), ((0, 4), (0, 0))):
        model.prism("IfcBuildingElementProxy", strip(start, end, 0.2))
    plan = read_one(Ifc(), model.save(tmp_path))
    assert parts(plan) == [pytest.approx(6.8 * 3.8)]
    assert plan.remarks[0] == "read as walls, though of classes that need not be: 4 IfcBuildingElementProxy"


def test_a_curtain_wall_of_members_is_closed_between_them(tmp_path):
    model = Model().storey("0").box(0, 0, 10, 6)
    curtain = model.entity("IfcCurtainWall", "Glass")
    api.spatial.assign_container(model.file, products=[curtain], relating_structure=model.floor)
    members = [model.prism("IfcMember", block(4, y, 4.1, y + 0.1)) for y in (0.1, 1.4, 2.7, 4.0, 5.3, 5.8)]
    api.spatial.unassign_container(model.file, products=members)
    api.aggregate.assign_object(model.file, products=members, relating_object=curtain)
    plan = read_one(Ifc(), model.save(tmp_path))
    assert parts(plan) == [pytest.approx(3.9 * 5.8), pytest.approx(5.8 * 5.8)]
    assert plan.remarks[0] == "read as walls, though of classes that need not be: 1 IfcCurtainWall, 6 IfcMember"


def test_windows_and_railings_alone_make_no_floor(tmp_path):
    model = Model().storey("0").box(0, 0, 10, 6).storey("Sills", 0.9)
    model.prism("IfcWindow", strip((2, 0), (4, 0), 0.2), height=1.5)
    model.storey("Roof", 3.0)
    for start, end in (((0, 0), (10, 0)), ((10, 0), (10, 6)), ((10, 6), (0, 6)), ((0, 6), (0, 0))):
        model.prism("IfcRailing", strip(start, end, 0.05), height=1.3)
    plan = read_one(Ifc(), model.save(tmp_path))
    assert plan.plan_id == "home.0"
    assert parts(plan) == [pytest.approx(9.8 * 5.8)]


def test_a_model_of_windows_alone_is_refused(tmp_path):
    model = Model().storey("0")
    model.prism("IfcWindow", strip((2, 0), (4, 0), 0.2))
    assert "no wall stands 1.1 m above any of 1 storeys" in refusal(Ifc(), model.save(tmp_path))


@pytest.mark.parametrize(
    ("case", "expected"),
    [
        ("06_ifc_levels_cut_whole_model/levels_same_elevation.ifc", [[52.84]]),
        ("06_ifc_levels_cut_whole_model/two_buildings_distinct.ifc", [[52.84], [52.84]]),
        ("19_ifc_classes_vanish/proxy_partition.ifc", [[4.7 * 5.6, 4.7 * 5.6]]),
        ("19_ifc_classes_vanish/railing.ifc", [[4.75 * 5.6, 4.75 * 5.6]]),
    ],
)
def test_reported_models_give_their_right_values(case, expected):
    if not (CASES / case).is_file():
        pytest.skip(f"{CASES / case} is absent")
    plans = read_all(Ifc(), CASES / case)
    assert [parts(plan) for plan in plans] == [pytest.approx(areas, abs=0.01) for areas in expected]
    assert len({plan.building for plan in plans}) == len(plans)
    assert all(contains(plan, [plan.free.representative_point().coords[0]]) == [True] for plan in plans)
