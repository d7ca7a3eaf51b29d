"""What the report shows of learned subgoals beside costs and drives: how well each network knew what lay beyond."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pipeline.evaluation.cost_table import number_text
from pipeline.reports import markup
from pipeline.reports.calibration import draw_reliability
from pipeline.reports.figures import Drawn, Section, SystemFigures
from pipeline.reports.inputs import ReportInputs

ESTIMATES = "estimates"


def draw(inputs: ReportInputs) -> Iterator[Drawn]:
    """Yield a reliability diagram of each competitor that estimates."""
    for name, found in _estimating(inputs).items():
        title = f"Reliability of P_S, {found['title']}"
        yield Drawn(
            ESTIMATES, f"calibration_{name}", title, _RELIABILITY, draw_reliability(found["measures"]["p_success"])
        )


def sections(inputs: ReportInputs) -> list[Section]:
    """Return the section on what the networks knew."""
    parts = [part for found in _estimating(inputs).values() for part in _quality(found, inputs.summary["splits"])]
    none = [markup.paragraph("No estimates were recorded in this run, so there is nothing to calibrate.", "muted")]
    return [Section(ESTIMATES, "What the network knew", parts or none)]


def _estimating(inputs: ReportInputs) -> Mapping[str, Any]:
    found = inputs.summary["competitors"]
    return {name: each for name, each in found.items() if each["measures"].get("p_success")}


def _quality(found: Mapping[str, Any], splits: Sequence[str]) -> list[str]:
    measures = found["measures"]
    quality = measures["p_success"]
    parts = [
        markup.paragraph(
            f"{found['title'].capitalize()}: {quality['count']:,} estimates of subgoals on its drives through "
            f"{', '.join(splits)} plans, {quality['positives']:,} of which lead to the goal. "
            f"ECE {number_text(quality['ece'])}, Brier score "
            f"{number_text(quality['brier'])}, AUC {number_text(quality['auc'])}."
        )
    ]
    rows = [
        (title, f"{errors['count']:,}", *(number_text(errors[key], 2) for key in _KEYS), number_text(errors["r2"], 2))
        for title, key in (("delta success cost", "delta_success"), ("exploration cost", "exploration"))
        if (errors := measures[key])
    ]
    if rows:
        parts += [markup.table(_HEAD, rows), markup.paragraph(_ERRORS, "muted")]
    return parts


_KEYS = ("mean_true", "bias", "mae", "rmse", "median_error")
_HEAD = (
    "predicted cost [m]", "subgoals", "mean true", "bias", "mean abs.", "root mean sq.", "median abs.", "R²",
)  # fmt: skip
_ERRORS = (
    "Error is predicted minus true, in metres, over the subgoals for which the cost is defined: delta success where a "
    "subgoal leads to the goal, exploration where it does not. R² is the share of the variance explained; 0 is as good "
    "as always saying the mean."
)
_RELIABILITY = (
    "Subgoals met on the drives, sorted into ten bins by the predicted probability P_S that they lead to the "
    "goal. On the dashed line the prediction is as often true as it says; bars are 95 % Wilson intervals, the lower "
    "panel counts subgoals. ECE is the mean distance from the line, weighted by the counts; Brier the mean squared "
    "error of P_S; AUC the chance that a subgoal that leads to the goal is rated above one that does not."
)

FIGURES = SystemFigures(
    marks="$P_S$ of the frontier",
    caption=(
        "Squares: each frontier cell it ever estimated, in the colour of its last P_S, from red (leads nowhere) to "
        "green (leads to the goal); a planner that does not estimate has none."
    ),
    draw=draw,
    sections=sections,
)
