from dataclasses import replace
from math import isnan

import numpy as np
import pytest
import shapely

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, Bounds, Door, FloorPlan, GridPlan, Layer, Location, Room
from pipeline.floorplans.statistics import compare, floor_statistics

# A corridor of 20 x 2 m; beside it the rooms A, B (20 m2 each, joined), C (32 m2) and stairs (8 m2); walls of 0.2 m.
CORRIDOR = shapely.box(0.0, 0.0, 20.0, 2.0)
A, B = shapely.box(0.0, 2.2, 5.0, 6.2), shapely.box(5.2, 2.2, 10.2, 6.2)
C, STAIRS = shapely.box(0.0, -4.2, 8.0, -0.2), shapely.box(18.0, 2.2, 20.0, 6.2)
OUTLINES = ((CORRIDOR, "CORRIDOR"), (A, "OFFICE"), (B, "LAB"), (C, "CLASSROOM"), (STAIRS, "STAIRS"))
DOORS = (
    Door(2.5, 2.1, 0.9),
    Door(7.0, 2.1, 1.0),
    Door(5.1, 4.0, 0.8),
    Door(4.0, -0.1, 1.6, leaf=False),
    Door(19.0, 2.1, 1.0),
)
NAMES = {"plan_id": "p", "building": "p", "floor": "p", "environment": "test", "source": "hand"}


def drawn(outlines=OUTLINES, doors=DOORS):
    rooms = tuple(Room(outline, label) for outline, label in outlines)
    free = shapely.union_all([room.outline for room in rooms])
    return FloorPlan(**NAMES, free=free, bounds=Bounds(-1.0, -5.0, 21.0, 7.0), rooms=rooms, doors=doors)


def on_cells(name, value_of, labels):
    """Return the same floor on cells of 0.1 m with one layer, in which each outline has the value of its label."""
    values = np.zeros((120, 220), dtype=np.uint16)
    x, y = np.meshgrid(-1.0 + (np.arange(220) + 0.5) * 0.1, -5.0 + (np.arange(120) + 0.5) * 0.1)
    for outline, label in OUTLINES:
        values[shapely.contains_xy(outline, x, y)] = value_of[label]
    cells = np.where(values > 0, FREE, OCCUPIED).astype(np.uint8)
    return GridPlan(
        **NAMES,
        cells=cells,
        resolution=0.1,
        origin=Location(-1.0, -5.0),
        doors=DOORS,
        layers={name: Layer(values, labels)},
    )


def numbered(labels):
    return on_cells("rooms", {label: k for k, (_, label) in enumerate(OUTLINES, start=1)}, labels)


def check_known(found):
    assert (found.long_side_m, found.short_side_m) == pytest.approx((22.0, 12.0))
    assert found.floor_m2 == pytest.approx(120.0)
    assert sorted(found.room_m2) == pytest.approx([20.0, 20.0, 32.0])
    assert found.corridor_share == pytest.approx(40 / 120)
    assert found.common_share == pytest.approx(48 / 120)
    assert sorted(found.neighbours) == [1, 2, 2]
    assert found.dead_end_share == pytest.approx(1 / 3)
    assert found.loops == 1
    assert found.door_m == (0.9, 1.0, 0.8, 1.0)
    assert found.corridor_m
    assert all(width == pytest.approx(2.0, abs=0.1) for width in found.corridor_m)


def test_a_drawn_floor_has_the_known_numbers():
    check_known(floor_statistics(drawn()))


def test_the_same_floor_on_cells_has_the_same_numbers():
    labels = {k: label for k, (_, label) in enumerate(OUTLINES, start=1)}
    check_known(floor_statistics(numbered(labels)))


def test_where_nothing_is_named_the_region_with_most_doors_is_the_corridor():
    found = floor_statistics(numbered({}))
    assert found.corridor_share == pytest.approx(40 / 120)
    assert sorted(found.room_m2) == pytest.approx([8.0, 20.0, 20.0, 32.0])
    assert found.common_share == found.corridor_share


def test_patches_of_hallway_and_room_count_where_a_source_tells_only_these():
    labels = {0: "background", 2: "door", 3: "hallway", 4: "room"}
    values = {"CORRIDOR": 3, "STAIRS": 3, "OFFICE": 4, "LAB": 4, "CLASSROOM": 4}
    found = floor_statistics(on_cells("semantics", values, labels))
    assert sorted(found.room_m2) == pytest.approx([20.0, 20.0, 32.0])
    assert found.corridor_share == pytest.approx(48 / 120)
    assert sorted(found.neighbours) == [1, 2, 2]


def test_furniture_does_not_take_from_the_size_of_a_room():
    labels = {1: "clutter", 3: "hallway", 4: "room"}
    plan = on_cells("semantics", {"CORRIDOR": 3, "STAIRS": 3, "OFFICE": 4, "LAB": 4, "CLASSROOM": 4}, labels)
    values = plan.layers["semantics"].values.copy()
    values[80:90, 20:40] = 1  # in room A
    found = floor_statistics(replace(plan, layers={"semantics": Layer(values, labels)}))
    assert sorted(found.room_m2) == pytest.approx([20.0, 20.0, 32.0])


def test_a_floor_without_doors_has_no_neighbours():
    found = floor_statistics(drawn(doors=()))
    assert (found.neighbours, found.door_m, found.loops) == ((), (), 0)
    assert isnan(found.dead_end_share)


def test_a_door_away_from_two_regions_joins_nothing():
    away = (Door(2.5, 2.1, 0.9), Door(15.0, 2.1, 0.9), Door(12.0, 5.0, 0.9))
    assert floor_statistics(drawn(doors=away)).neighbours == (1,)


def test_a_plan_without_regions_is_refused():
    bare = replace(numbered({}), layers={})
    with pytest.raises(PlanError, match="plan p: no layer says which cells are rooms"):
        floor_statistics(bare)
    with pytest.raises(PlanError, match="plan p: no room is outlined"):
        floor_statistics(replace(drawn(), rooms=()))
    with pytest.raises(PlanError, match="too many to measure"):
        floor_statistics(replace(drawn(), bounds=Bounds(0.0, 0.0, 2000.0, 2000.0)))


def test_a_table_gives_quartiles_of_what_all_floors_hold_together():
    floors = [floor_statistics(drawn()), floor_statistics(drawn(outlines=(*OUTLINES[:3], *OUTLINES[4:])))]
    lines = compare({"mine": floors, "bare": [floor_statistics(drawn(doors=()))]}).splitlines()
    assert lines[:3] == ["| statistic | mine | bare |", "|---|---|---|", "| floors | 2 | 1 |"]
    rows = {line.split(" | ")[0].removeprefix("| "): line.split(" | ")[1:] for line in lines[3:]}
    assert rows["room size [m2]"][0] == "20 / **20** / 20"  # 20, 20, 32 and 20, 20
    assert rows["floor area [m2]"][0] == "96 / **104** / 112"
    assert rows["neighbours of a room, mean"][0] == "1.75 / **1.83** / 1.92"
    assert rows["door width [m]"][1].rstrip(" |") == "-"
    assert len(rows) == 11
