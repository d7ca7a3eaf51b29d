import numpy as np
import pytest

from pipeline.evaluation.trials import Entry, EpisodeRow
from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN
from pipeline.reports.trajectories import choose_drives, draw_drives, last_estimates, shade_map
from tests.reports.synthetic import made_up_episode

ENTRIES = [Entry("optimistic", "baseline", "optimistic"), Entry("learned", "candidate", "learned")]


def recorded(costs: dict[str, tuple[float, float]]) -> list[EpisodeRow]:
    """Return both drives of each trial: name -> costs of optimistic and learned [m]."""
    return [
        made_up_episode(trial_id, name, cost)
        for trial_id, pair in costs.items()
        for name, cost in zip(("optimistic", "learned"), pair, strict=True)
    ]


def test_best_median_and_worst_are_chosen() -> None:
    costs = {"a": (10.0, 9.0), "b": (10.0, 20.0), "c": (10.0, 5.0), "d": (10.0, 10.0), "e": (10.0, 8.0)}
    chosen = choose_drives(recorded(costs), ENTRIES, 3)
    assert [(drives.episodes[1].trial_id, drives.label) for drives in chosen] == [
        ("c", "best of the recorded"), ("a", "median of the recorded"), ("b", "worst of the recorded"),
    ]  # fmt: skip
    assert chosen[0].ratio == 0.5


@pytest.mark.parametrize(("wanted", "found"), [(0, 0), (1, 1), (2, 2), (9, 2)])
def test_no_more_are_chosen_than_there_are(wanted: int, found: int) -> None:
    assert len(choose_drives(recorded({"a": (2.0, 1.0), "b": (2.0, 2.0)}), ENTRIES, wanted)) == found


def test_a_drive_without_its_partner_is_left_out() -> None:
    assert choose_drives(recorded({"a": (2.0, 1.0)})[:1], ENTRIES, 3) == []


def test_the_map_tells_seen_from_unseen() -> None:
    truth = np.array([[OCCUPIED, FREE], [OCCUPIED, FREE]], dtype=np.uint8)
    known = np.array([[UNKNOWN, UNKNOWN], [OCCUPIED, FREE]], dtype=np.uint8)
    image = shade_map(made_up_episode("a", "learned", 1.0)._replace(truth=truth, known=known))
    brightness = image.mean(axis=2)
    assert len(np.unique(brightness)) == 4
    assert brightness[1, 1] == 1.0
    assert brightness[1, 0] < brightness[0, 0] < brightness[0, 1] < 1.0


def test_the_last_estimate_of_a_cell_counts() -> None:
    episode = made_up_episode("a", "learned", 1.0)._replace(
        frontier_step=[4, 2, 2], frontier_row=[5, 5, 1], frontier_col=[6, 6, 1], frontier_p=[0.9, 0.1, 0.4]
    )
    cells, chance = last_estimates(episode)
    assert cells.tolist() == [[1, 1], [5, 6]]
    assert chance.tolist() == [0.4, 0.9]


def test_lowest_y_is_at_the_bottom_and_metres_are_metres() -> None:
    (drives,) = choose_drives(recorded({"a": (2.0, 1.0)}), ENTRIES, 1)
    left, right = draw_drives(drives, "$P_S$").axes[:2]
    assert left.get_title(loc="left") == "optimistic: 2.0 m"
    assert right.get_title(loc="left") == "learned: 1.0 m"
    assert left.images[0].origin == "lower"
    assert left.images[0].get_extent() == pytest.approx([-2.0, -2.0 + 81 * 0.25, 1.0, 1.0 + 41 * 0.25])
    low, high = left.get_ylim()
    assert low < high
    x, y = left.lines[0].get_data()
    assert (x[0], y[0]) == pytest.approx((-2.0 + 4.5 * 0.25, 1.0 + 20.5 * 0.25))


def test_the_goal_is_marked_where_there_is_one() -> None:
    (drives,) = choose_drives(recorded({"a": (2.0, 1.0)}), ENTRIES, 1)
    aimless = [episode._replace(goal_row=-1, goal_col=-1) for episode in drives.episodes]
    found = [len(draw_drives(each, "").axes[0].collections) for each in (drives, drives._replace(episodes=aimless))]
    assert found[0] == found[1] + 1


def test_a_pair_without_any_estimate_is_drawn() -> None:
    (drives,) = choose_drives(recorded({"a": (2.0, 1.0)}), ENTRIES, 1)
    nothing = {
        name: np.array([], dtype=int) for name in ("frontier_step", "frontier_row", "frontier_col", "frontier_p")
    }
    without = [drives.episodes[0], drives.episodes[1]._replace(**nothing)]
    assert draw_drives(drives._replace(episodes=without), "").axes


def test_every_candidate_has_its_panel_and_bounds_only_where_nobody_else_drove() -> None:
    entries = [*ENTRIES, Entry("second", "candidate", "second seed"), Entry("truth", "bound", "true labels")]
    episodes = [
        made_up_episode("a", name, cost)
        for name, cost in (("truth", 3.0), ("second", 4.0), ("optimistic", 8.0), ("learned", 6.0))
    ]
    (drives,) = choose_drives(episodes, entries, 1)
    assert drives.titles == ["optimistic", "learned", "second seed"]
    assert drives.ratio == 0.75
    assert [axes.get_title(loc="left") for axes in draw_drives(drives, "$P_S$").axes[:3]] == [
        "optimistic: 8.0 m", "learned: 6.0 m", "second seed: 4.0 m",
    ]  # fmt: skip
    (bound,) = choose_drives([episodes[0], episodes[2]], entries, 1)
    assert (bound.titles, bound.ratio) == (["optimistic", "true labels"], 0.375)
