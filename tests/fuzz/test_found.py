"""What the campaigns found, each input made small: none of these may come back."""

import io
import json
import time
import zipfile

import numpy as np
import pytest
from shapely import LineString

from pipeline.errors import PlanError
from pipeline.floorplans import rooms
from pipeline.floorplans.checks import inspect
from pipeline.floorplans.readers import READERS, classify, ifc_cuts, read_plan_file
from pipeline.floorplans.readers.dxf_doors import doorways
from pipeline.floorplans.sources import lone_file, open_source
from tests.fuzz.bombs import bomb_named
from tests.fuzz.sample import CENTIMETRES, Sample, box, collection, feature, npz_bytes, zip_bytes
from tests.fuzz.seeds import samples_of
from tests.fuzz.worker import examine


def _refusal(folder, reader: str, sample: Sample) -> str:
    """Return the message that refuses a sample, after the checks that every message has to pass."""
    for name, content in sample.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    path = folder / sample.main
    plans, refused, failure = examine(reader, path, sample.options, tuple(sample.files))
    assert (plans, refused, failure) == (0, 1, "")
    try:
        (found,) = read_plan_file(path, reader, sample.options)
        if not isinstance(found, PlanError):
            inspect(found)
    except PlanError as problem:
        return str(problem)
    return str(found)


def _edited(reader: str, old: str, new: str, number: int = 0) -> Sample:
    sample = samples_of(reader)[number]
    text = sample.files[sample.main].decode()
    assert old in text
    return Sample(sample.files | {sample.main: text.replace(old, new, 1).encode()}, sample.main, sample.options)


@pytest.mark.parametrize("where", ["a sheet", "an attribute"])
def test_a_css_number_of_5000_digits_is_no_fault_of_the_reader(tmp_path, where):
    said = f"stroke-width:{'9' * 5000}"
    sheet, style = (f"<style>.Wall{{{said}}}</style>", "") if where == "a sheet" else ("", f' style="{said}"')
    drawing = f'<svg xmlns="http://www.w3.org/2000/svg">{sheet}<path class="Wall"{style} d="M0 0h900v900h-900z"/></svg>'
    path = tmp_path / "a.svg"
    path.write_text(drawing)
    assert examine("svg", path, CENTIMETRES, ("a.svg",))[2] == ""


# Looking into a file of any kind, the reader of YAML parsed all of it


@pytest.mark.parametrize(
    "content",
    [
        "[" * 100_000,
        '{"image":' * 100_000,
        "image: " + "1" * 5000,
        "image: a.png\nday: 2024-99-99",
        "image: !!timestamp x",
        "image: !!bool x",
        "image: !!int ''",
        "? [image]\n: 1",
        "image: &r [*r]",
        "\ud800".encode("utf-8", "surrogatepass"),
    ],
)
def test_no_reader_raises_while_it_looks_into_a_file(tmp_path, content):
    path = tmp_path / "map.yaml"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert len(classify([lone_file(path)])) == 1
    for reader in READERS.values():
        assert reader.sniff(path) in (True, False)
        assert reader.accompanies(path) in (True, False)


def test_a_large_file_is_not_parsed_as_yaml(tmp_path, monkeypatch):
    path = tmp_path / "plan.json"
    path.write_text("[" + '"image", ' * 100_000 + "0]")

    def refuse(text: str) -> object:
        raise AssertionError("parsed")

    monkeypatch.setattr("pipeline.floorplans.readers.ros_map_server.load_map_yaml", refuse)
    assert not READERS["ros_map_server"].sniff(path)


@pytest.mark.parametrize(
    ("new", "message"),
    [
        ("a: &a [1, 2]\norigin: *a", "refers to other parts of itself"),
        ("a: &a {k: 1}\norigin: {<<: *a}", "refers to other parts of itself"),
        ("origin: 2024-99-99", "not a readable YAML file"),
        (f"origin: [{'9' * 400}, 0, 0]", "origin = "),
        (f"origin: {'[' * 100_000}", "expected the few lines of a map's YAML"),
        (f"origin: {'[' * 10_000}", "not a readable YAML file"),
        ("origin: [0, 0, 1.0e+300]", "a yaw of 5.73e+301 degrees"),
        ('origin: "a\\nb"', r"origin = 'a\nb'"),
    ],
)
def test_yaml_made_to_hurt(tmp_path, new, message):
    assert message in _refusal(tmp_path, "ros_map_server", _edited("ros_map_server", "origin: [-1.5, 2.0, 0.0]", new))


@pytest.mark.parametrize("name", ["a" * 5000, '"a\\0b"', '"a\\nb.png"', "/dev/zero", "."])
def test_an_impossible_name_of_a_picture(tmp_path, name):
    message = _refusal(tmp_path, "ros_map_server", _edited("ros_map_server", "map.pgm", name))
    assert "no such picture" in message and len(message) < 500


# Arrays


