"""The cost table in plain text: what a run prints at its end."""

from collections.abc import Mapping
from textwrap import wrap
from typing import Any

NOT_FORMED = "-"
_HEADER = (
    "competitor", "finished", "cost [m]", "ratio", "95 % interval", "trimmed", "RANSAC line", "median", "mean", "lost",
    "lost > 10 %", "ms/step",
)  # fmt: skip


def format_cost_table(summary: dict[str, Any]) -> str:
    """Return the cost table of ``summary`` as aligned text, the bounds beneath a rule, about 130 columns wide."""
    drives = summary["competitors"].values()
    ranked = [_row(found) for found in drives if not found["bound"]]
    bounds = [_row(found) for found in drives if found["bound"]]
    widths = [max(len(row[i]) for row in (_HEADER, *ranked, *bounds)) for i in range(len(_HEADER))]
    rule = "-" * (sum(widths) + 2 * (len(widths) - 1))
    lines = [_align(_HEADER, widths), rule, *(_align(row, widths) for row in ranked)]
    if bounds:
        lines += [f"-- bounds: they use the true map {rule}"[: len(rule)], *(_align(row, widths) for row in bounds)]
    lines += [rule, *(part for note in _notes(summary) for part in wrap(note, width=len(rule)))]
    return "\n".join(line.rstrip() for line in lines)


def title_of(summary: Mapping[str, Any], name: str | None) -> str:
    """Return the title of the competitor ``name``."""
    return str(summary["competitors"][name]["title"]) if name in summary["competitors"] else str(name)


def baseline_title(summary: Mapping[str, Any]) -> str:
    """Return the title of the competitor with which the others are compared."""
    return title_of(summary, summary["settings"]["baseline"])


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
    ours = [found for name, found in summary["competitors"].items() if name != summary["settings"]["baseline"]]
    for found in ours:
        reasons = [f"{count} x {reason}" for reason, count in found["excluded"].items()]
        if reasons:
            left = sum(found["excluded"].values())
            notes.append(
                f"{found['title']}: {left} of {summary['trials']} trials give no ratio ({', '.join(reasons)})."
            )
    for reason in dict.fromkeys(found["interval_reason"] for found in ours if found["interval_reason"]):
        named = ", ".join(found["title"] for found in ours if found["interval_reason"] == reason)
        notes.append(f"{named}: no interval over buildings, because {reason}.")
    apart = [
        f"{found['title']} {interval_text(found['total_ratio_interval_trials'])}"
        for found in ours
        if found["total_ratio_interval_trials"] not in (None, found["total_ratio_interval"])
    ]
    if apart:
        notes.append(
            f"Intervals over other trials in the same buildings, as if trials were independent: {', '.join(apart)}."
        )
    return notes


def _row(found: dict[str, Any]) -> tuple[str, ...]:
    return (
        found["title"],
        f"{found['finished']}/{found['trials']}",
        number_text(found["total_cost_m"], 0),
        number_text(found["total_ratio"]),
        interval_text(found["total_ratio_interval"]),
        number_text(found["trimmed_slope"]),
        line_text(found["ransac_slope"], found["ransac_intercept_m"]),
        number_text(found["median_ratio"]),
        number_text(found["mean_ratio"]),
        share_text(found["lost_share"]),
        share_text(found["clearly_lost_share"]),
        number_text(found["ms_per_step"], 2),
    )


def _align(row: tuple[str, ...], widths: list[int]) -> str:
    """Return one line: names to the left, numbers to the right."""
    cells = [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
    return "  ".join(cells)


def _notes(summary: dict[str, Any]) -> list[str]:
    where, baseline = ", ".join(summary["environments"]) or "no environment", baseline_title(summary)
    return [
        f"{summary['trials']} trials ({where}), the same for all. ratio: total cost over that of {baseline}, "
        f"with its bootstrap interval over buildings ({_buildings(summary)}). trimmed: slope of the line through the "
        "origin to which 95 % of the trials are closest. RANSAC line: with an intercept, as in the authors' code, "
        f"within {summary['settings']['ransac_threshold_m']:g} m. median, mean: of the ratios of single trials. lost: "
        f"share of trials dearer than {baseline}.",
        *table_notes(summary),
    ]


def _buildings(summary: dict[str, Any]) -> str:
    count = len(summary["buildings"])
    return f"{count:,} building{'' if count == 1 else 's'}, each drawn with all its trials"
