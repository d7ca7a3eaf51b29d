"""The drives of one trial side by side: what each robot knew at its end, the way it took, and what it believed."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from pipeline.evaluation.competitors import Role
from pipeline.evaluation.trials import Entry, EpisodeRow
from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN
from pipeline.reports.style import INK, MUTED, P_SUCCESS_COLOURS, colours_of, new_figure

_PANEL_INCHES = 5.0
_MOST_PANELS = 4
_MARGIN_CELLS = 2
_SHADES = {  # what a cell looks like: the faint ones the robot never saw
    "unseen floor": (0.925, 0.937, 0.953),
    "unseen wall": (0.78, 0.81, 0.85),
    "seen floor": (1.0, 1.0, 1.0),
    "seen wall": (0.17, 0.21, 0.27),
}


class Drives(NamedTuple):
    """The recorded drives of one trial, the baseline's first, and why it was chosen.

    titles, colours: of each. ratio: cost of the first candidate over the baseline's.
    """

    label: str
    episodes: Sequence[EpisodeRow]
    titles: Sequence[str]
    colours: Sequence[str]
    ratio: float


def choose_drives(episodes: Iterable[EpisodeRow], entries: Sequence[Entry], wanted: int) -> list[Drives]:
    """Return up to ``wanted`` telling trials of those recorded: best, worst, evenly between.

    Trials count by the cost of the first candidate (else the first bound) over the baseline's; both must be recorded.
    The choice is fixed by the ratios alone, so a page shows its failures with its successes.
    """
    by_trial: dict[str, dict[str, EpisodeRow]] = {}
    for episode in episodes:
        by_trial.setdefault(episode.trial_id, {})[episode.competitor] = episode
    colours = colours_of((entry.name, entry.role) for entry in entries)
    baseline = next((entry.name for entry in entries if entry.role == Role.baseline), "")
    recorded = {name for found in by_trial.values() for name in found}
    ours = next((entry.name for entry in entries if entry.name in recorded and entry.name != baseline), None)
    found = []
    for trial, drives in by_trial.items():
        if ours is None or baseline not in drives or ours not in drives or drives[baseline].cost_m <= 0:
            continue
        shown = [entry for entry in entries if entry.name in drives and entry.role != Role.bound][:_MOST_PANELS]
        shown = shown if len(shown) > 1 else [entry for entry in entries if entry.name in drives][:2]
        ratio = drives[ours].cost_m / drives[baseline].cost_m
        found.append((ratio, trial, Drives("", [drives[entry.name] for entry in shown],
                                           [entry.title for entry in shown],
                                           [colours[entry.name] for entry in shown], ratio)))  # fmt: skip
    ranked = [drives for *_, drives in sorted(found, key=lambda entry: entry[:2])]
    wanted = min(wanted, len(ranked))
    if wanted == 0:
        return []
    places = np.unique(np.round(np.linspace(0, len(ranked) - 1, wanted)).astype(int)).tolist()
    return [ranked[place]._replace(label=_label(place, len(ranked))) for place in places]


def draw_drives(drives: Drives, marks: str) -> Figure:
    """Return the drives side by side, the baseline to the left; metres, y up, marked cells coloured by their number.

    marks: what that number is; empty where nothing is marked, and then there is no scale of colours.
    """
    window, count = _window(drives.episodes[-1]), len(drives.episodes)
    height = (window[1] - window[0]) / max(1, window[3] - window[2])
    figure = new_figure(count * _PANEL_INCHES + 0.9, float(np.clip(_PANEL_INCHES * height, 2.2, 9.0)) + 0.9)
    panels: Sequence[Axes] = np.atleast_1d(figure.subplots(1, count, sharex=True, sharey=True)).tolist()
    for axes, episode, title, colour in zip(panels, drives.episodes, drives.titles, drives.colours, strict=True):
        _draw_drive(axes, episode, window, title, colour)
    if marks:
        values = ScalarMappable(Normalize(0.0, 1.0), P_SUCCESS_COLOURS)
        bar = figure.colorbar(values, ax=list(panels), shrink=0.75, pad=0.01, aspect=30)
        bar.set_label(marks, color=INK, fontsize=9)
        bar.ax.tick_params(colors=MUTED, labelsize=8)
        bar.outline.set_visible(False)
    return figure


def shade_map(episode: EpisodeRow) -> NDArray[np.float64]:
    """Return [rows, cols, 3] RGB of the robot's final map over the faint true one; row 0 is the lowest y."""
    truth, known = episode.truth, episode.known
    image = np.empty((*truth.shape, 3))
    image[:] = _SHADES["unseen floor"]
    image[(known == UNKNOWN) & (truth == OCCUPIED)] = _SHADES["unseen wall"]
    image[known == FREE] = _SHADES["seen floor"]
    image[known == OCCUPIED] = _SHADES["seen wall"]
    return image