def _npz(reader: str, **changes: np.ndarray) -> Sample:
    sample = samples_of(reader)[0]
    with np.load(io.BytesIO(sample.files[sample.main])) as stored:
        layers = {name: stored[name] for name in stored.files}
    return Sample({sample.main: npz_bytes(layers | changes)}, sample.main)


def test_a_label_that_is_beyond_unicode(tmp_path):
    letters = np.array([0x110000, 65, 66, 67], dtype=np.uint32).view("<U1")
    assert "bytes that are no text" in _refusal(
        tmp_path, "mit_campus_grids", _npz("mit_campus_grids", semantic_labels=letters)
    )


def test_a_chessboard_of_doors(tmp_path):
    doors = (np.indices((300, 300)).sum(0) % 2 * 2).astype(np.uint8)
    sample = _npz("mit_campus_grids", occ_grid=np.zeros_like(doors), semantic_grid=doors)
    assert "45,000 patches are marked as doors" in _refusal(tmp_path, "mit_campus_grids", sample)


def test_a_grid_that_would_take_gigabytes(tmp_path):
    wide = np.zeros((3500, 3500), np.uint8)
    sample = _npz("kth_campus_grids", occ_map=wide, valid_space=wide)
    assert "12,250,000 cells, at most 10,000,000" in _refusal(tmp_path, "kth_campus_grids", sample)


def test_a_header_of_brackets_is_not_repeated_in_the_message(tmp_path):
    bomb = bomb_named("kth_campus_grids", "deep header v1")
    message = _refusal(tmp_path, "kth_campus_grids", bomb)
    assert "damaged npz" in message and len(message) < 500


def test_a_header_that_is_no_whole_statement(tmp_path):
    sample = samples_of("mit_campus_grids")[0]
    with zipfile.ZipFile(io.BytesIO(sample.files[sample.main])) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    members["occ_grid.npy"] = members["occ_grid.npy"].replace(b"{", b"[", 1).replace(b"}", b"(", 1)
    assert "not a readable npz" in _refusal(
        tmp_path, "mit_campus_grids", Sample({sample.main: zip_bytes(members)}, sample.main)
    )


# Archives and manifests


@pytest.mark.parametrize("name", ["\x1b[31m.json", "a\nb.json", "a\u2028b.json"])
def test_a_member_whose_name_is_not_one_line(tmp_path, name):
    path = tmp_path / "maps.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(name, "{}")
    with (
        pytest.raises(PlanError, match=r"maps.zip: holds .* a name that is not one line") as refusal,
        open_source(path),
    ):
        pass
    assert str(refusal.value).isprintable()


def test_a_building_is_one_line(tmp_path):
    (tmp_path / "manifest.csv").write_bytes(b'id,building\nc0ffee,"a\nb\x00\x1bc"\n')
    house = tmp_path / "c0ffee.json"
    house.write_bytes(samples_of("houseexpo")[0].files["c0ffee.json"])
    assert read_plan_file(house)[0].building == "a b c"


# Geometry


def test_a_scribble_is_refused_before_it_is_repaired(tmp_path):
    verts = np.random.default_rng(0).uniform(0, 50, (500, 2)).tolist()
    sample = Sample({"h.json": json.dumps({"id": "h", "verts": verts}).encode()}, "h.json")
    assert "lines meet more than 4,000 times" in _refusal(tmp_path, "houseexpo", sample)


def test_an_outline_that_crosses_itself_a_few_times_is_still_repaired(tmp_path):
    (tmp_path / "h.json").write_text(json.dumps({"id": "h", "verts": [[0, 0], [6, 6], [6, 0], [0, 6]]}))
    (plan,) = read_plan_file(tmp_path / "h.json", "houseexpo")
    assert plan.free.area == pytest.approx(18)


def test_a_file_without_any_feature(tmp_path):
    empty = b'{"type": "FeatureCollection", "features": []}'
    for reader in ("malls_geojson", "wrld", "indoor_geojson", "imdf"):
        sample = samples_of(reader)[0]
        changed = Sample(sample.files | {sample.main: empty}, sample.main)
        assert sample.main.rpartition("/")[2] in _refusal(tmp_path / reader, reader, changed)


def test_a_block_put_a_billion_times(tmp_path):
    bomb = bomb_named("dxf", "an array of nothing")
    assert "a block is put 900,000,000 times" in _refusal(tmp_path, "dxf", bomb)


def test_a_drawing_without_model_space(tmp_path):
    sample = samples_of("dxf")[0]
    content = sample.files[sample.main].replace(b"Model\n", b"Modem\n").replace(b"Model\r\n", b"Modem\r\n")
    assert "damaged DXF (KeyError" in _refusal(tmp_path, "dxf", Sample({sample.main: content}, sample.main))


def test_an_entity_without_a_layer(tmp_path):
    sample = _edited("dxf", "\nPOLYLINE\n", "\n20\n", 2)
    path = tmp_path / sample.main
    path.write_bytes(sample.files[sample.main])
    assert examine("dxf", path, sample.options)[2] == ""


