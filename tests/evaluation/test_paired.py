from hypothesis import given
from hypothesis import strategies as st

from pipeline.evaluation.paired import pair_costs, restrict
from pipeline.evaluation.trials import ENDINGS, trials_table
from tests.evaluation.rows import table_of, trial


def test_pairs_are_matched_by_trial_not_by_order() -> None:
    table = trials_table(
        [trial("b/0", "optimistic", 8.0), trial("a/0", "learned", 3.0), trial("b/0", "learned", 5.0),
         trial("a/0", "optimistic", 4.0)]
    )  # fmt: skip
    paired = pair_costs(table, "learned")
    assert paired.trial_ids == ("a/0", "b/0")
    assert (paired.baseline_m.tolist(), paired.ours_m.tolist(), paired.excluded) == ([4.0, 8.0], [3.0, 5.0], {})


def test_what_gives_no_ratio_is_counted_with_its_reason() -> None:
    rows = [
        trial("a/0", "optimistic", 4.0), trial("a/0", "learned", 9.0, ending="cut_off"),
        trial("b/0", "optimistic", 4.0, ending="unreachable"), trial("b/0", "learned", 4.0, ending="unreachable"),
        trial("c/0", "optimistic", 4.0),
        trial("d/0", "learned", 4.0),
        trial("e/0", "optimistic", 0.0), trial("e/0", "learned", 0.0),
        trial("f/0", "optimistic", 6.0), trial("f/0", "learned", 3.0),
    ]  # fmt: skip
    paired = pair_costs(trials_table(rows), "learned")
    assert paired.trial_ids == ("f/0",)
    assert paired.excluded == {
        "learned did not drive this trial": 1,
        "learned ended cut_off": 1,
        "optimistic did not drive this trial": 1,
        "optimistic ended unreachable": 1,
        "optimistic travelled 0 m": 1,
    }


def test_one_building_at_a_time() -> None:
    paired = pair_costs(table_of({"optimistic": [4.0, 8.0, 2.0], "learned": [3.0, 5.0, 2.0]}), "learned")
    part = restrict(paired, "plan1")
    assert (part.trial_ids, part.baseline_m.tolist(), part.ours_m.tolist()) == (("plan1/0",), [8.0], [5.0])


@given(st.lists(st.tuples(st.booleans(), st.booleans(), st.sampled_from(sorted(ENDINGS)),
                          st.sampled_from(sorted(ENDINGS))), max_size=30))  # fmt: skip
def test_no_trial_is_dropped_silently(cases: list[tuple[bool, bool, str, str]]) -> None:
    rows = []
    for index, (has_baseline, has_ours, baseline_ending, our_ending) in enumerate(cases):
        rows += [trial(f"{index}/0", "optimistic", 2.0, ending=baseline_ending)] * has_baseline
        rows += [trial(f"{index}/0", "learned", 1.0, ending=our_ending)] * has_ours
    paired = pair_costs(trials_table(rows), "learned")
    assert len(paired.trial_ids) + sum(paired.excluded.values()) == sum(a or b for a, b, *_ in cases)
