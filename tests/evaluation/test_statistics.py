import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pipeline.evaluation.statistics import bootstrap, bootstrap_buildings, cost_ratios, trial_ratios
from tests.evaluation.test_trimmed_line import slow_slope

COSTS = hnp.arrays(np.float64, st.integers(1, 60), elements=st.floats(0.5, 500.0))


def test_ratios_computed_by_hand() -> None:
    found = cost_ratios(np.array([10.0, 20.0, 30.0, 40.0]), np.array([5.0, 20.0, 31.5, 48.0]))
    # ratios 0.5, 1, 1.05, 1.2; sums 104.5 over 100
    assert found.total == pytest.approx(1.045)
    assert found.median == pytest.approx(1.025)
    assert found.mean == pytest.approx(0.9375)
    assert (found.won, found.tied, found.lost, found.clearly_lost) == (0.25, 0.25, 0.5, 0.25)


def test_rounding_is_a_tie_and_a_micrometre_is_not() -> None:
    baseline = np.full(3, 30.0)
    found = cost_ratios(baseline, np.array([30.0 * (1 + 1e-12), 30.0 - 1e-6, 30.0 + 1e-6]))
    assert (found.won, found.tied, found.lost) == pytest.approx((1 / 3, 1 / 3, 1 / 3))


@given(COSTS)
@settings(max_examples=30, deadline=None)
def test_identical_planners_give_one_and_no_spread(costs: np.ndarray) -> None:
    found = cost_ratios(costs, costs)
    assert (found.total, found.median, found.mean, found.tied) == (1.0, 1.0, 1.0, 1.0)
    spread = bootstrap(costs, costs, slope=1.0, rng=np.random.default_rng(0), resamples=200)
    assert all(interval == pytest.approx((1.0, 1.0), abs=1e-12) for interval in spread)


@given(COSTS, st.integers(-8, 8), st.integers(0, 1000))
@settings(deadline=None)
def test_scaling_both_costs_leaves_every_ratio(baseline: np.ndarray, power: int, seed: int) -> None:
    ours = baseline * np.random.default_rng(seed).uniform(0.3, 1.5, baseline.size)
    assert cost_ratios(baseline * 2.0**power, ours * 2.0**power) == cost_ratios(baseline, ours)


@given(COSTS, st.integers(0, 1000))
@settings(deadline=None)
def test_shares_add_up_and_the_total_lies_between_the_extremes(baseline: np.ndarray, seed: int) -> None:
    ours = baseline * np.random.default_rng(seed).uniform(0.3, 1.5, baseline.size)
    found, ratios = cost_ratios(baseline, ours), trial_ratios(baseline, ours)
    assert found.won + found.tied + found.lost == pytest.approx(1.0)
    assert found.clearly_lost <= found.lost
    assert ratios.min() * (1 - 1e-12) <= found.total <= ratios.max() * (1 + 1e-12)


def test_the_interval_covers_about_as_often_as_it_says() -> None:
    rng = np.random.default_rng(11)
    covered = 0
    for _ in range(200):
        baseline = rng.uniform(10.0, 20.0, 60)
        ours = baseline * rng.normal(0.8, 0.2, 60)
        low, high = bootstrap(baseline, ours, slope=0.8, rng=rng, resamples=400).total
        covered += low <= 0.8 <= high
    assert 0.88 <= covered / 200 <= 0.99


def test_bootstrap_is_seeded_and_does_not_depend_on_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    baseline = rng.uniform(10.0, 20.0, 40)
    ours = baseline * rng.uniform(0.5, 1.2, 40)
    first = bootstrap(baseline, ours, slope=0.8, rng=np.random.default_rng(4), resamples=500)
    monkeypatch.setattr("pipeline.evaluation.statistics._BLOCK_CELLS", 40 * 64)
    assert bootstrap(baseline, ours, slope=0.8, rng=np.random.default_rng(4), resamples=500) == first


