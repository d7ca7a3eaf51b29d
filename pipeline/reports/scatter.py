"""The scatter of the field: cost of a competitor over the baseline's, with the trimmed and the RANSAC line."""

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pipeline.evaluation.cost_table import line_text
from pipeline.evaluation.paired import PairedCosts
from pipeline.evaluation.trimmed_line import OriginLine
from pipeline.reports.style import INK, MUTED, ORANGE, SKY, dress, new_figure


class Named(NamedTuple):
    """How a competitor appears in a figure."""

    title: str
    colour: str


def draw_cost_scatter(
    paired: PairedCosts,
    line: OriginLine,
    ours: Named,
    baseline: str,
    *,
    with_intercept: tuple[float, float] | None = None,
    small: bool = False,
) -> Figure:
    """Return the scatter of [n] paired costs [m]: inliers filled, outliers hollow, below the diagonal shaded.

    with_intercept: slope and intercept [m] of the RANSAC line, drawn dotted.
    A point below the diagonal is a trial that cost less than the baseline's, whose title is ``baseline``.
    """
    figure = new_figure(4.6, 4.6) if small else new_figure(6.4, 6.4)
    axes = figure.add_subplot()
    reach = 1.05 * float(max(paired.baseline_m.max(), paired.ours_m.max()))
    _draw_background(axes, reach, baseline)
    colour = ours.colour
    size, inliers = (16 if small else 24) / (1.0 + paired.baseline_m.size / 1500), line.inliers
    count, total = int(inliers.sum()), inliers.size
    axes.scatter(
        paired.baseline_m[inliers], paired.ours_m[inliers], s=size, color=colour, alpha=0.65, linewidths=0,
        label=f"inliers ({count} of {total})",
    )  # fmt: skip
    axes.scatter(
        paired.baseline_m[~inliers], paired.ours_m[~inliers], s=size * 1.2, facecolors="none", edgecolors=colour,
        linewidths=1.0, label=f"outliers ({total - count})",
    )  # fmt: skip
    end = min(reach, reach / line.slope) if line.slope > 0 else reach
    axes.plot([0, end], [0, line.slope * end], color=INK, linewidth=1.8, label=f"trimmed slope {line.slope:.3f}")
    if with_intercept is not None:
        slope, intercept = with_intercept
        label = f"RANSAC {line_text(slope, intercept)}"
        axes.plot(
            [0, reach], [intercept, slope * reach + intercept], color=INK, linewidth=1.2, linestyle=":", label=label
        )
    ratio = paired.ours_m.sum() / paired.baseline_m.sum()
    axes.plot([], [], " ", label=f"total ratio {ratio:.3f}")
    axes.set(xlim=(0, reach), ylim=(0, reach), aspect="equal")
    dress(axes, x=f"cost of {baseline} [m]", y=f"cost of {ours.title} [m]")
    axes.legend(loc="upper left", fontsize=8 if small else 9, frameon=True, framealpha=0.9, edgecolor="none")
    return figure


def draw_ratio_histogram(ratios: dict[Named, np.ndarray], baseline: str) -> Figure:
    """Return the histogram of per-trial ratios ([n] per competitor, positive) on a logarithmic axis.

    On it a trial of half the cost and one of twice the cost lie equally far from the line at 1.
    """
    figure = new_figure(6.4, 3.8)
    axes = figure.add_subplot()
    logs = {name: np.log2(values) for name, values in ratios.items()}
    reach = max(0.5, 1.05 * max(float(np.abs(values).max()) for values in logs.values()))
    edges = np.linspace(-reach, reach, 42)
    for index, (name, values) in enumerate(logs.items()):
        style = {"alpha": 0.75} if index == 0 else {"histtype": "step", "linewidth": 1.6}
        middle = 2 ** float(np.median(values))
        axes.hist(values, bins=edges.tolist(), color=name.colour, label=f"{name.title}, median {middle:.3f}", **style)
    axes.axvline(0.0, color=ORANGE, linewidth=1.4, linestyle="--", label=f"as much as {baseline}")
    _label_ratios(axes, reach)
    dress(axes, x=f"cost / cost of {baseline}, per trial (logarithmic)", y="trials")
    axes.legend(fontsize=9, frameon=True, framealpha=0.9, edgecolor="none")
    return figure


def _draw_background(axes: Axes, reach: float, baseline: str) -> None:
    axes.fill_between([0, reach], [0, 0], [0, reach], color=SKY, alpha=0.14, linewidth=0, label=f"less than {baseline}")
    axes.plot([0, reach], [0, reach], color=MUTED, linewidth=1.0, linestyle="--")


def _label_ratios(axes: Axes, reach: float) -> None:
    """Put round ratios instead of logarithms under the axis."""
    round_ratios = [0.125, 0.25, 0.35, 0.5, 0.7, 0.85, 1.0, 1.2, 1.4, 2.0, 2.8, 4.0, 8.0]
    gap = reach / 7.0
    ticks: list[float] = []
    for ratio in sorted(round_ratios, key=lambda value: abs(np.log2(value))):
        place = float(np.log2(ratio))
        if abs(place) <= reach and all(abs(place - other) >= gap for other in ticks):
            ticks.append(place)
    axes.set_xticks(sorted(ticks), [f"{2**tick:.3g}" for tick in sorted(ticks)])
    axes.set_xlim(-reach, reach)
