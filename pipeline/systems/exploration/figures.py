"""What the report shows of explorations beside costs and drives: how fast the maps grew."""

from collections.abc import Iterator

import numpy as np

from pipeline.evaluation.cost_table import number_text
from pipeline.evaluation.trials import competitors_in
from pipeline.reports import markup
from pipeline.reports.figures import Drawn, Section, SystemFigures
from pipeline.reports.inputs import ReportInputs
from pipeline.reports.style import colours_of, dress, new_figure
from pipeline.reports.trajectories import choose_drives, shade_map
from pipeline.systems.exploration.curves import Curve, Reals, curves_in
from pipeline.systems.exploration.growth import GROWTH

NAME = "growth"
_POINTS = 200


def draw(inputs: ReportInputs) -> Iterator[Drawn]:
    """Yield the curves of all competitors, and one drive coloured by what had been seen."""
    curves = list(curves_in(GROWTH.read(inputs.folder / "evaluate" / "growth.parquet")))
    yield _curves(inputs, curves)
    yield from _replay(inputs, curves)


def sections(inputs: ReportInputs) -> list[Section]:
    """Return the section on how the maps grew."""
    rows = []
    for found in inputs.summary["competitors"].values():
        measures = found["measures"]
        to = measures["distance_to"]
        rows.append((found["title"], *(number_text(to[name], 1) for name in _TO), number_text(
            measures["area_under_curve"])))  # fmt: skip
    shares = [(each["title"], *(f"{100 * share:.1f} %" for share in each["measures"]["share_at"].values()))
              for each in inputs.summary["competitors"].values()]  # fmt: skip
    marks = next(iter(inputs.summary["competitors"].values()))["measures"]["share_at"]
    heads = ("competitor", *(mark.replace("_m", " m") for mark in marks))
    parts = [markup.table(_HEAD, rows), markup.paragraph(_WORDS, "muted"), markup.table(heads, shares)]
    return [Section(NAME, "How the maps grew", parts)]


def band(curves: list[Curve], buildings: dict[str, str], distances: Reals) -> tuple[Reals, Reals, Reals]:
    """Return mean, 10th and 90th percentile over buildings of the mean share seen at ``distances`` [m]."""
    shares: dict[str, list[Reals]] = {}
    for curve in curves:
        shares.setdefault(buildings[curve.trial_id], []).append(curve.at(distances))
    means = np.array([np.mean(found, axis=0) for _, found in sorted(shares.items())])
    low, high = np.percentile(means, [10, 90], axis=0)
    return means.mean(axis=0), low, high


def _curves(inputs: ReportInputs, curves: list[Curve]) -> Drawn:
    entries = competitors_in(inputs.trials)
    colours = colours_of((entry.name, entry.role) for entry in entries)
    trials = inputs.trials
    buildings = dict(zip(trials.column("trial_id").to_pylist(), trials.column("building").to_pylist(), strict=True))
    distances = np.linspace(0.0, float(np.median([curve.travelled_m[-1] for curve in curves])), _POINTS)
    figure = new_figure(7.6, 5.0)
    axes = figure.add_subplot()
    for entry in entries:
        mean, low, high = band([curve for curve in curves if curve.competitor == entry.name], buildings, distances)
        style = ":" if entry.role == "bound" else "-"
        axes.plot(distances, 100 * mean, style, color=colours[entry.name], label=entry.title, linewidth=1.8)
        axes.fill_between(distances, 100 * low, 100 * high, color=colours[entry.name], alpha=0.1, linewidth=0)
    dress(axes, x="distance travelled [m]", y="area seen [% of what is in reach]")
    axes.set_ylim(0, 101)
    axes.legend(frameon=False, fontsize=9)
    return Drawn(NAME, "growth", "Area seen over distance travelled", _CURVES, figure)


def _replay(inputs: ReportInputs, curves: list[Curve]) -> Iterator[Drawn]:
    drives = choose_drives(inputs.episodes, competitors_in(inputs.trials), 3)
    if not drives:
        return
    shown = drives[len(drives) // 2]
    count = len(shown.episodes)
    figure = new_figure(4.4 * count, 4.2)
    panels = np.atleast_1d(figure.subplots(1, count, sharex=True, sharey=True)).tolist()
    drawn = []
    for axes, episode, title in zip(panels, shown.episodes, shown.titles, strict=True):
        curve = next(
            each for each in curves if (each.trial_id, each.competitor) == (episode.trial_id, episode.competitor)
        )
        row, col = (np.asarray(each, dtype=np.float64) for each in (episode.path_row, episode.path_col))
        way = np.concatenate([[0.0], np.hypot(np.diff(row), np.diff(col)).cumsum()]) * episode.resolution_m
        side, left, bottom = episode.resolution_m, episode.origin_x_m, episode.origin_y_m
        rows, cols = episode.truth.shape
        axes.imshow(shade_map(episode), origin="lower", interpolation="nearest",
                    extent=(left, left + cols * side, bottom, bottom + rows * side))  # fmt: skip
        points = axes.scatter(left + (col + 0.5) * side, bottom + (row + 0.5) * side, c=100 * curve.at(way),
                              cmap="viridis", vmin=0, vmax=100, s=3, linewidths=0)  # fmt: skip
        drawn.append(points)
        dress(axes, x="x [m]", y="y [m]" if axes is panels[0] else "", title=title, grid=False)
    bar = figure.colorbar(drawn[-1], ax=panels, shrink=0.75, pad=0.01, aspect=30)
    bar.set_label("area seen by then [%]", fontsize=9)
    yield Drawn(NAME, "replay", f"Trial {shown.episodes[0].trial_id}: when what was seen", _REPLAY, figure)


_TO = ("share_50", "share_80", "share_95", "all")
_HEAD = ("competitor", "50 % seen [m]", "80 % seen [m]", "95 % seen [m]", "all seen [m]", "area under the curve")
_WORDS = (
    "Mean distance travelled until so much of the area in reach had been seen. Area under the curve: mean share seen "
    "over the distance that the baseline took to its end on the same trial. Beneath: mean share after a distance."
)
_CURVES = (
    "Lines: mean over buildings of the share of the area in reach that had been seen. Bands: from the 10th to the 90th "
    "percentile of buildings. Dotted: a bound, which knows what no robot knows."
)
_REPLAY = (
    "The ways of all who explored, coloured by the share of the area that had been seen when the robot passed: long "
    "yellow ways fetch leftovers."
)

FIGURES = SystemFigures(
    marks="share seen when it was chosen",
    caption="Squares: each place it chose to look from, coloured by the share seen by then, red first, green last.",
    draw=draw,
    sections=sections,
)
