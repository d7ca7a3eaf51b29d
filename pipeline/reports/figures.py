"""All figures of a report: drawn, saved under their names, and captioned with what each number means."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from pipeline.evaluation.cost_table import title_of
from pipeline.evaluation.paired import pair_costs
from pipeline.evaluation.statistics import trial_ratios
from pipeline.evaluation.summary import fit_planner
from pipeline.evaluation.trials import BASELINE, LEARNED
from pipeline.reports.calibration import draw_reliability
from pipeline.reports.inputs import ReportInputs
from pipeline.reports.scatter import draw_cost_scatter, draw_ratio_histogram
from pipeline.reports.style import save_figure
from pipeline.reports.training import draw_training
from pipeline.reports.trajectories import EpisodePair, choose_episodes, draw_episode_pair

PERFECT = "perfect"


class ReportFigure(NamedTuple):
    """A saved figure.

    part: the section of the page it belongs to. width: how it is shown. title, caption: plain text.
    """

    part: str
    width: str
    title: str
    caption: str
    path: Path


def draw_figures(
    inputs: ReportInputs, summary: dict[str, Any], folder: Path, *, seed: int, episodes: int, dpi: int
) -> list[ReportFigure]:
    """Draw every figure the inputs allow into ``folder`` as PNG and return them in the order of the page."""
    drawn: list[ReportFigure] = []
    for part, name, title, caption, figure in _figures(inputs, summary, seed, episodes):
        path = save_figure(figure, folder / f"{name}.png", dpi=dpi)
        drawn.append(ReportFigure(part, _width(figure), title, caption, path))
    return drawn


def _figures(
    inputs: ReportInputs, summary: dict[str, Any], seed: int, episodes: int
) -> Iterator[tuple[str, str, str, str, Figure]]:
    """Yield part, file name, title, caption and figure."""
    yield from _cost_figures(inputs, summary, seed)
    for index, pair in enumerate(choose_episodes(inputs.episodes, episodes)):
        title = f"Trial {pair.learned.trial_id}: {pair.label}"
        yield "drives", f"trajectories_{index}", title, _drive_caption(pair), draw_episode_pair(pair)
    if summary["estimates"]:
        yield "estimates", "calibration", "Reliability of P_S", _RELIABILITY, draw_reliability(summary["estimates"])
    if inputs.curves:
        yield "training", "training", "Training curves", _TRAINING, draw_training(inputs.curves)


def _width(figure: Figure) -> str:
    """Return how wide a figure is shown: small, narrow or full width, by its inches."""
    inches = figure.get_figwidth()
    return "small" if inches < 5.0 else "narrow" if inches < 8.0 else "full"


def _cost_figures(
    inputs: ReportInputs, summary: dict[str, Any], seed: int
) -> Iterator[tuple[str, str, str, str, Figure]]:
    ratios = {}
    for name in (LEARNED, PERFECT):
        paired = pair_costs(inputs.trials, name)
        line = fit_planner(paired, name, seed)
        if line is None:
            continue
        ratios[name] = trial_ratios(paired.baseline_m, paired.ours_m)
        figure = draw_cost_scatter(
            paired, line, name, with_intercept=_with_intercept(summary["planners"][name]), small=name != LEARNED
        )
        title = f"{title_of(name).capitalize()} over {title_of(BASELINE)}"
        yield "costs", f"scatter_{name}", title, _scatter_caption(name, summary["planners"][name]), figure
    if ratios:
        yield "costs", "ratios", "Ratios of single trials", _RATIOS, draw_ratio_histogram(ratios)


def _with_intercept(planner: dict[str, Any]) -> tuple[float, float] | None:
    """Return slope and intercept of the RANSAC line, None where none was found."""
    return None if planner["ransac_slope"] is None else (planner["ransac_slope"], planner["ransac_intercept_m"])


def _scatter_caption(name: str, planner: dict[str, Any]) -> str:
    first = (
        f"Each point is one trial: the same start and goal driven by both planners. Points in the shaded region below "
        f"the diagonal went better for {title_of(name)}. The line through the origin is fitted so that "
        f"{planner['trimmed_slope_inliers']} of {planner['pairs']} trials (95 %) are inliers (filled); its slope is "
        f"{planner['trimmed_slope']:.3f}, and the inliers lie within {planner['trimmed_slope_residual_m']:.1f} m of "
        f"it. Dotted: the RANSAC line with an intercept, another quantity. The total ratio, "
        f"{planner['total_ratio']:.3f}, counts every trial, outliers (hollow) too."
    )
    return f"{first} This planner knows the true labels: a bound, not a competitor." if planner["bound"] else first


def _drive_caption(pair: EpisodePair) -> str:
    change = 100.0 * (pair.ratio - 1.0)
    return (
        f"Learned travelled {pair.learned.cost_m:.1f} m, optimistic {pair.optimistic.cost_m:.1f} m ({change:+.1f} %). "
        "White floor and dark walls are what the robot had seen by its end; what it never saw is faint. Disc: start. "
        "Star: goal. Squares: each frontier cell it ever estimated, in the colour of its last P_S, from red (leads "
        "nowhere) to green (leads to the goal); the optimistic planner estimates none."
    )


_RATIOS = (
    "How the gain is spread: the ratio of costs of each single trial, on an axis where half and double lie equally far "
    "from 1. Left of the dashed line the planner travelled less than the optimistic one."
)
_RELIABILITY = (
    "Subgoals met on the learned drives, sorted into ten bins by the predicted probability P_S that they lead to the "
    "goal. On the dashed line the prediction is as often true as it says; bars are 95 % Wilson intervals, the lower "
    "panel counts subgoals. ECE is the mean distance from the line, weighted by the counts; Brier the mean squared "
    "error of P_S; AUC the chance that a subgoal that leads to the goal is rated above one that does not."
)
_TRAINING = (
    "Each quantity over the training steps, on the plans the network learns from and on plans held out for validation. "
    "The network kept is the one with the lowest validation loss. A validation curve that rises while the training "
    "curve falls would mean learning by heart."
)