# Building a holds two trials, building b one long one.
BASELINE, OURS, BUILDINGS = np.array([10.0, 20.0, 10.0]), np.array([1.0, 30.0, 3.0]), ("a", "b", "a")


def test_two_buildings_drawn_whole_by_hand() -> None:
    """Drawn are a, a (4 of 20: 0.2), both (34 of 40) or b, b (1.5), never 0.1 or 0.3, the ratios within a."""
    found = bootstrap_buildings(BASELINE, OURS, BUILDINGS, slope=1.0, rng=np.random.default_rng(0), resamples=2000)
    assert found is not None
    assert found.total == pytest.approx((0.2, 1.5))
    assert found.median == pytest.approx((0.2, 1.5))
    assert found.mean == pytest.approx((0.2, 1.5))
    trials = bootstrap(BASELINE, OURS, slope=1.0, rng=np.random.default_rng(0), resamples=2000)
    assert trials.median == pytest.approx((0.1, 1.5)), "trial by trial a resample can hold the best of a alone"


def test_one_building_gives_no_interval() -> None:
    assert bootstrap_buildings(BASELINE, OURS, ("a",) * 3, slope=1.0, rng=np.random.default_rng(0)) is None


def test_whole_buildings_equal_their_slow_twin(monkeypatch: pytest.MonkeyPatch) -> None:
    """The twin lays out every resample trial by trial; buildings hold 1 to 9 trials, in mixed order."""
    monkeypatch.setattr("pipeline.evaluation.statistics._BLOCK_CELLS", 45 * 64)
    rng = np.random.default_rng(7)
    buildings = rng.permutation([f"building-{size}" for size in range(1, 10) for _ in range(size)])
    baseline = rng.uniform(5.0, 50.0, buildings.size)
    ours = (
        baseline * rng.uniform(0.3, 1.4, buildings.size) * np.array([0.5 + 0.1 * int(name[-1]) for name in buildings])
    )
    found = bootstrap_buildings(
        baseline, ours, buildings.tolist(), slope=0.8, rng=np.random.default_rng(3), resamples=300
    )
    draws = np.random.default_rng(3)
    chosen = np.concatenate([draws.integers(9, size=(rows, 9)) for rows in (64, 64, 64, 64, 44)])
    names = sorted(set(buildings.tolist()))
    twin = []
    for row in chosen:
        index = np.concatenate([np.flatnonzero(buildings == names[building]) for building in row])
        x, y = baseline[index], ours[index]
        twin.append((y.sum() / x.sum(), slow_slope(x, y, 0.8), np.median(y / x), (y / x).mean()))
    low, high = np.percentile(np.array(twin), [2.5, 97.5], axis=0)
    np.testing.assert_allclose(np.array(found), np.stack([low, high], axis=1), rtol=1e-6)


def test_trials_alike_within_buildings_widen_the_interval_over_buildings() -> None:
    """Ten buildings of 30 equal trials hold ten facts, not 300: the interval is about sqrt(30) times as wide."""
    ratio = np.repeat(np.linspace(0.5, 1.2, 10), 30)
    buildings = [f"{index // 30}" for index in range(300)]
    rng = np.random.default_rng(5)
    low, high = bootstrap(np.full(300, 10.0), 10.0 * ratio, slope=0.8, rng=rng, resamples=1000).total
    wide = bootstrap_buildings(np.full(300, 10.0), 10.0 * ratio, buildings, slope=0.8, rng=rng, resamples=1000)
    assert wide is not None
    assert 4.0 < (wide.total.high - wide.total.low) / (high - low) < 7.0


@pytest.mark.parametrize(("baseline", "ours"), [([], []), ([0.0], [1.0]), ([1.0, 2.0], [1.0])])
def test_no_ratio_without_a_baseline(baseline: list[float], ours: list[float]) -> None:
    with pytest.raises(ValueError, match="at least one pair"):
        cost_ratios(np.array(baseline), np.array(ours))
