import numpy as np
import pytest

from pipeline.systems.subgoals.weighing import pairwise_sum, weigh

LEADS = np.array([True, False, False, False])
COST = np.array([8.0, 1.0, 2.0, 5.0], dtype=np.float32)


def weights(leads: np.ndarray, cost_m: np.ndarray, *, by_cost: bool, by_class: bool) -> np.ndarray:
    found = cost_m.copy()
    weigh(leads.astype(np.float32), found, by_cost=by_cost, by_class=by_class)
    return found


def weights_in_memory(leads: np.ndarray, cost_m: np.ndarray, *, by_cost: bool, by_class: bool) -> np.ndarray:
    """The same over whole arrays at once."""
    weight = np.maximum(cost_m.astype(np.float64), 0.0) if by_cost else np.ones(len(leads))
    totals = {lead: weight[leads == lead].sum() for lead in (True, False)}
    if by_class and min(totals.values()) > 0.0:
        weight = np.where(leads, weight / totals[True], weight / totals[False])
    return (weight / weight.mean()).astype(np.float32)


@pytest.mark.parametrize("by_cost", [True, False])
def test_classes_weigh_the_same_in_total_and_one_on_average(by_cost: bool) -> None:
    weight = weights(LEADS, COST, by_cost=by_cost, by_class=True)
    assert weight[LEADS].sum() == pytest.approx(weight[~LEADS].sum())
    assert weight.mean() == pytest.approx(1.0)


def test_within_a_class_costs_keep_their_proportions() -> None:
    weight = weights(LEADS, COST, by_cost=True, by_class=True)
    assert weight[1:] / weight[1] == pytest.approx([1.0, 2.0, 5.0])


def test_weighing_can_be_switched_off() -> None:
    assert weights(LEADS, COST, by_cost=False, by_class=False).tolist() == [1.0] * 4
    assert weights(LEADS, COST, by_cost=True, by_class=False) == pytest.approx(COST / 4.0)


@pytest.mark.parametrize("leads", [np.ones(4, bool), np.zeros(4, bool)])
def test_one_class_alone_is_weighed_by_cost_only(leads: np.ndarray) -> None:
    assert weights(leads, COST, by_cost=True, by_class=True) == pytest.approx(COST / 4.0)


def test_rows_without_any_cost_still_count() -> None:
    assert weights(LEADS, np.zeros(4, np.float32), by_cost=True, by_class=True).tolist() == [1.0] * 4


@pytest.mark.parametrize("by_cost", [True, False])
@pytest.mark.parametrize("by_class", [True, False])
def test_blocks_give_the_bits_of_whole_arrays(by_cost: bool, by_class: bool) -> None:
    rng = np.random.default_rng(0)
    leads = rng.random(150_011) < 0.3
    cost = rng.uniform(1.0, 80.0, 150_011).astype(np.float32)  # [m], as harvested: a floor of 1 m
    rows = np.stack([leads, cost], axis=1).astype(np.float32)
    weigh(rows[:, 0], rows[:, 1], by_cost=by_cost, by_class=by_class)  # columns of a table, as in training
    assert np.array_equal(rows[:, 1], weights_in_memory(leads, cost, by_cost=by_cost, by_class=by_class))
    assert np.array_equal(rows[:, 0], leads)


@pytest.mark.parametrize("count", [0, 1, 8192, 8193, 70_000, 123_457])
def test_a_pairwise_sum_is_numpys_to_the_bit(count: int) -> None:
    values = np.random.default_rng(count).random(count) * 1e-5
    assert pairwise_sum(lambda block: values[block], 0, count) == values.sum()
