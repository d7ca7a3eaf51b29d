import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, UNKNOWN, GridPlan, Location
from pipeline.floorplans.readers import READERS, read_plan_file
from pipeline.floorplans.readers import valetudo as valetudo_module
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.readers.valetudo import Valetudo
from tests.floorplans.real_data import plan_files, read_entry

# An L, y down: (x, y, length along x). A hall of 4 x 2 pixels over a foot of 2 x 2 at its left, walls to the right.
HALL, FOOT, WALL = [10, 20, 4, 10, 21, 4], [10, 22, 2, 10, 23, 2], [14, 20, 1, 14, 21, 1]


def layer(kind: str, runs: list[int], *, compressed: bool = True, **about) -> dict:
    pixels = [
        n for x, y, k in zip(runs[::3], runs[1::3], runs[2::3], strict=True) for j in range(k) for n in (x + j, y)
    ]
    packed = {"pixels": [], "compressedPixels": runs} if compressed else {"pixels": pixels}
    return {"__class": "MapLayer", "type": kind, "metaData": about} | packed


def home(*layers: dict, **changes) -> dict:
    return {"__class": "ValetudoMap", "pixelSize": 5, "layers": list(layers), "entities": []} | changes


def ell(*, compressed: bool = True, **changes) -> dict:
    hall = layer("segment", HALL, compressed=compressed, segmentId="7", name="Hall")
    foot = layer("segment", FOOT, compressed=compressed, segmentId="9")
    return home(hall, foot, layer("wall", WALL, compressed=compressed), **changes)


def write(path: Path, content: object) -> Path:
    path.write_text(json.dumps(content))
    return path


def read(path: Path) -> GridPlan:
    (plan,) = Valetudo().read(path, ReadOptions())
    return plan


def drawn(plan: GridPlan) -> list[str]:
    """The cells as lines, the first line the top."""
    return ["".join(".#?"[cell] for cell in row) for row in plan.cells[::-1]]


@pytest.mark.parametrize("compressed", [True, False])
def test_a_map_is_turned_over_not_mirrored(tmp_path, compressed):
    plan = read(write(tmp_path / "flat.json", ell(compressed=compressed)))
    assert drawn(plan) == ["....#", "....#", "..???", "..???"]
    assert (plan.resolution, plan.origin, plan.remarks) == (0.05, Location(0.0, 0.0), ())
    assert (plan.plan_id, plan.building, plan.environment) == ("flat", "flat", "valetudo_homes")


def test_segments_are_rooms_with_names(tmp_path):
    layer = read(write(tmp_path / "flat.json", ell())).layers["rooms"]
    assert layer.labels == {1: "Hall", 2: "room 9"}
    assert layer.values.tolist() == [[2, 2, 0, 0, 0]] * 2 + [[1, 1, 1, 1, 0]] * 2


def test_walls_win_over_floor_whatever_their_order(tmp_path):
    wall = layer("wall", [10, 20, 2])
    floor = layer("floor", [10, 20, 4])
    for layers in ([wall, floor], [floor, wall]):
        assert drawn(read(write(tmp_path / "a.json", home(*layers)))) == ["##.."]


def test_a_map_without_segments_says_so(tmp_path):
    plan = read(write(tmp_path / "a.json", home(layer("floor", HALL))))
    assert plan.remarks == ("the map has no rooms yet",)
    assert plan.layers["rooms"].labels == {}


def test_layers_of_other_kinds_and_empty_ones_are_passed_over(tmp_path):
    layers = [layer("carpet", [0, 0, 1]), layer("segment", []), {"type": "floor"}, 7, layer("floor", HALL)]
    assert drawn(read(write(tmp_path / "a.json", home(*layers)))) == ["....", "...."]


@settings(max_examples=30, deadline=None)
@given(arrays(np.uint8, st.tuples(st.integers(1, 8), st.integers(1, 8)), elements=st.integers(0, 2)), st.booleans())
def test_any_picture_comes_back_cell_by_cell(tmp_path_factory, picture, compressed):
    def runs(value: int) -> list[int]:
        return [n for y, x in np.argwhere(picture == value).tolist() for n in (x + 3, y + 5, 1)]

    layers = [layer(kind, runs(value), compressed=compressed) for kind, value in (("floor", FREE), ("wall", OCCUPIED))]
    path = write(tmp_path_factory.mktemp("home") / "a.json", home(*layers))
    if not (picture == FREE).any():
        with pytest.raises(PlanError, match="no layer of floor or segments holds a pixel"):
            read(path)
        return
    rows, cols = (np.flatnonzero((picture != UNKNOWN).any(axis=axis)) for axis in (1, 0))
    known = picture[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
    assert np.array_equal(read(path).cells[::-1], known)


BAD = {
    "no class": (ell() | {"__class": "Other"}, "no object of the class ValetudoMap"),
    "no scale": ({key: value for key, value in ell().items() if key != "pixelSize"}, "pixelSize is 'None'"),
    "scale 0": (ell(pixelSize=0), "pixelSize is 0, expected centimetres per pixel above 0"),
    "scale below 0": (ell(pixelSize=-5), "pixelSize is -5"),
    "no layers": (home(), "no layer of floor or segments holds a pixel"),
    "layers a mapping": (ell(layers={"a": 1}), "layers is a mapping of 1, expected a list of at most 1000"),
    "walls alone": (home(layer("wall", WALL)), "no layer of floor or segments holds a pixel"),
    "groups of two": (
        home(layer("floor", HALL) | {"compressedPixels": [1, 2]}),
        "layer 0: expected numbers in groups of 3",
    ),
    "below 0": (home(layer("floor", [-1, 0, 5])), "a pixel is no whole number from 0 to 100,000"),
    "text": (home({"type": "floor", "pixels": ["a", "b"]}), "a pixel is no whole number"),
    "halves": (home({"type": "floor", "pixels": [0.5, 1]}), "a pixel is no whole number"),
    "wide": (home(layer("floor", [0, 0, 1, 99_999, 99_999, 1])), "100000 x 100000 cells, at most 36,000,000"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_map_gives_one_clear_error(tmp_path, case):
    content, message = BAD[case]
    path = write(tmp_path / "a.json", content)
    with pytest.raises(PlanError) as refusal:
        read_plan_file(path, "valetudo")
    assert str(refusal.value).startswith(f"{path}: ")
    assert message in str(refusal.value)


def test_many_layers_over_the_same_cells_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(valetudo_module, "_MOST_CELLS", 1000)
    small = [layer("floor", [0, 0, 99]) for _ in range(11)]
    with pytest.raises(PlanError, match="its layers have more than 1,000 cells"):
        read(write(tmp_path / "a.json", home(*small)))
    assert read(write(tmp_path / "a.json", home(*small[:10]))).cells.shape == (1, 99)


def test_the_content_tells_maps_from_other_json(tmp_path):
    path, other = write(tmp_path / "a.json", ell()), write(tmp_path / "b.json", {"verts": []})
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["valetudo"]
    assert not Valetudo().sniff(other)
    assert not Valetudo().sniff(tmp_path / "missing.json")


def test_real_homes_have_the_size_of_homes():
    with plan_files("valetudo_homes") as entries:
        for entry in entries[::3]:
            (plan,) = read_entry(entry)
            assert plan.resolution == 0.05
            assert plan.building.startswith("home_")
            assert 5 < (plan.cells == FREE).sum() * plan.resolution**2 < 300
            assert max(plan.cells.shape) * plan.resolution < 45
