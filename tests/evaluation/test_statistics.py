import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pipeline.evaluation.statistics import bootstrap, cost_ratios, trial_ratios

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


@pytest.mark.parametrize(("baseline", "ours"), [([], []), ([0.0], [1.0]), ([1.0, 2.0], [1.0])])
def test_no_ratio_without_a_baseline(baseline: list[float], ours: list[float]) -> None:
    with pytest.raises(ValueError, match="at least one pair"):
        cost_ratios(np.array(baseline), np.array(ours))
