"""Roles decide who is compared with whom, and in which order."""

import pytest

from pipeline.errors import ConfigError
from pipeline.evaluation.competitors import CompetitorConfig, Role, baseline_of, make_roster


def entry(role: Role, use: str = "x") -> CompetitorConfig:
    return CompetitorConfig(use=use, role=role)


def test_the_roster_is_ordered_by_role_then_as_written() -> None:
    roster = make_roster(
        {
            "truth": entry(Role.bound),
            "zeta": entry(Role.candidate),
            "plain": entry(Role.baseline),
            "alpha_2": entry(Role.candidate),
        }
    )
    assert [each.name for each in roster] == ["plain", "zeta", "alpha_2", "truth"]
    assert [each.place for each in roster] == [0, 1, 2, 3]
    assert baseline_of(roster).name == "plain"
    assert roster[2].title == "alpha 2"
    assert roster[2].key == "evaluate.competitors.alpha_2"


@pytest.mark.parametrize(
    ("entries", "expected"),
    [
        ({}, "has none in the role baseline"),
        ({"a": entry(Role.candidate)}, "has none in the role baseline"),
        ({"a": entry(Role.baseline), "b": entry(Role.baseline)}, r"has 2 \(a, b\) in the role baseline"),
        ({"a": entry(Role.baseline), "b/c": entry(Role.bound)}, "evaluate.competitors.b/c: expected a name of letters"),
    ],
)
def test_a_roster_without_one_baseline_is_refused(entries: dict[str, CompetitorConfig], expected: str) -> None:
    with pytest.raises(ConfigError, match=expected):
        make_roster(entries)
