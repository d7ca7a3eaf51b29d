"""The cost table in plain text: what a run prints at its end."""

from textwrap import wrap
from typing import Any

from pipeline.evaluation.trials import BASELINE, REACHED

NOT_FORMED = "-"
TITLES = {
    BASELINE: "optimistic",
    "learned": "learned",
    "perfect": "perfect estimates",
    "known_map": "known map",
}
_HEADER = (
    "planner", "reached", "cost [m]", "ratio", "95 % interval", "slope", "median", "mean", "lost", "lost > 10 %",
    "ms/step",
)  # fmt: skip


def format_cost_table(summary: dict[str, Any]) -> str:
    """Return the cost table of ``summary`` as aligned text, the bounds beneath a rule, about 110 columns wide."""
    planners = summary["planners"]
    ranked = [_row(name, planner) for name, planner in planners.items() if not planner["bound"]]
    bounds = [_row(name, planner) for name, planner in planners.items() if planner["bound"]]
    widths = [max(len(row[i]) for row in (_HEADER, *ranked, *bounds)) for i in range(len(_HEADER))]
    rule = "-" * (sum(widths) + 2 * (len(widths) - 1))
    lines = [_align(_HEADER, widths), rule, *(_align(row, widths) for row in ranked)]
    if bounds:
        lines += [f"-- bounds: they use the true map {rule}"[: len(rule)], *(_align(row, widths) for row in bounds)]
    lines += [rule, *(part for note in _notes(summary) for part in wrap(note, width=len(rule)))]
    return "\n".join(line.rstrip() for line in lines)


def title_of(planner: str) -> str:
    """Return the planner's name in words."""
    return TITLES.get(planner, planner.replace("_", " "))


def interval_text(interval: list[float] | None) -> str:
    """Return an interval as text, a dash where it was not formed."""
    return NOT_FORMED if interval is None else f"{interval[0]:.3f} - {interval[1]:.3f}"


def number_text(value: float | None, digits: int = 3) -> str:
    """Return a number with thousands separated, a dash where it was not formed."""
    return NOT_FORMED if value is None else f"{round(value, digits) + 0.0:,.{digits}f}"  # never "-0.00"


def share_text(value: float | None) -> str:
    """Return a share as a percentage, a dash where it was not formed."""
    return NOT_FORMED if value is None else f"{100 * value:.1f} %"


def table_notes(summary: dict[str, Any]) -> list[str]:
    """Return sentences on what the table leaves out: trials without a ratio, each reason with its count."""
    notes = []
    for name, planner in summary["planners"].items():
        reasons = [f"{count} x {reason}" for reason, count in planner["excluded"].items()]
        if reasons and name != BASELINE:
            left = sum(planner["excluded"].values())
            notes.append(
                f"{title_of(name)}: {left} of {summary['trials']} trials give no ratio ({', '.join(reasons)})."
            )
    return notes


def _row(name: str, planner: dict[str, Any]) -> tuple[str, ...]:
    return (
        title_of(name),
        f"{planner['endings'][REACHED]}/{planner['trials']}",
        number_text(planner["total_cost_m"], 0),
        number_text(planner["total_ratio"]),
        interval_text(planner["total_ratio_interval"]),
        number_text(planner["slope"]),
        number_text(planner["median_ratio"]),
        number_text(planner["mean_ratio"]),
        share_text(planner["lost_share"]),
        share_text(planner["clearly_lost_share"]),
        number_text(planner["ms_per_step"], 2),
    )


def _align(row: tuple[str, ...], widths: list[int]) -> str:
    """Return one line: names to the left, numbers to the right."""
    cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
    return "  ".join(cells)


def _notes(summary: dict[str, Any]) -> list[str]:
    where = ", ".join(summary["environments"]) or "no environment"
    return [
        f"{summary['trials']} trials ({where}), the same for every planner. ratio: total cost over that of optimistic, "
        "with its bootstrap interval. slope: RANSAC line through the origin with 95 % of the trials. median, mean: of "
        "the ratios of single trials. lost: share of trials dearer than optimistic.",
        *table_notes(summary),
    ]
