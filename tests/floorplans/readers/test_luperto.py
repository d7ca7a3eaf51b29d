import os
import zipfile
from contextlib import suppress
from pathlib import Path
from time import process_time
from xml.etree import ElementTree

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import PlanError
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.plan import FloorPlan
from pipeline.floorplans.readers import READERS, read_plan_file
from pipeline.floorplans.readers.luperto import Luperto
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.grids.occupancy import OCCUPIED
from pipeline.grids.rasterize import rasterize

ABOUT = "the scale was measured on one door: sizes are good to 5 to 10 %"
# 10 pixels are 90 cm. A corridor, drawn above an office on its left: an L whose foot points down at the left.
CORRIDOR = [(0, 0), (200, 0), (200, 20), (0, 20)]
OFFICE = [(0, 20), (60, 20), (60, 70), (0, 70)]
DOOR = ((30, 20), (30, 20))
SCALE = {"pixels": "10", "real": "90", "unit": "cm"}
DATA = Path(os.environ.get("HINTERLAND_DATA", Path(__file__).parents[3].parent / "shared" / "data"))


def points(corners) -> str:
    return "".join(f'<point x="{x}" y="{y}"/>' for x, y in corners)


def portal(targets=("a", "b"), kind="EXPLICIT", features="NORMAL", segment="p") -> str:
    ids = "".join(f"<id>{target}</id>" for target in targets)
    return (
        f"<portal><linesegment>{segment}</linesegment><class>HORIZONTAL</class><type>{kind}</type>"
        f"<features>{features}</features><direction>BOTH</direction><target>{ids}</target></portal>"
    )


def space(identity: str, label: str, corners, *, portals="", segments=(("p", DOOR),)) -> str:
    lines = "".join(f'<linesegment id="{name}">{points(ends)}</linesegment>' for name, ends in segments)
    return (
        f'<space id="{identity}"><labels><type>R</type><label>{label}</label></labels>'
        f"<bounding_polygon>{points([*corners, *corners[:1]])}</bounding_polygon>"
        f"<space_representation>{lines}</space_representation><portals>{portals}</portals></space>"
    )


def two_rooms(**changes) -> str:
    """A corridor and an office with one door, listed by both rooms as in the published files."""
    door = portal(**changes)
    return space("a", "CORRIDOR", CORRIDOR, portals=door) + space("b", " OFFICE ", OFFICE, portals=door)


def write(tmp_path: Path, spaces: str, *, name="drawn.xml", head="", kind="SCHOOL", **scale) -> Path:
    given = SCALE | scale
    path = tmp_path / name
    path.write_text(
        f'<?xml version="1.0" encoding="UTF-8"?>{head}<building id="1"><name>/home/someone/drawn</name><scale>'
        f"<represented_distance><value>{given['pixels']}</value><um>pixel</um></represented_distance>"
        f"<real_distance><value>{given['real']}</value><um>{given['unit']}</um></real_distance></scale>"
        f"<building_type><main_type>{kind}</main_type></building_type>"
        f"<floor><spaces>{spaces}</spaces></floor></building>"
    )
    return path


def read(path: Path, **options) -> FloorPlan:
    (plan,) = Luperto().read(path, ReadOptions(**options))
    return plan


def test_a_floor_is_scaled_by_its_door_and_turned_over_not_mirrored(tmp_path):
    plan = read(write(tmp_path, two_rooms(), name="Sabadell2_updated.xml"))
    assert (plan.plan_id, plan.building, plan.floor) == ("Sabadell2", "Sabadell", "Sabadell2")
    assert (plan.environment, plan.source) == ("luperto_schools", "Sabadell2_updated.xml")
    assert plan.remarks == (ABOUT,)
    assert plan.bounds == pytest.approx((0, -6.3, 18, 0))
    assert shapely.contains_xy(plan.free, 17, -1)  # the far end of the corridor: high x, high y
    assert shapely.contains_xy(plan.free, 1, -6)  # the office: low x, low y
    assert not shapely.contains_xy(plan.free, 17, -6) and not shapely.contains_xy(plan.free, 1, 0)


def test_labels_stay_with_their_outlines(tmp_path):
    rooms = read(write(tmp_path, two_rooms())).rooms
    assert [room.label for room in rooms] == ["CORRIDOR", "OFFICE"]
    assert rooms[0].outline.bounds == pytest.approx((0, -1.8, 18, 0))
    assert rooms[1].outline.bounds == pytest.approx((0, -6.3, 5.4, -1.8))


