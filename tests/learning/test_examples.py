import itertools

import numpy as np
import pytest
import torch

from models.subgoals import SubgoalNet
from pipeline.datums import stack
from pipeline.learning.examples import Batches, fit_scaling, label_examples, weigh
from tests.datums.rows import make_datums
from tests.learning.synthetic import make_examples

LEADS = np.array([True, False, False, False])
COST = np.array([8.0, 1.0, 2.0, 5.0], dtype=np.float32)


@pytest.mark.parametrize("by_cost", [True, False])
def test_classes_weigh_the_same_in_total_and_one_on_average(by_cost: bool) -> None:
    weight = weigh(LEADS, COST, by_cost=by_cost, by_class=True)
    assert weight[LEADS].sum() == pytest.approx(weight[~LEADS].sum())
    assert weight.mean() == pytest.approx(1.0)


def test_within_a_class_costs_keep_their_proportions() -> None:
    weight = weigh(LEADS, COST, by_cost=True, by_class=True)
    assert weight[1:] / weight[1] == pytest.approx([1.0, 2.0, 5.0])


def test_weighing_can_be_switched_off() -> None:
    assert weigh(LEADS, COST, by_cost=False, by_class=False).tolist() == [1.0] * 4
    assert weigh(LEADS, COST, by_cost=True, by_class=False) == pytest.approx(COST / 4.0)


@pytest.mark.parametrize("leads", [np.ones(4, bool), np.zeros(4, bool)])
def test_one_class_alone_is_weighed_by_cost_only(leads: np.ndarray) -> None:
    assert weigh(leads, COST, by_cost=True, by_class=True) == pytest.approx(COST / 4.0)


def test_rows_without_any_cost_still_count() -> None:
    assert weigh(LEADS, np.zeros(4, np.float32), by_cost=True, by_class=True).tolist() == [1.0] * 4


def test_labels_that_do_not_apply_become_numbers() -> None:
    examples = label_examples(stack(make_datums(9)), np.zeros((9, 3), np.float32))
    assert torch.isfinite(examples.targets_m).all()
    assert (examples.targets_m[examples.leads > 0.5, 1] == 0).all()
    assert (examples.targets_m[examples.leads < 0.5, 0] == 0).all()


def test_the_scaling_uses_each_target_only_where_it_applies() -> None:
    examples = make_examples(500, seed=0)
    examples.inputs[:, 7] = 3.0  # never varies
    net = SubgoalNet(inputs=12, hidden=(4,))
    fit_scaling(net, examples)
    leads = examples.leads > 0.5
    assert net.target_mean[0] == pytest.approx(float(examples.targets_m[leads, 0].mean()), rel=1e-5)
    scaled = net.scale(examples.targets_m)
    assert float(scaled[leads, 0].std(correction=0)) == pytest.approx(1.0, rel=1e-4)
    assert float(scaled[~leads, 1].mean()) == pytest.approx(0.0, abs=1e-4)
    assert net.input_std[7] == 1.0


def _batches(first: int, steps: int = 40, seed: int = 1) -> Batches:
    return Batches(examples=make_examples(50, seed=0), batch_size=16, seed=seed, steps=steps, step=lambda: first)


def test_a_batch_depends_on_its_step_alone() -> None:
    whole = list(_batches(0))
    assert len(whole) == 40
    for first in (1, 2, 3, 17, 39):
        for ours, theirs in zip(_batches(first), whole[first:], strict=True):
            assert torch.equal(ours.inputs_BI, theirs.inputs_BI)


def test_no_row_comes_twice_in_one_pass() -> None:
    one_pass = torch.cat([batch.inputs_BI for batch in itertools.islice(_batches(0), 3)])
    assert len(torch.unique(one_pass, dim=0)) == 48


def test_passes_and_seeds_differ() -> None:
    whole = list(_batches(0))
    assert not torch.equal(whole[0].inputs_BI, whole[3].inputs_BI)
    assert not torch.equal(whole[0].inputs_BI, next(iter(_batches(0, seed=2))).inputs_BI)


def test_fewer_rows_than_a_batch_make_one_batch_of_all() -> None:
    batches = Batches(examples=make_examples(5, seed=0), batch_size=16, seed=1, steps=2, step=lambda: 0)
    assert [len(batch.leads_B) for batch in batches] == [5, 5]


def test_the_fingerprint_sees_every_value() -> None:
    before, after = make_examples(5, seed=0), make_examples(5, seed=0)
    assert before.fingerprint() == after.fingerprint()
    after.weight[3] += 1e-3
    assert before.fingerprint() != after.fingerprint()
