import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, FloorPlan
from pipeline.floorplans.readers import COMPANION, READERS, classify, read_plan_file
from pipeline.floorplans.readers.amrl_vector_maps import AmrlVectorMaps, building_of, read_segments
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.sources import lone_file, open_source
from pipeline.grids.occupancy import FREE
from pipeline.grids.rasterize import rasterize
from tests.floorplans.real_data import dev_folder, read_entry

# An L, y up: the foot points to the right at the bottom. A door of 1 m parts the foot (a wall at x = 4) from the rest.
OUTLINE = [(0, 0), (10, 0), (10, 3), (4, 3), (4, 9), (0, 9), (0, 0)]
DIVIDER = [((4, 0), (4, 1)), ((4, 2), (4, 3))]


def lines(points) -> list[tuple]:
    return list(pairwise(points))


def write(folder: Path, segments, name: str = "GHC6.vectormap.json") -> Path:
    folder.mkdir(exist_ok=True)
    listed = [{"p0": {"x": a[0], "y": a[1]}, "p1": {"x": b[0], "y": b[1]}} for a, b in segments]
    (folder / name).write_text(json.dumps(listed))
    return folder / name


def read(path: Path, **options) -> FloorPlan:
    (plan,) = AmrlVectorMaps().read(path, ReadOptions(**options))
    return plan


@pytest.mark.parametrize("wall_m", [0.02, 0.1, 0.4])
def test_walls_have_the_thickness_asked_for(tmp_path, wall_m):
    plan = read(write(tmp_path, lines(OUTLINE)), wall_m=wall_m)
    inner = shapely.Polygon(OUTLINE).buffer(-wall_m / 2, join_style="mitre")
    assert (
        plan.free.symmetric_difference(inner).area < 0.02
    )  # slits narrower than any robot are closed, corners with them
    assert plan.bounds == Bounds(0, 0, 10, 9)


def test_the_plan_is_neither_mirrored_nor_turned_over(tmp_path):
    plan = read(write(tmp_path, lines(OUTLINE)))
    assert shapely.contains_xy(plan.free, [9, 1, 9, 1], [1, 8, 8, 1]).tolist() == [True, True, False, True]
    grid = rasterize(plan, 0.25)
    highest_free = [np.flatnonzero(column)[-1] for column in (grid.cells == FREE).T if column.any()]
    assert highest_free[0] > 2 * highest_free[-1]  # tall at the left, low at the right


def test_a_gap_in_a_wall_is_a_door_and_a_shut_wall_is_none(tmp_path):
    opened = read(write(tmp_path, lines(OUTLINE) + DIVIDER))
    shut = read(write(tmp_path, [*lines(OUTLINE), ((4, 0), (4, 3))]))
    assert len(shapely.get_parts(opened.free)) == 1
    assert len(shapely.get_parts(shut.free)) == 2
    assert opened.free.area > shut.free.area


def test_the_cavity_between_two_faces_is_no_floor(tmp_path):
    faces = [*lines(OUTLINE), ((4, 0), (4, 3)), ((4.3, 0), (4.3, 3))]
    free = read(write(tmp_path, faces)).free
    assert not shapely.contains_xy(free, 4.15, 1.5)
    assert shapely.contains_xy(free, 5, 1.5)


def test_the_ground_outside_an_open_facade_is_no_floor(tmp_path):
    open_facade = [segment for segment in lines(OUTLINE) if segment != ((10, 0), (10, 3))]
    open_facade += [((10, 0), (10, 1)), ((10, 2), (10, 3))]
    free = read(write(tmp_path, open_facade)).free
    assert shapely.contains_xy(free, 9, 1.5)
    assert not shapely.contains_xy(free, [12, -1, 8], [1.5, 1, 8]).any()