@pytest.mark.parametrize("width", [0.6, 0.9, 1.3])
@pytest.mark.parametrize("wall", [0.1, 0.3])
def test_a_portal_of_zero_length_is_cut_open_to_the_given_width(tmp_path, width, wall):
    plan = read(write(tmp_path, two_rooms()), door_width_m=width, wall_m=wall)
    (door,) = plan.doors
    assert (door.x, door.y, door.width, door.leaf) == pytest.approx((2.7, -1.8, width, True))
    assert shapely.get_num_geometries(plan.free) == 1
    cut = plan.free.intersection(shapely.LineString([(0, -1.8), (18, -1.8)]))
    assert cut.length == pytest.approx(width)
    assert cut.centroid.x == pytest.approx(2.7)
    above = plan.free.intersection(shapely.LineString([(10, -1.8), (10, 1)]))
    assert above.length == pytest.approx(1.8 - wall)  # half a wall off each side of every room


def test_double_doors_are_twice_as_wide_and_openings_have_no_leaf(tmp_path):
    (double,) = read(write(tmp_path, two_rooms(features="DOUBLE"))).doors
    assert (double.width, double.leaf) == (1.8, True)
    (opening,) = read(write(tmp_path, two_rooms(kind="IMPLICIT"))).doors
    assert (opening.width, opening.leaf) == (0.9, False)


def test_two_doors_between_the_same_rooms_are_both_cut(tmp_path):
    far = ("q", ((50, 20), (50, 20)))
    doors = portal() + portal(segment="q")
    rooms = space("a", "CORRIDOR", CORRIDOR, portals=doors, segments=(("p", DOOR), far))
    plan = read(write(tmp_path, rooms + space("b", "OFFICE", OFFICE)))
    assert [door.x for door in plan.doors] == pytest.approx([2.7, 4.5])


def test_rooms_without_a_portal_stay_sealed(tmp_path):
    plan = read(write(tmp_path, space("a", "CORRIDOR", CORRIDOR) + space("b", "OFFICE", OFFICE)))
    assert plan.doors == ()
    assert inspect(plan).free_components == 2
    assert any("sealed rooms" in warning for warning in inspect(plan).warnings)


def test_neighbours_a_pixel_apart_are_joined_too(tmp_path):
    office = [(0, 22), (60, 22), (60, 70), (0, 70)]
    rooms = space("a", "CORRIDOR", CORRIDOR, portals=portal()) + space("b", "OFFICE", office)
    plan = read(write(tmp_path, rooms))
    assert shapely.get_num_geometries(plan.free) == 1
    assert plan.doors[0].width == 0.9


def test_a_door_stands_on_the_grid_wherever_the_walls_fall(tmp_path):
    grid = rasterize(read(write(tmp_path, two_rooms())), 0.1)
    assert (grid.cells[[0, -1]] == OCCUPIED).all() and (grid.cells[:, [0, -1]] == OCCUPIED).all()
    assert inspect(read(write(tmp_path, two_rooms()))).narrowest_door_m == pytest.approx(0.9, abs=0.01)


@pytest.mark.parametrize(
    ("scale", "size"),
    [({}, 18.0), ({"pixels": "5"}, 36.0), ({"real": "900", "unit": "mm"}, 18.0), ({"real": ".9", "unit": "m"}, 18.0)],
)
def test_the_scale_is_what_the_file_says(tmp_path, scale, size):
    plan = read(write(tmp_path, two_rooms(), **scale))
    assert plan.bounds.max_x == pytest.approx(size)
    assert plan.doors[0].width == 0.9


def test_a_person_knows_the_scale_better(tmp_path):
    plan = read(write(tmp_path, two_rooms(), pixels=""), metres_per_unit=0.05)
    assert plan.bounds == pytest.approx((0, -3.5, 10, 0))
    assert plan.remarks == ()


