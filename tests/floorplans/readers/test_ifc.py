import sys
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
import shapely

from pipeline.errors import PlanError
from pipeline.floorplans.readers import READERS, ifc_cuts
from pipeline.floorplans.readers.ifc import Ifc
from tests.floorplans.readers.drawing_samples import (
    INSIDE,
    OUTSIDE,
    SOLID,
    STUDY,
    check_house,
    contains,
    read_all,
    read_one,
    refusal,
)
from tests.floorplans.real_data import plan_files

pytest.importorskip("ifcopenshell", reason="the extra `ifc` is not installed")
import ifcopenshell

from tests.floorplans.readers.ifc_samples import THICK, UNITS, Model, shrunk, strip


@pytest.mark.parametrize("unit", UNITS)
def test_a_storey_is_read_in_metres_neither_turned_nor_mirrored(tmp_path, unit):
    path = Model(UNITS[unit]).storey("Ground").house().save(tmp_path)
    plan = read_one(Ifc(), path)
    check_house(plan)
    assert (plan.plan_id, plan.building, plan.floor, plan.source) == ("home.Ground", "home", "home.Ground", "home.ifc")
    assert plan.environment == "ifc_storeys"
    assert plan.remarks == ()
    assert plan.doors[0].leaf
    assert [room.label for room in plan.rooms] == ["Hall", "Study"]
    assert [room.outline.area for room in plan.rooms] == pytest.approx([9.8 * 3.8, 3.8 * 4.8])
    assert plan.free.area == pytest.approx(9.8 * 3.8 + 3.8 * 4.8 + 0.9 * THICK, rel=0.01)


def test_every_storey_is_cut_above_its_own_floor(tmp_path):
    model = Model(UNITS["mm"]).storey("Upper", 103.0).walls().storey("Ground", 100.0).house().storey("Roof", 106.0)
    path = model.save(tmp_path)
    ground, upper = plans = read_all(Ifc(), path)
    assert [plan.plan_id for plan in plans] == ["home.Ground", "home.Upper"]
    assert {plan.building for plan in plans} == {"home"}
    check_house(ground)
    check_house(upper, width=None)
    assert upper.doors == upper.rooms == ()
    passed_over = "storeys without walls 1.1 m above them were passed over: Roof"
    assert ground.remarks == (passed_over,)
    assert upper.remarks == (passed_over, "the storey has no spaces: rooms are not known")
    assert [plan.floor for plan in read_all(Ifc(), path, levels=("Upper",))] == ["home.Upper"]


def test_storeys_of_one_name_are_told_apart_by_their_heights(tmp_path):
    path = Model().storey("Level 1").walls().storey("Level 1", 3.0).house().storey(None, 6.0).walls().save(tmp_path)
    plans = read_all(Ifc(), path)
    assert len({plan.plan_id for plan in plans}) == 3
    assert [len(plan.rooms) for plan in plans] == [0, 2, 0]


def test_windows_and_recesses_stay_closed_and_empty_openings_are_ways(tmp_path):
    model = Model(version="IFC2X3").storey("Ground").walls().opening()
    facade = model.wall((10.0, 0.0), (10.0, 4.0))
    model.opening(((10.0, 1.0), (10.0, 3.0)), filling="IfcWindow", above=0.8, height=1.2, wall=facade)
    model.opening(((2.5, 4.0), (3.5, 4.0)), above=0.9, height=1.2)  # a hatch
    plan = read_one(Ifc(), model.spaces().save(tmp_path))
    assert contains(plan, INSIDE) == [True] * len(INSIDE)
    assert contains(plan, [*SOLID, *OUTSIDE, (10.0, 2.0), (3.0, 4.0)]) == [False] * 8
    (way,) = plan.doors
    assert (way.x, way.y, way.width, way.leaf) == (pytest.approx(1.45), pytest.approx(4), pytest.approx(0.9), False)


