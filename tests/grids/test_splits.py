import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.errors import ConfigError
from pipeline.grids.splits import SPLITS, split_buildings

SHARES = {"train": 0.6, "validation": 0.1, "test": 0.3}
buildings = st.dictionaries(st.text("ABCDE123", min_size=1, max_size=4), st.integers(1, 9), min_size=3, max_size=40)


@given(buildings, st.integers(0, 1000))
def test_every_building_gets_one_split_and_every_split_a_building(floors, seed):
    place = split_buildings(floors, SHARES, seed)
    assert set(place) == set(floors)
    assert set(place.values()) == set(SPLITS)


@given(buildings, st.integers(0, 1000))
def test_the_order_in_which_buildings_are_read_does_not_matter(floors, seed):
    assert split_buildings(floors, SHARES, seed) == split_buildings(dict(reversed(floors.items())), SHARES, seed)


@given(st.integers(0, 200))
def test_many_buildings_come_close_to_the_shares(seed):
    floors = {f"b{k}": 1 + k % 4 for k in range(100)}
    place = split_buildings(floors, SHARES, seed)
    for split, share in SHARES.items():
        found = sum(floors[name] for name, where in place.items() if where == split) / sum(floors.values())
        assert found == pytest.approx(share, abs=0.03)


def test_another_seed_gives_another_split():
    floors = {f"b{k}": 1 for k in range(20)}
    assert len({tuple(sorted(split_buildings(floors, SHARES, seed).items())) for seed in range(5)}) == 5


def test_a_split_without_a_share_stays_empty():
    place = split_buildings({"a": 1, "b": 1}, {"train": 0.0, "validation": 0.0, "test": 1.0}, 0)
    assert set(place.values()) == {"test"}


@pytest.mark.parametrize(
    ("floors", "shares", "message"),
    [
        ({"a": 3, "b": 1}, SHARES, r"ask for 3 splits .* only 2 buildings \(a, b\)"),
        ({"a": 1}, dict.fromkeys(SPLITS, 0.0), "expected shares of at least 0"),
        ({"a": 1}, {"train": -1.0, "test": 2.0}, "expected shares of at least 0"),
        ({"a": 1}, {"train": float("nan")}, "expected shares of at least 0"),
    ],
)
def test_unusable_shares_are_refused(floors, shares, message):
    with pytest.raises(ConfigError, match=message):
        split_buildings(floors, shares, 0)