@pytest.mark.parametrize(
    ("scale", "said"),
    [
        ({"pixels": ""}, r"scale/represented_distance = '', expected a finite number. Give it: plans.read"),
        ({"pixels": "nan"}, r"scale/represented_distance = 'nan', expected a finite number"),
        ({"pixels": "0"}, r"the scale is 90 cm for 0 pixels, expected .* plans.read.metres_per_unit=0.09"),
        ({"pixels": "-10"}, r"the scale is 90 cm for -10 pixels"),
        ({"real": "1e400"}, r"scale/real_distance = '1e400', expected a finite number"),
        ({"unit": "inch"}, r"the scale is 90 inch for 10 pixels, expected cm"),
        ({"real": "900", "unit": "m"}, r"900 m for 10 pixels is 90 m per pixel, expected 0.001 to 10. Give it: "),
        ({"pixels": "1e-310"}, r"is inf m per pixel, expected 0.001 to 10"),
        ({"pixels": "1e9"}, r"is 9e-10 m per pixel, expected 0.001 to 10"),
    ],
)
def test_a_missing_or_implausible_scale_is_refused(tmp_path, scale, said):
    path = write(tmp_path, two_rooms(), **scale)
    with pytest.raises(PlanError, match=said) as caught:
        read(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_outlines_that_cross_themselves_are_repaired_and_said(tmp_path):
    spiked = [*OFFICE[:3], (0, 70), (0, 30), (-5, 40), (5, 35)]
    plan = read(write(tmp_path, space("a", "CORRIDOR", CORRIDOR, portals=portal()) + space("b", "OFFICE", spiked)))
    assert plan.remarks == (ABOUT, "1 outline crossed itself and was repaired")
    assert plan.free.is_valid and shapely.get_num_geometries(plan.free) == 1


def test_what_cannot_be_used_is_said(tmp_path):
    lost = portal(segment="gone") + portal(targets=("a", "z")) + portal(targets=("a", "a"))
    thin = space("c", "SHAFT", [(100, 40), (101, 40), (101, 60), (100, 60)])
    line = space("d", "?", [(150, 40), (160, 40)])
    far = portal(targets=("b", "e"))
    rooms = two_rooms() + thin + line + space("e", "HALL", [(90, 90), (190, 90), (190, 190), (90, 190)], portals=far)
    plan = read(write(tmp_path, rooms.replace("<portals></portals>", f"<portals>{lost}</portals>", 1)))
    assert plan.remarks == (
        ABOUT,
        "1 room has no floor of its own: thinner than walls, or under other rooms",
        "1 door leads outside or to no outlined room and stays closed",
        "1 space without an outline left out",
        "3 portals without two rooms or a place left closed",
    )
    assert len(plan.doors) == 1 and len(plan.rooms) == 4


@pytest.mark.parametrize(
    ("stem", "building"),
    [
        ("Valleceppi_P1_updated", "Valleceppi"),
        ("Valleceppi_P0", "Valleceppi"),
        ("plans-2", "plans"),
        ("FALAELEM2", "FALAELEM"),
        ("scuola_mera__updated", "scuola_mera"),
        ("ED21", "ED21"),
        ("plan-x-1900", "plan-x-1900"),
        ("7", "7"),
    ],
)
def test_floors_of_a_building_are_known_by_their_names(tmp_path, stem, building):
    plan = read(write(tmp_path, two_rooms(), name=f"{stem}.xml", kind="OFFICE"))
    assert (plan.building, plan.environment) == (building, "luperto_offices")
    assert plan.plan_id == stem.removesuffix("_updated")


def test_a_building_of_another_kind_is_just_a_floor(tmp_path):
    assert read(write(tmp_path, two_rooms(), kind="../castle")).environment == "luperto_floors"


@pytest.mark.parametrize(
    ("spaces", "said"),
    [
        ("", "0 spaces, expected 1 to 5000 in floor/spaces"),
        ("<space/>" * 5001, "5001 spaces, expected 1 to 5000"),
        ("<space/>", "no space has an outline of 3 corners or more"),
        (space("a", "", [(0, 0), (1, 1)]), "no space has an outline of 3 corners or more"),
        (space("a", "", [(0, 0), (9, "nan"), (9, 9)]), "point/@y = 'nan', expected a finite number"),
        (space("a", "", [(0, 0), ("inf", 0), (9, 9)]), "point/@x = 'inf', expected a finite number"),
        (space("a", "", [(0, 0), ("1e99", 0), (9, 9)]), "point/@x = '1e99', expected a finite number"),
        (space("a", "", [(0, 0), ("left", 0), (9, 9)]), "point/@x = 'left', expected a finite number"),
        (space("a", "", OFFICE).replace('x="0" ', "", 1), "point/@x = '', expected a finite number"),
    ],
)
def test_what_is_no_floor_is_refused_with_the_name_of_the_file(tmp_path, spaces, said):
    path = write(tmp_path, spaces)
    with pytest.raises(PlanError, match=said) as caught:
        read(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert len(str(caught.value)) < 400


BOMB = "<!DOCTYPE b [<!ENTITY a 'ha'>" + "".join(
    f"<!ENTITY {chr(98 + k)} '{f'&{chr(97 + k)};' * 10}'>" for k in range(12)
)


@pytest.mark.parametrize(
    "head",
    [
        BOMB + "]>",
        "<!DOCTYPE b [<!ENTITY a SYSTEM 'file:///etc/hostname'>]>",
        "<!DOCTYPE b SYSTEM 'http://example.com/b.dtd'>",
        "<!DOCTYPE b>",
    ],
)
def test_entities_and_document_types_are_refused(tmp_path, head):
    path = write(tmp_path, two_rooms().replace(" OFFICE ", "&a;" if "ENTITY" in head else "x"), head=head)
    before = process_time()
    with pytest.raises(PlanError, match=r"drawn.xml: holds entities or a DTD .* Remove them"):
        read(path)
    assert process_time() - before < 1


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: content[:500],
        lambda content: content[:-1],
        lambda content: b"",
        lambda content: content.replace(b"UTF-8", b"UTF-9"),
        lambda content: content.replace(b"CORRIDOR", b"\xff\xfe"),
        lambda content: content.replace(b"<floor>", b"<floor>\0"),
        lambda content: content.replace(b"</floor>", b""),
        lambda content: content.replace(b"CORRIDOR", b"&unknown;"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path, damage):
    path = write(tmp_path, two_rooms())
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(PlanError, match=r"drawn.xml: not readable XML .* Get the file again"):
        read(path)


def test_deep_nesting_is_passed_over(tmp_path):
    path = write(tmp_path, two_rooms())
    deep = "<a>" * 100_000 + "</a>" * 100_000
    path.write_text(path.read_text().replace("<floor>", f"{deep}<floor>"))
    assert len(read(path).rooms) == 2


def test_other_xml_and_large_files_are_refused(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text("<svg/>")
    with pytest.raises(PlanError, match=r"a.xml: begins with <svg>, expected <building>"):
        read(path)
    with path.open("ab") as stream:
        stream.truncate(10_000_001)
    with pytest.raises(PlanError, match="more than 10,000,000 bytes"):
        read(path)
    with pytest.raises(PlanError, match=r"gone.xml: not readable XML \(.*No such file"):
        read(tmp_path / "gone.xml")


def test_a_scribble_is_refused_before_it_takes_minutes(tmp_path):
    corners = np.random.default_rng(0).uniform(0, 200, (3000, 2)).round(3).tolist()
    with pytest.raises(PlanError, match=r"drawn.xml: .*lines meet more than 300,000 times"):
        read(write(tmp_path, space("a", "", corners)))


def test_only_such_floors_are_recognised(tmp_path):
    path = write(tmp_path, two_rooms(), name="floor.txt")
    assert Luperto().sniff(path)
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["luperto"]
    for content in (b"", b"<building/>", b"<represented_distance/>", b"<svg><building/></svg>", b"\xff" * 99):
        path.write_bytes(content)
        assert not Luperto().sniff(path)
    assert not Luperto().sniff(tmp_path) and not Luperto().sniff(tmp_path / "gone.xml")
    assert not Luperto().accompanies(path)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2500), st.binary(min_size=1, max_size=12))
def test_a_file_with_any_bytes_changed_is_read_or_refused(tmp_path_factory, place, noise):
    path = write(tmp_path_factory.mktemp("noise"), two_rooms())
    content = path.read_bytes()
    path.write_bytes(content[:place] + noise + content[place + len(noise) :])
    with suppress(PlanError):
        assert read(path).free.is_valid


@pytest.fixture(scope="module")
def real_floors(tmp_path_factory) -> list[Path]:
    packed = DATA / "luperto_schools_offices" / "dev" / "xml_dev.zip"
    if not packed.is_file():
        pytest.skip(f"no floors in {packed.parent}: set HINTERLAND_DATA to the folder of luperto_schools_offices")
    folder = tmp_path_factory.mktemp("floors")
    with zipfile.ZipFile(packed) as archive:
        return [Path(archive.extract(name, folder)) for name in sorted(archive.namelist())[::6] if name[-4:] == ".xml"]


def test_real_floors_hang_together(real_floors):
    assert len(real_floors) >= 6
    for path in real_floors:
        (plan,) = read_plan_file(path)
        assert plan.environment == f"luperto_{path.parent.name}s"
        assert inspect(plan).largest_free_share > 0.97
        spaces = ElementTree.parse(path).getroot().findall("floor/spaces/space")
        assert len(spaces) - 1 <= len(plan.rooms) <= len(spaces)
        assert all(room.label.isupper() for room in plan.rooms)
        widths = {door.width for door in plan.doors}
        assert widths <= {0.9, 1.8} | {width for width in widths if 0.45 <= width < 1.8}
        assert sum(door.width in (0.9, 1.8) for door in plan.doors) > 0.8 * len(plan.doors)