@pytest.mark.parametrize("text", ["GEOMETRYCOLLECTION(" * 100_000, "CURVEPOLYGON(CIRCULARSTRING(0 0, 4 0, 4 4, 0 0))"])
def test_shapes_that_geos_crashes_on_or_shapely_does_not_know(tmp_path, text):
    homes = [{"id": 1, "geometries": {"living": [text]}}]
    sample = Sample({"homes.json": json.dumps(homes).encode()}, "homes.json")
    assert "is no polygon" in _refusal(tmp_path, "resplan", sample)


@pytest.mark.parametrize("tag", ['polygon points="{}"', 'g transform="rotate({})"', 'path d="M {}"', 'rect width="{}"'])
def test_a_row_of_digits_in_a_drawing(tmp_path, tag):
    shape = f'<g class="Wall"><{tag.format("1" * 5000)} class="Wall"/></g>'
    sample = Sample({"a.svg": f"<svg>{shape}</svg>".encode()}, "a.svg", CENTIMETRES)
    assert "a.svg: no shape" in _refusal(tmp_path, "svg", sample)


def test_one_line_that_is_a_scribble(tmp_path):
    scribble = " ".join(f"{x:.0f},{y:.0f}" for x, y in np.random.default_rng(0).uniform(0, 5000, (2000, 2)).tolist())
    shape = f'<polyline class="Wall" fill="none" points="{scribble}"/>'
    sample = Sample({"a.svg": f"<svg>{shape}</svg>".encode()}, "a.svg", CENTIMETRES)
    assert "lines meet more than 1,000,000 times" in _refusal(tmp_path, "svg", sample)


def test_an_area_drawn_three_hundred_times_is_one_space(tmp_path, monkeypatch):
    measured = []
    measure = rooms._shared_length
    monkeypatch.setattr(rooms, "_shared_length", lambda one, other: measured.append(1) or measure(one, other))
    areas = [feature("Polygon", box(0, 0, 9, 9), indoor="area", level="0")] * 300
    (tmp_path / "hall.geojson").write_bytes(collection(areas))
    (plan,) = read_plan_file(tmp_path / "hall.geojson", "indoor_geojson")
    assert plan.free.area == pytest.approx(8.9**2, rel=0.01)
    assert len(measured) < 300


def test_many_lone_walls_are_closed_one_by_one(tmp_path):
    spots = [(x, y) for x in range(30) for y in range(30)]
    segments = [{"p0": {"x": x, "y": y}, "p1": {"x": x + 0.5, "y": y}} for x, y in spots]
    path = tmp_path / "pillars.vectormap.json"
    path.write_text(json.dumps(segments))
    started = time.process_time()
    (plan,) = read_plan_file(path)
    assert plan.free.area == pytest.approx(29.6 * 29.1 - 900 * 0.06, rel=0.05)
    assert time.process_time() - started < 5


# Models: the library crashes, loops or raises what it likes


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("#9=IFCLOCALPLACEMENT($", "#9=IFCLOCALPLACEMENT(#9", "ifcopenshell crashed on it"),
        (".ELEMENT.,0.)", ".ELEMENT.,'a')", "the elevation of a storey is 'a'"),
        (".ELEMENT.,0.)", ".ELEMENT.,#3)", "the elevation of a storey is"),
    ],
)
def test_models_made_to_hurt(tmp_path, old, new, message):
    pytest.importorskip("ifcopenshell")
    assert message in _refusal(tmp_path, "ifc", _edited("ifc", old, new))


def test_a_model_that_never_ends(tmp_path, monkeypatch):
    pytest.importorskip("ifcopenshell")
    monkeypatch.setattr(ifc_cuts, "MOST_SECONDS", 0.05)
    assert "takes more than 0.05 s" in _refusal(tmp_path, "ifc", samples_of("ifc")[0])


def test_memory_that_runs_out_is_said(tmp_path, monkeypatch):
    sample = samples_of("houseexpo")[0]

    def exhaust(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("pipeline.floorplans.readers.houseexpo._house", exhaust)
    assert "needs more memory than there is" in _refusal(tmp_path, "houseexpo", sample)


def test_a_floor_that_cannot_be_measured_is_said(tmp_path, monkeypatch):
    from shapely.errors import GEOSException

    def exhaust(*_: object) -> None:
        raise GEOSException("std::bad_alloc")

    monkeypatch.setattr("pipeline.floorplans.checks.narrowest_opening", exhaust)
    assert "too tangled to be measured" in _refusal(tmp_path, "houseexpo", samples_of("houseexpo")[0])


def test_a_door_smaller_than_the_last_digit_of_where_it_lies():
    """At 10^17 m for each unit the touch of two lines is less than floating point tells apart, far from the origin."""
    door = LineString([(1e9 + 0.25, 3.0), (1e9 + 0.75, 3.0)])
    assert len(doorways([], [door], [], 1e17)) <= 1