def test_a_thin_leaf_opens_a_thick_wall_from_face_to_face(tmp_path):
    model = Model().storey("Ground").walls()
    model.partition = model.prism("IfcWall", strip((0.1, 4.1), (3.9, 4.1), 0.4))
    plan = read_one(Ifc(), model.opening(filling="IfcDoor", thick=0.04).save(tmp_path))
    assert len(shapely.get_parts(plan.free)) == 1
    assert contains(plan, [(1.45, y) for y in (3.85, 4.0, 4.15, 4.28)]) == [True] * 4


def test_spaces_that_fill_only_a_part_do_not_bound_the_floor(tmp_path):
    model = Model().storey("Ground").walls().opening(filling="IfcDoor")
    model.prism("IfcSpace", shrunk(STUDY), name="Study")
    plan = read_one(Ifc(), model.save(tmp_path))
    check_house(plan)
    assert [room.label for room in plan.rooms] == ["Study"]
    assert plan.remarks == ("spaces fill only a part of the storey: its floor is what the walls enclose",)


def test_storeys_placed_at_one_height_are_told_apart_by_their_elevation(tmp_path):
    model = Model(UNITS["mm"])
    for name, z in (("Ground", 0.0), ("Upper", 3.0)):
        model.storey(name).floor.Elevation = 1000 * z
        model.z = z
        model.walls()
    assert [plan.plan_id for plan in read_all(Ifc(), model.save(tmp_path))] == ["home.Ground", "home.Upper"]


def test_a_house_above_the_sea_is_cut_where_it_stands_and_not_at_its_elevation(tmp_path):
    model = Model().storey("Ground", 112.0).house()
    model.floor.Elevation = 0.0
    check_house(read_one(Ifc(), model.save(tmp_path)))


def test_a_door_without_a_body_is_open_and_a_recess_closed(tmp_path):
    model = Model().storey("Ground").walls().opening(filling="IfcDoor").storey("Upper", 3.0).walls().opening()
    (bare,) = model.file.by_type("IfcDoor")
    bare.Representation = None
    model.file.by_type("IfcOpeningElement")[-1].PredefinedType = "RECESS"
    ground, upper = read_all(Ifc(), model.save(tmp_path))
    assert contains(ground, [*INSIDE, *SOLID]) == [True] * len(INSIDE) + [False] * len(SOLID)
    check_house(upper, width=None)


def test_porches_stay_outside_where_spaces_fill_the_storey(tmp_path):
    """A porch before the hall, between two low walls of its own; a front door leads into it."""
    model = Model().storey("Ground").house()
    for start, end in pairwise(((10.0, 0.0), (14.0, 0.0), (14.0, 4.0), (10.0, 4.0))):
        model.wall(start, end)
    model.opening(((10.0, 1.0), (10.0, 2.0)), filling="IfcDoor", wall=model.wall((10.0, 0.0), (10.0, 4.0)))
    plan = read_one(Ifc(), model.save(tmp_path))
    assert contains(plan, [*INSIDE, (12.0, 2.0), (10.0, 1.5)]) == [True] * len(INSIDE) + [False, False]
    assert len(plan.doors) == 2


# What is refused
def test_without_ifcopenshell_the_extra_to_install_is_named(tmp_path, monkeypatch):
    path = tmp_path / "home.ifc"
    path.write_text("ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC4'));\n")
    monkeypatch.setitem(sys.modules, "ifcopenshell", None)  # as if it were not installed
    with pytest.raises(PlanError, match=r"need the package ifcopenshell\. Install it: pip install 'hinterland\[ifc\]'"):
        read_all(Ifc(), path)


@pytest.mark.parametrize("share", [0.1, 0.9, 0.999])
def test_a_truncated_model_is_refused_whole(tmp_path, share):
    path = Model().storey("Ground").house().save(tmp_path)
    whole = path.read_bytes().rstrip()
    path.write_bytes(whole[: int(share * len(whole))])
    assert "it has no end (END-ISO-10303-21)" in refusal(Ifc(), path)


def cycle(path: Path) -> None:
    model = ifcopenshell.open(str(path))
    for placement in model.by_type("IfcLocalPlacement"):
        placement.PlacementRelTo = placement
    model.write(str(path))


BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "missing": (Path.unlink, "cannot be read (No such file or directory)"),
    "empty": (lambda path: path.write_bytes(b""), "it has no end"),
    "text": (lambda path: path.write_text("hello\nEND-ISO-10303-21;\n"), "not a readable IFC model"),
    "another schema": (
        lambda path: path.write_text(path.read_text().replace("'IFC4'", "'AUTOMOTIVE_DESIGN'")),
        "not a readable IFC model",
    ),
    "refers to itself": (cycle, "it refers to itself, is damaged, or needs too much memory. Export it again."),
}


@pytest.mark.parametrize("case", BAD)
def test_a_damaged_model_gives_one_clear_error(tmp_path, case):
    damage, message = BAD[case]
    path = Model().storey("Ground").walls().save(tmp_path)
    damage(path)
    assert message in refusal(Ifc(), path)


def test_a_model_without_floors_or_walls_is_refused(tmp_path):
    assert "no IfcBuildingStorey, expected one for each floor." in refusal(Ifc(), Model().save(tmp_path))
    path = Model().storey("Ground").storey("Roof", 3.0).save(tmp_path)
    assert "no wall stands 1.1 m above any of 2 storeys. Check the model." in refusal(Ifc(), path)


def test_too_large_or_too_slow_a_model_is_refused(tmp_path, monkeypatch):
    path = Model().storey("Ground").walls().save(tmp_path)
    monkeypatch.setattr(ifc_cuts, "MOST_SECONDS", 0.01)
    assert "its geometry takes more than 0.01 s. Simplify the model" in refusal(Ifc(), path)
    monkeypatch.setattr(ifc_cuts, "_MOST_BYTES", 100)
    assert "more than 100 bytes, at most that many are read. Split the model." in refusal(Ifc(), path)


def test_a_model_is_known_by_its_header(tmp_path):
    path = Model().storey("Ground").walls().save(tmp_path, "model.txt")
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["ifc"]
    assert not Ifc().accompanies(path)


@pytest.mark.parametrize("content", [b"", b"ISO-10303-21;", b"FILE_SCHEMA(('IFC4'));", b"\xff\x00" * 50])
def test_other_files_are_no_model(tmp_path, content):
    (tmp_path / "other.ifc").write_bytes(content)
    assert not Ifc().sniff(tmp_path / "other.ifc")
    assert not Ifc().sniff(tmp_path / "absent.ifc")
    assert not Ifc().sniff(tmp_path)


# Real data
def test_a_real_house_is_read_at_its_size():
    with plan_files("bim_samples") as entries:
        (duplex,) = (entry for entry in entries if "Duplex" in entry.file.path.name)
        plans = read_all(Ifc(), duplex.file.path, levels=("Level 1", "Level 2"))
    assert [(len(plan.doors), len(plan.rooms)) for plan in plans] == [(6, 10), (8, 12)]
    for plan in plans:
        left, bottom, right, top = plan.bounds
        assert (right - left, top - bottom) == (pytest.approx(8.8, abs=0.1), pytest.approx(17.8, abs=0.1))
        halves = shapely.area(shapely.get_parts(plan.free))  # two flats, each with all of its rooms
        assert halves == pytest.approx([plan.free.area / 2] * 2, rel=0.01)
        assert 110 < plan.free.area < 135


@pytest.mark.slow
def test_a_real_terrace_of_five_houses_stays_five_houses():
    """The porches between the houses are no way from one to the next."""
    with plan_files("bim_samples") as entries:
        (terrace,) = (entry for entry in entries if "Smiley" in entry.file.path.name)
        plans = read_all(Ifc(), terrace.file.path)
    assert [plan.floor.rpartition("2007.")[2] for plan in plans] == ["KG", "EG", "1.OG", "2.OG"]
    assert [len(shapely.get_parts(plan.free)) for plan in plans] == [5, 5, 5, 5]
    assert sum(len(plan.doors) for plan in plans) == 85
