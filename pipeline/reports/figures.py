"""All figures of a report: drawn, saved under their names, and captioned with what each number means."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from pipeline.evaluation.competitors import Role
from pipeline.evaluation.cost_table import baseline_title
from pipeline.evaluation.paired import pair_costs
from pipeline.evaluation.statistics import trial_ratios
from pipeline.evaluation.summary import fit_line
from pipeline.evaluation.trials import competitors_in
from pipeline.reports.inputs import ReportInputs
from pipeline.reports.scatter import Named, draw_cost_scatter, draw_ratio_histogram
from pipeline.reports.style import colours_of, save_figure
from pipeline.reports.training import draw_training
from pipeline.reports.trajectories import Drives, choose_drives, draw_drives


class Drawn(NamedTuple):
    """A figure and where it goes. section: of the page. name: of its file. title, caption: plain text."""

    section: str
    name: str
    title: str
    caption: str
    figure: Figure


class ReportFigure(NamedTuple):
    """A saved figure. width: how it is shown; the rest as in `Drawn`."""

    section: str
    width: str
    title: str
    caption: str
    path: Path


class Section(NamedTuple):
    """A section of the page that only a system has: its parts are HTML made by `pipeline.reports.markup`."""

    name: str
    title: str
    parts: list[str]


def _no_figures(inputs: ReportInputs) -> Iterator[Drawn]:
    yield from ()


def _no_sections(inputs: ReportInputs) -> list[Section]:
    return []


@dataclass(frozen=True, kw_only=True)
class SystemFigures:
    """What a system adds to the report that every system gets.

    marks: what the number of a marked cell is, for the scale of colours; empty where nothing is marked.
    caption: a sentence on what is marked in the drives. draw: further figures. sections: further sections, between the
    drives and the buildings; figures named after a section stand in it.
    """

    marks: str = ""
    caption: str = ""
    draw: Callable[[ReportInputs], Iterator[Drawn]] = _no_figures
    sections: Callable[[ReportInputs], list[Section]] = _no_sections


def draw_figures(
    inputs: ReportInputs, own: SystemFigures, folder: Path, *, episodes: int, dpi: int
) -> list[ReportFigure]:
    """Draw every figure the inputs allow into ``folder`` as PNG and return them in the order of the page.

    own: what the system adds. episodes: how many recorded trials are drawn.
    """
    saved: list[ReportFigure] = []
    for drawn in _figures(inputs, own, episodes):
        path = save_figure(drawn.figure, folder / f"{drawn.name}.png", dpi=dpi)
        saved.append(ReportFigure(drawn.section, _width(drawn.figure), drawn.title, drawn.caption, path))
    return saved


def _figures(inputs: ReportInputs, own: SystemFigures, episodes: int) -> Iterator[Drawn]:
    yield from _cost_figures(inputs)
    for index, drives in enumerate(choose_drives(inputs.episodes, competitors_in(inputs.trials), episodes)):
        title = f"Trial {drives.episodes[0].trial_id}: {drives.label}"
        yield Drawn(
            "drives", f"trajectories_{index}", title, _drive_caption(drives, own), draw_drives(drives, own.marks)
        )
    yield from own.draw(inputs)
    if inputs.curves:
        yield Drawn("training", "training", "Training curves", _TRAINING, draw_training(inputs.curves))


def _width(figure: Figure) -> str:
    """Return how wide a figure is shown: small, narrow or full width, by its inches."""
    inches = figure.get_figwidth()
    return "small" if inches < 5.0 else "narrow" if inches < 8.0 else "full"


def _cost_figures(inputs: ReportInputs) -> Iterator[Drawn]:
    summary, entries = inputs.summary, competitors_in(inputs.trials)
    baseline, colours = baseline_title(summary), colours_of((entry.name, entry.role) for entry in entries)
    ratios = {}
    for entry in entries:
        paired = pair_costs(inputs.trials, entry.name)
        line = fit_line(paired, entry.name, summary["seed"])
        if line is None or entry.role == Role.baseline:
            continue
        named = Named(entry.title, colours[entry.name])
        ratios[named] = trial_ratios(paired.baseline_m, paired.ours_m)
        ransac = _with_intercept(summary["competitors"][entry.name])
        small = entry.role == Role.bound
        figure = draw_cost_scatter(paired, line, named, baseline, with_intercept=ransac, small=small)
        title = f"{entry.title.capitalize()} over {baseline}"
        yield Drawn("costs", f"scatter_{entry.name}", title, _scatter_caption(summary, entry.name), figure)
    if ratios:
        yield Drawn("costs", "ratios", "Ratios of single trials", _RATIOS, draw_ratio_histogram(ratios, baseline))


def _with_intercept(found: dict[str, Any]) -> tuple[float, float] | None:
    """Return slope and intercept of the RANSAC line, None where none was found."""
    return None if found["ransac_slope"] is None else (found["ransac_slope"], found["ransac_intercept_m"])


def _scatter_caption(summary: dict[str, Any], name: str) -> str:
    found = summary["competitors"][name]
    first = (
        f"Each point is one trial: the same start and goal for both. Points in the shaded region below the diagonal "
        f"went better for {found['title']}. The line through the origin is the one to which "
        f"{found['trimmed_slope_inliers']} of {found['pairs']} trials (95 %, filled) lie closest; its slope is "
        f"{found['trimmed_slope']:.3f}, and they lie within {found['trimmed_slope_residual_m']:.1f} m of it. Dotted: "
        f"the RANSAC line with an intercept, another quantity. The total ratio, {found['total_ratio']:.3f}, counts "
        "every trial, the others (hollow) too."
    )
    return f"{first} This one knows what no robot knows: a bound, not a competitor." if found["bound"] else first


def _drive_caption(drives: Drives, own: SystemFigures) -> str:
    told = ", ".join(
        f"{title} travelled {episode.cost_m:.1f} m" + (f" ({_change(episode.cost_m, drives):+.1f} %)" if place else "")
        for place, (title, episode) in enumerate(zip(drives.titles, drives.episodes, strict=True))
    )
    return (
        f"{told[:1].upper()}{told[1:]}. White floor and dark walls are what the robot had seen by its end; what it "
        f"never saw is faint. Disc: start. {'Star: goal. ' if drives.episodes[0].goal_row >= 0 else ''}{own.caption}"
    ).rstrip()


def _change(cost_m: float, drives: Drives) -> float:
    return 100.0 * (cost_m / drives.episodes[0].cost_m - 1.0)


_RATIOS = (
    "How the gain is spread: the ratio of costs of each single trial, on an axis where half and double lie equally far "
    "from 1. Left of the dashed line a trial cost less than the baseline's."
)
_TRAINING = (
    "Each quantity over the training steps, on the plans the network learns from and on plans held out for validation. "
    "The network kept is the one with the lowest validation loss. A validation curve that rises while the training "
    "curve falls would mean learning by heart."
)