def test_segments_without_length_are_left_out_and_said(tmp_path):
    plan = read(write(tmp_path, [*lines(OUTLINE), ((1, 1), (1, 1))]))
    assert plan.remarks[-1] == "1 wall segments without length were left out"
    with pytest.raises(PlanError, match=r"GHC6.vectormap.json: no wall segment has a length"):
        read(write(tmp_path, [((1, 1), (1, 1))]))


@pytest.mark.parametrize(
    ("floor", "building"),
    [
        ("GHC6", "GHC"),
        ("GHC3_5", "GHC"),
        ("AHG1", "AHG"),
        ("AHGM", "AHG"),
        ("LGRCB", "LGRC"),
        ("NSH-2", "NSH"),
        ("Lab", "Lab"),
    ],
)
def test_the_name_of_a_floor_begins_with_its_building(floor, building):
    assert building_of(floor) == building


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("{}", "expected a list of wall segments"),
        ("[]", "expected a list of wall segments"),
        ('[{"p0": {"x": 0, "y": 0}}]', 'a segment lacks "p0" or "p1"'),
        ('[{"p0": [0, 0], "p1": [1, 1]}]', 'a segment lacks "p0" or "p1"'),
        ('[{"p0": {"x": 0, "y": NaN}, "p1": {"x": 1, "y": 1}}]', "a coordinate is not finite"),
        ('[{"p0": {"x": 0, "y": 1e300}, "p1": {"x": 1, "y": 1}}]', "a coordinate is not finite or beyond"),
        ('[{"p0": {"x": "0", "y": 0}, "p1": {"x": 1, "y": 1}}]', "a coordinate is not a number"),
        ('[{"p0": {"x": 0, "y"', "not whole JSON"),
    ],
)
def test_a_bad_map_gives_one_clear_error(tmp_path, content, message):
    path = tmp_path / "a.vectormap.json"
    path.write_text(content)
    with pytest.raises(PlanError) as refusal:
        read_plan_file(path, "amrl_vector_maps")
    assert str(refusal.value).startswith(f"{path}: ")
    assert message in str(refusal.value)


def test_navigation_graphs_accompany_maps(tmp_path):
    path = write(tmp_path, lines(OUTLINE))
    graph = tmp_path / "GHC6.navigation.json"
    graph.write_text('{"edges": [{"s0_id": 0, "s1_id": 1}], "nodes": [{"id": 0, "loc": {"x": 1, "y": 1}}]}')
    assert [name for name, reader in READERS.items() if reader.sniff(path)] == ["amrl_vector_maps"]
    assert next(entry.role for entry in classify([lone_file(graph), lone_file(path)])) == COMPANION
    assert not AmrlVectorMaps().accompanies(path)


def test_robots_drive_on_the_floor_of_real_maps():
    """The hand-made graphs stand on the floor found, and the ends of each edge can be reached from one another."""
    with open_source(dev_folder("amrl_vector_maps")) as files:
        by_name = {file.path.name: file for file in files}
        graphs = sorted(name for name in by_name if name.endswith(".navigation.json"))
        assert graphs
        for name in graphs[::5]:
            (entry,) = classify([by_name[name.replace("navigation", "vectormap")]])
            (plan,) = read_entry(entry)
            graph = json.loads(by_name[name].path.read_text())
            places = {node["id"]: (node["loc"]["x"], node["loc"]["y"]) for node in graph["nodes"]}
            inside = {key for key, spot in places.items() if shapely.box(*plan.bounds).contains(shapely.Point(spot))}
            edges = [(edge["s0_id"], edge["s1_id"]) for edge in graph["edges"]]
            ends = np.array([[places[a], places[b]] for a, b in edges if {a, b} <= inside])  # some lead to other floors
            parts = shapely.get_parts(plan.free)
            shapely.prepare(parts)
            near = [shapely.dwithin(parts[:, None], shapely.points(ends[:, k]), 0.2) for k in (0, 1)]
            assert len(ends) >= 8
            assert np.logical_and(*near).any(axis=0).mean() > 0.9
            assert len(read_segments(entry.file.path)) > 100
