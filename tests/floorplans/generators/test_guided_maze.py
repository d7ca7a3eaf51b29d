from collections import defaultdict
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import ConfigError
from pipeline.floorplans.generators.guided_maze import (
    MazeShape,
    corridors,
    draw_guided_maze,
    draw_path,
    lattice,
    node_centers,
    open_loops,
    spanning_tree,
)
from pipeline.randomness import stream

shapes = st.builds(
    MazeShape,
    columns=st.integers(3, 7),
    rows=st.integers(3, 7),
    min_path_cells=st.integers(1, 4),
    corridor_m=st.sampled_from([1.0, 2.4, 3.0]),
)


@given(st.integers(2, 8), st.integers(2, 8), st.integers(0, 10_000))
def test_a_tree_joins_all_nodes_without_a_loop(columns, rows, seed):
    tree = spanning_tree(columns, rows, np.random.default_rng(seed))
    assert len(tree) == columns * rows - 1
    reached = {0}
    neighbours = defaultdict(set)
    for a, b in tree.tolist():
        assert b - a in (1, columns)
        neighbours[a].add(b)
        neighbours[b].add(a)
    front = [0]
    while front:
        fresh = neighbours[front.pop()] - reached
        reached |= fresh
        front.extend(fresh)
    assert reached == set(range(columns * rows))


@given(st.integers(0, 10_000), st.integers(1, 12))
def test_a_drawn_path_follows_the_tree_and_is_long_enough(seed, least):
    rng = np.random.default_rng(seed)
    tree = spanning_tree(5, 5, rng)
    path = draw_path(tree, least, rng)
    if path:
        assert len(path) - 1 >= least
        assert len(set(path)) == len(path)
        edges = {frozenset(edge) for edge in tree.tolist()}
        assert all(frozenset(step) in edges for step in pairwise(path))


@settings(max_examples=40, deadline=None)
@given(shapes, st.integers(0, 10_000))
def test_exactly_the_corridors_between_start_and_goal_are_wide(shape, seed):
    plan = draw_guided_maze(shape, np.random.default_rng(seed), plan_id="m")
    start, goal = plan.endpoints
    narrow, half = shape.corridor_m, shape.corridor_m * 0.99
    # A robot a little wider than a narrow corridor passes only the wide path: one part, with both ends in it.
    wide = shapely.get_parts(plan.free.buffer(-narrow * 0.51, join_style="mitre"))
    assert len(wide) == 1
    assert all(wide[0].distance(shapely.Point(end)) <= narrow for end in (start, goal))
    # No robot as wide as a wide corridor passes anywhere, and a narrow one reaches everything.
    assert plan.free.buffer(-narrow * 1.01, join_style="mitre").area < 0.05
    assert shapely.get_num_geometries(plan.free.buffer(-half / 2, join_style="mitre")) == 1
    # Nodes off the path have narrow corridors only.
    centers = node_centers(shape)
    wide_nodes = [wide[0].distance(shapely.Point(center)) < 1e-9 for center in centers]
    assert shape.min_path_cells + 1 <= sum(wide_nodes) < len(centers) + 1


def test_the_wide_corridor_is_twice_the_narrow_one():
    lines = np.array([[[0.0, 0.0], [10.0, 0.0]], [[10.0, 0.0], [10.0, 10.0]]])
    free = corridors(lines, [4.8, 2.4])
    assert free.intersection(shapely.LineString([(5, -9), (5, 9)])).length == pytest.approx(4.8)
    assert free.intersection(shapely.LineString([(-9, 6), (99, 6)])).length == pytest.approx(2.4)


def test_start_and_goal_keep_clear_of_walls():
    shape = MazeShape()
    for k in range(20):
        plan = draw_guided_maze(shape, stream(1, k), plan_id=str(k))
        room = 2 * shape.corridor_m / 2 - shape.jitter_m
        assert all(plan.free.exterior.distance(shapely.Point(end)) >= room - 1e-9 for end in plan.endpoints)


def test_the_same_stream_draws_the_same_maze_and_names_draw_others():
    first, again = (draw_guided_maze(MazeShape(), stream(0, "plans", "a"), plan_id="a") for _ in range(2))
    other = draw_guided_maze(MazeShape(), stream(0, "plans", "b"), plan_id="b")
    assert first == again
    assert not first.free.equals(other.free)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"columns": 1}, "plans.maze.columns = 1: expected at least 2"),
        ({"corridor_m": 0.0}, "plans.maze.corridor_m = 0.0: expected above 0 m"),
        ({"corridor_m": float("nan")}, "plans.maze.corridor_m = nan"),
        ({"pitch_m": 4.8}, "plans.maze.pitch_m = 4.8: expected above 4.8 m"),
        ({"jitter_m": 2.4}, "plans.maze.jitter_m = 2.4: expected from 0 to less than 2.4 m"),
        ({"min_path_cells": 48}, "plans.maze.min_path_cells = 48: expected between 1 and 47"),
        ({"wall_m": -1.0}, "plans.maze.wall_m = -1.0"),
    ],
)
def test_impossible_mazes_are_refused_by_key(changes, message):
    with pytest.raises(ConfigError) as refusal:
        MazeShape(**changes)
    assert message in str(refusal.value)


def test_a_path_that_hardly_any_maze_has_ends_with_a_message():
    with pytest.raises(ConfigError, match=r"plans.maze.min_path_cells = 47: expected less"):
        draw_guided_maze(MazeShape(min_path_cells=47), np.random.default_rng(0), plan_id="m")


@given(st.integers(2, 7), st.integers(2, 7), st.floats(0, 1), st.integers(0, 10_000))
def test_loops_open_their_share_of_the_missing_corridors(columns, rows, loops, seed):
    shape = MazeShape(columns=columns, rows=rows, min_path_cells=1, loops=loops)
    tree = spanning_tree(columns, rows, np.random.default_rng(seed))
    opened = open_loops(tree, shape, np.random.default_rng(seed))
    missing = len(lattice(columns, rows)) - len(tree)
    assert opened[: len(tree)].tolist() == tree.tolist()
    assert len({tuple(edge) for edge in opened.tolist()}) == len(tree) + round(loops * missing)


def test_all_loops_make_the_lattice_and_no_loops_leave_the_tree():
    every = draw_guided_maze(MazeShape(loops=1.0), np.random.default_rng(0), plan_id="m")
    none = draw_guided_maze(MazeShape(loops=0.0), np.random.default_rng(0), plan_id="m")
    assert len(every.free.interiors) == 5 * 7
    assert len(none.free.interiors) == 0


@pytest.mark.parametrize("widening", [1.0, 1.5])
def test_the_path_is_as_wide_as_asked(widening):
    shape = MazeShape(widening=widening)
    plan = draw_guided_maze(shape, np.random.default_rng(0), plan_id="m")
    assert plan.free.buffer(-shape.corridor_m * widening * 0.49, join_style="mitre").area > 0
    assert plan.free.buffer(-shape.corridor_m * widening * 0.51, join_style="mitre").area < 0.05