def last_estimates(episode: EpisodeRow) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the frontier cells [m, 2] (row, col) ever estimated and the last P_S [m] of each."""
    rows, cols = np.asarray(episode.frontier_row, np.int64), np.asarray(episode.frontier_col, np.int64)
    order = np.argsort(np.asarray(episode.frontier_step), kind="stable")[::-1]
    cells = np.stack([rows, cols], axis=1)[order]
    unique, first = np.unique(cells, axis=0, return_index=True)
    return unique, np.asarray(episode.frontier_p, np.float64)[order][first]


def _label(place: int, count: int) -> str:
    if count == 1:
        return "the recorded trial"
    named = {0: "best", count - 1: "worst"}
    middle = "median" if 2 * place in (count - 2, count - 1, count) else f"rank {place + 1} of {count}"
    return f"{named.get(place, middle)} of the recorded"


def _window(episode: EpisodeRow) -> tuple[int, int, int, int]:
    """Return (row from, row to, col from, col to) around the free floor, so that solid margins are cut away."""
    rows, cols = np.nonzero(episode.truth == FREE)
    if rows.size == 0:
        return 0, episode.truth.shape[0], 0, episode.truth.shape[1]
    low = np.maximum([rows.min() - _MARGIN_CELLS, cols.min() - _MARGIN_CELLS], 0)
    high = np.minimum([rows.max() + 1 + _MARGIN_CELLS, cols.max() + 1 + _MARGIN_CELLS], episode.truth.shape)
    return int(low[0]), int(high[0]), int(low[1]), int(high[1])


def _draw_drive(axes: Axes, episode: EpisodeRow, window: tuple[int, int, int, int], title: str, colour: str) -> None:
    rows, cols = episode.truth.shape
    left, bottom, side = episode.origin_x_m, episode.origin_y_m, episode.resolution_m
    axes.imshow(
        shade_map(episode), origin="lower", interpolation="nearest",
        extent=(left, left + cols * side, bottom, bottom + rows * side),
    )  # fmt: skip
    cells, chance = last_estimates(episode)
    if cells.size:
        x, y = _metres(episode, cells[:, 0], cells[:, 1])
        dot = max(7.0, (72.0 * _PANEL_INCHES / max(1, window[3] - window[2])) ** 2)
        axes.scatter(
            x,
            y,
            c=chance,
            cmap=P_SUCCESS_COLOURS,
            vmin=0,
            vmax=1,
            s=dot,
            marker="s",
            alpha=0.85,
            linewidths=0,
            zorder=2,
        )
    x, y = _metres(episode, np.asarray(episode.path_row), np.asarray(episode.path_col))
    axes.plot(x, y, color=colour, linewidth=2.0, zorder=3, solid_joinstyle="round")
    _mark(axes, episode, episode.start_row, episode.start_col, "o", 60)
    if episode.goal_row >= 0:
        _mark(axes, episode, episode.goal_row, episode.goal_col, "*", 170)
    axes.set(
        xlim=(left + window[2] * side, left + window[3] * side),
        ylim=(bottom + window[0] * side, bottom + window[1] * side),
    )
    axes.set_title(f"{title}: {episode.cost_m:.1f} m", fontsize=11, color=INK, loc="left")
    axes.set_xlabel("x [m]", fontsize=9, color=INK)
    axes.tick_params(colors=MUTED, labelsize=8)
    for spine in axes.spines.values():
        spine.set_visible(False)


def _mark(axes: Axes, episode: EpisodeRow, row: int, col: int, marker: str, size: float) -> None:
    x, y = _metres(episode, np.array([row]), np.array([col]))
    axes.scatter(x, y, s=size, marker=marker, color=INK, edgecolors="white", linewidths=1.2, zorder=4)


def _metres(
    episode: EpisodeRow, row: NDArray[np.integer], col: NDArray[np.integer]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return x and y [m] of cell centres."""
    return (
        episode.origin_x_m + (np.asarray(col, np.float64) + 0.5) * episode.resolution_m,
        episode.origin_y_m + (np.asarray(row, np.float64) + 0.5) * episode.resolution_m,
    )
