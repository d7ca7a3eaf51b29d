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
    "planner", "reached", "cost [m]", "ratio", "95 % interval", "trimmed", "RANSAC line", "median", "mean", "lost",
    "lost > 10 %", "ms/step",
)  # fmt: skip


def format_cost_table(summary: dict[str, Any]) -> str:
    """Return the cost table of ``summary`` as aligned text, the bounds beneath a rule, about 130 columns wide."""
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


def line_text(slope: float | None, intercept_m: float | None) -> str:
    """Return a line with an intercept as text, such as "0.541 x + 4.5 m"; a dash where none was found."""
    if slope is None or intercept_m is None:
        return NOT_FORMED
    sign = "-" if round(intercept_m, 1) < 0 else "+"
    return f"{number_text(slope)} x {sign} {number_text(abs(intercept_m), 1)} m"


def number_text(value: float | None, digits: int = 3) -> str:
    """Return a number with thousands separated, a dash where it was not formed."""
    return NOT_FORMED if value is None else f"{round(value, digits) + 0.0:,.{digits}f}"  # never "-0.00"


def share_text(value: float | None) -> str:
    """Return a share as a percentage, a dash where it was not formed."""
    return NOT_FORMED if value is None else f"{100 * value:.1f} %"


def table_notes(summary: dict[str, Any]) -> list[str]:
    """Return sentences on what the table leaves out.

    Remarks of the run, trials without a ratio (each reason with its count), intervals that cannot be formed, and what
    the intervals would be if the trials of one building were independent.
    """
    notes = list(summary["remarks"])
    ours = {name: planner for name, planner in summary["planners"].items() if name != BASELINE}
    for name, planner in ours.items():
        reasons = [f"{count} x {reason}" for reason, count in planner["excluded"].items()]
        if reasons:
            left = sum(planner["excluded"].values())
            notes.append(
                f"{title_of(name)}: {left} of {summary['trials']} trials give no ratio ({', '.join(reasons)})."
            )
    for reason in dict.fromkeys(planner["interval_reason"] for planner in ours.values() if planner["interval_reason"]):
        named = ", ".join(title_of(name) for name, planner in ours.items() if planner["interval_reason"] == reason)
        notes.append(f"{named}: no interval over buildings, because {reason}.")
    apart = [
        f"{title_of(name)} {interval_text(planner['total_ratio_interval_trials'])}"
        for name, planner in ours.items()
        if planner["total_ratio_interval_trials"] not in (None, planner["total_ratio_interval"])
    ]
    if apart:
        notes.append(
            f"Intervals over other trials in the same buildings, as if trials were independent: {', '.join(apart)}."
        )
    return notes


def _row(name: str, planner: dict[str, Any]) -> tuple[str, ...]:
    return (
        title_of(name),
        f"{planner['endings'][REACHED]}/{planner['trials']}",
        number_text(planner["total_cost_m"], 0),
        number_text(planner["total_ratio"]),
        interval_text(planner["total_ratio_interval"]),
        number_text(planner["trimmed_slope"]),
        line_text(planner["ransac_slope"], planner["ransac_intercept_m"]),
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
        f"with its bootstrap interval over buildings ({_buildings(summary)}). trimmed: slope of the line through the "
        "origin to which 95 % of the trials are closest. RANSAC line: with an intercept, as in the authors' code, "
        f"within {summary['settings']['ransac_threshold_m']:g} m. median, mean: of the ratios of single trials. lost: "
        "share of trials dearer than optimistic.",
        *table_notes(summary),
    ]


def _buildings(summary: dict[str, Any]) -> str:
    count = len(summary["buildings"])
    return f"{count:,} building{'' if count == 1 else 's'}, each drawn with all its trials"
