import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import ConfigError, PlanError
from pipeline.floorplans.generators.forest import ForestShape, draw_forest, draw_trunks
from pipeline.randomness import stream

seeds = st.integers(0, 100_000)
shapes = st.builds(
    ForestShape,
    width_m=st.sampled_from([20.0, 35.0]),
    height_m=st.sampled_from([15.0, 25.0]),
    gap_m=st.sampled_from([0.8, 1.8]),
    max_radius_m=st.sampled_from([0.3, 1.2]),
    density=st.sampled_from([0.0, 0.5, 1.0]),
    min_distance_m=st.just(8.0),
)


@settings(max_examples=12, deadline=None)
@given(shapes, seeds)
def test_trunks_keep_the_gap_to_each_other_and_to_the_edge(shape, seed):
    trunks = draw_trunks(shape, np.random.default_rng(seed))
    middles, radii = trunks[:, :2], trunks[:, 2]
    assert ((radii >= shape.min_radius_m) & (radii <= shape.max_radius_m)).all()
    gaps = np.linalg.norm(middles[:, None] - middles, axis=2) - radii[:, None] - radii
    assert gaps[np.triu_indices(len(trunks), 1)].min(initial=np.inf) >= shape.gap_m - 1e-9
    to_edge = np.minimum(middles, np.array([shape.width_m, shape.height_m]) - middles).min(axis=1) - radii
    assert to_edge.min(initial=np.inf) >= shape.gap_m - 1e-9


@settings(max_examples=10, deadline=None)
@given(shapes, seeds)
def test_a_robot_narrower_than_the_gap_reaches_everything(shape, seed):
    plan = draw_forest(shape, np.random.default_rng(seed), plan_id="f")
    core = plan.free.buffer(-0.49 * shape.gap_m)
    assert shapely.get_num_geometries(core) == 1
    start, goal = (shapely.Point(end) for end in plan.endpoints)
    assert core.contains(start) and core.contains(goal)
    assert start.distance(goal) >= shape.min_distance_m


def test_a_full_forest_has_no_room_for_another_trunk():
    shape = ForestShape(width_m=30.0, height_m=20.0, min_distance_m=10.0)
    middles = shapely.multipoints(draw_trunks(shape, np.random.default_rng(5))[:, :2])
    low = shape.max_radius_m + shape.gap_m
    within = shapely.box(low, low, shape.width_m - low, shape.height_m - low)
    # The sampler draws until its own margin is full: hardly anything further than the spacing from all trunks is left.
    assert within.difference(middles.buffer(1.05 * shape.spacing_m)).area < 0.02 * within.area


def test_density_is_the_share_of_trunks_that_stand():
    full, half = (len(draw_trunks(ForestShape(density=density), np.random.default_rng(0))) for density in (1.0, 0.5))
    assert half == round(full / 2)
    assert len(draw_trunks(ForestShape(density=0.0), np.random.default_rng(0))) == 0


def test_the_same_stream_draws_the_same_forest_and_names_draw_others():
    first, again = (draw_forest(ForestShape(), stream(0, "plans", "a"), plan_id="a") for _ in range(2))
    other = draw_forest(ForestShape(), stream(0, "plans", "b"), plan_id="b")
    assert first == again
    assert not first.free.equals(other.free)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gap_m": 0.0}, "plans.forest.gap_m = 0.0: expected above 0 m"),
        ({"max_radius_m": 0.1}, "plans.forest.max_radius_m = 0.1: expected at least min_radius_m = 0.3 m"),
        ({"density": 1.1}, "plans.forest.density = 1.1: expected a share from 0 to 1"),
        ({"width_m": 5.0}, "plans.forest.width_m = 5.0"),
        ({"height_m": float("nan")}, "plans.forest.height_m = nan"),
        ({"min_distance_m": 100.0}, "plans.forest.min_distance_m = 100.0"),
    ],
)
def test_impossible_forests_are_refused_by_key(changes, message):
    with pytest.raises(ConfigError) as refusal:
        ForestShape(**changes)
    assert message in str(refusal.value)


def test_ends_too_far_apart_for_the_forest_end_with_a_message():
    shape = ForestShape(width_m=30.0, height_m=20.0, min_distance_m=32.4)
    with pytest.raises(PlanError, match=r"plan f .*no start and goal 32.4 m apart.*plans.forest.min_distance_m"):
        draw_forest(shape, np.random.default_rng(0), plan_id="f")
