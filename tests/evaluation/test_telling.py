import pytest

from pipeline.evaluation.telling import telling_trials
from pipeline.evaluation.trials import trials_table
from tests.evaluation.rows import table_of, trial

# Ratios 0.5, 2, 1, 0.9, 1.1, 0.2, 3, 1.2, 0.8 of plans 0 to 8: from worst to best 6, 1, 7, 4, 2, 3, 8, 0, 5.
COSTS = {"optimistic": [10.0] * 9, "learned": [5.0, 20.0, 10.0, 9.0, 11.0, 2.0, 30.0, 12.0, 8.0]}


@pytest.mark.parametrize(
    ("count", "plans"),
    [(0, []), (1, [6]), (2, [5, 6]), (3, [2, 5, 6]), (4, [1, 2, 5, 6]), (6, [0, 1, 2, 4, 5, 6]), (20, list(range(9)))],
)
def test_the_worst_the_best_and_the_middle(count: int, plans: list[int]) -> None:
    assert telling_trials(table_of(COSTS), count) == [f"plan{index}/0" for index in plans]


def test_a_trial_that_was_not_finished_is_the_worst() -> None:
    rows = [trial(f"plan{index}/0", "optimistic", 10.0) for index in range(5)]
    rows += [trial(f"plan{index}/0", "learned", 5.0 + index) for index in range(4)]
    rows.append(trial("plan4/0", "learned", 1.0, ending="cut_off"))
    assert telling_trials(trials_table(rows), 1) == ["plan4/0"]


def test_equals_are_chosen_by_their_names() -> None:
    same = {"optimistic": [10.0] * 5, "learned": [10.0] * 5}
    assert telling_trials(table_of(same), 3) == ["plan0/0", "plan2/0", "plan4/0"]


def test_without_a_learned_planner_another_is_judged() -> None:
    costs = {"optimistic": [10.0] * 3, "perfect": [9.0, 7.0, 12.0], "known_map": [7.0, 8.0, 6.0]}
    assert telling_trials(table_of(costs), 1) == ["plan2/0"]
    assert telling_trials(trials_table([]), 4) == []
