"""The report: one self-contained HTML page, built from numbers and figures that are already there."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pipeline.evaluation.cost_table import (
    NOT_FORMED,
    interval_text,
    line_text,
    number_text,
    share_text,
    table_notes,
    title_of,
)
from pipeline.evaluation.trials import BASELINE, ENDINGS, LEARNED, REACHED
from pipeline.reports import markup
from pipeline.reports.figures import ReportFigure
from pipeline.reports.stylesheet import STYLE

MOST_BUILDINGS = 40


@dataclass(frozen=True, kw_only=True)
class PageContent:
    """Everything on the page. settings, provenance: name -> value, shown as they are. missing: sentences."""

    title: str
    summary: Mapping[str, Any]
    figures: list[ReportFigure] = field(default_factory=list)
    settings: Mapping[str, Any] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)
    harvest: Mapping[str, Any] = field(default_factory=dict)
    train: Mapping[str, Any] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)


def render_page(content: PageContent) -> str:
    """Return the page as HTML that loads nothing from outside itself."""
    summary = content.summary
    return markup.document(
        content.title,
        STYLE,
        _opening(content),
        markup.notice(content.missing),
        markup.section(
            "Costs", _cost_table(summary), markup.notice(table_notes(dict(summary))), *_pictures(content, "costs"),
            name="costs",
        ),
        markup.section("How the trials ended", _endings(summary), name="endings"),
        markup.section("Drives", *_pictures(content, "drives"), name="drives"),
        markup.section("What the network knew", *_estimates(content), name="estimates"),
        markup.section("Buildings", *_buildings(summary), name="buildings"),
        markup.section("Data set", *_data(content.harvest), name="data"),
        markup.section("Training", *_training(content.train), *_pictures(content, "training"), name="training"),
        markup.section("What was run", _settings(content), markup.paragraph(_SEED), name="run"),
        "<footer>" + markup.paragraph(_FOOTER, "muted") + "</footer>",
    )  # fmt: skip


def flatten(record: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    """Return a nested record as dotted names and short texts, in its order; lists are joined."""
    flat: dict[str, str] = {}
    for key, value in record.items():
        if isinstance(value, Mapping):
            flat |= flatten(value, f"{prefix}{key}.")
        else:
            flat[f"{prefix}{key}"] = _text(value)
    return flat


def _opening(content: PageContent) -> str:
    summary, learned = content.summary, content.summary["planners"].get(LEARNED)
    parts = [markup.heading(content.title), markup.paragraph(_verdict(summary), "lead")]
    if learned and learned["pairs"]:
        parts.append(markup.tiles(_headlines(learned)))
    return "<header>" + "\n".join(parts) + "</header>"


def _verdict(summary: Mapping[str, Any]) -> str:
    """Return the outcome in one or two sentences, saying where the interval leaves it open."""
    where = f"{', '.join(summary['environments'])} ({', '.join(summary['splits'])} plans)"
    learned = summary["planners"].get(LEARNED)
    if not learned or not learned["pairs"]:
        return f"{summary['trials']} trials in {where}: no trial was finished by both planners, so no ratio is formed."
    change = 100.0 * (learned["total_ratio"] - 1.0)
    over_buildings = learned["total_ratio_interval"] is not None
    edges = learned["total_ratio_interval" if over_buildings else "total_ratio_interval_trials"]
    low, high = (100.0 * (edge - 1.0) for edge in edges)
    drawn = "buildings" if over_buildings else "trials of this one building"
    verdict = f"{abs(change):.1f} % {'less' if change < 0 else 'more'}"
    doubt = "" if high < 0.0 or low > 0.0 else " The interval includes 0: these trials do not settle which is better."
    return (
        f"Over {learned['pairs']:,} paired trials in {where} the learned planner travelled {verdict} than the "
        f"optimistic one (95 % interval over {drawn} {low:+.1f} % to {high:+.1f} %).{doubt}"
    )


def _headlines(learned: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    ratio, slope = (f"95 %: {interval_text(learned[f'{key}_interval'])}" for key in ("total_ratio", "trimmed_slope"))
    clearly = share_text(learned["clearly_lost_share"])
    return [
        (number_text(learned["total_ratio"]), "total cost ratio", ratio),
        (number_text(learned["trimmed_slope"]), "trimmed slope through the origin", slope),
        (
            number_text(learned["ransac_slope"]),
            "RANSAC slope with an intercept",
            line_text(learned["ransac_slope"], learned["ransac_intercept_m"]),
        ),
        (f"{learned['endings'][REACHED]}/{learned['trials']}", "trials reached the goal", "learned planner"),
        (share_text(learned["lost_share"]), "of trials lost", f"{clearly} by over 10 %"),
    ]


def _cost_table(summary: Mapping[str, Any]) -> str:
    head = ("planner", "trials", "cost [m]", "ratio", "95 % interval", "trimmed slope", "95 % interval",
            "RANSAC line", "median", "mean",
            "lost", "lost > 10 %", "ms/step")  # fmt: skip
    rows: list[tuple[str, ...]] = []
    marks: list[str] = []
    for name, planner in summary["planners"].items():
        first = planner["bound"] and "bound" not in " ".join(marks)
        marks.append("bound first-bound" if first else "bound" if planner["bound"] else "")
        rows.append(
            (
                title_of(name) + (" (bound)" if planner["bound"] else ""),
                f"{planner['pairs']:,}",
                number_text(planner["total_cost_m"], 0),
                number_text(planner["total_ratio"]),
                interval_text(planner["total_ratio_interval"]),
                number_text(planner["trimmed_slope"]),
                interval_text(planner["trimmed_slope_interval"]),
                line_text(planner["ransac_slope"], planner["ransac_intercept_m"]),
                number_text(planner["median_ratio"]),
                number_text(planner["mean_ratio"]),
                share_text(planner["lost_share"]),
                share_text(planner["clearly_lost_share"]),
                number_text(planner["ms_per_step"], 2),
            )
        )
    return markup.table(head, rows, marked=marks) + markup.paragraph(
        _COSTS.format(threshold=summary["settings"]["ransac_threshold_m"]), "muted"
    )


def _endings(summary: Mapping[str, Any]) -> str:
    rows = [
        (title_of(name), *(f"{planner['endings'][ending]:,}" for ending in ENDINGS))
        for name, planner in summary["planners"].items()
    ]
    return markup.table(("planner", *ENDINGS.values()), rows)


def _estimates(content: PageContent) -> list[str]:
    quality = content.summary["estimates"]
    if not quality:
        return [markup.paragraph("No estimates were recorded in this run, so there is nothing to calibrate.", "muted")]
    parts = [
        markup.paragraph(
            f"{quality['count']:,} estimates of subgoals on the learned drives through "
            f"{', '.join(content.summary['splits'])} plans, {quality['positives']:,} of which lead to the goal. "
            f"ECE {number_text(quality['ece'])}, Brier score {number_text(quality['brier'])}, AUC "
            f"{number_text(quality['auc'])}."
        )
    ]
    rows = [
        (
            title,
            f"{found['count']:,}",
            *(number_text(found[key], 2) for key in _ERROR_KEYS),
            number_text(found["r2"], 2),
        )
        for title, key in (("delta success cost", "delta_success"), ("exploration cost", "exploration"))
        if (found := quality[key])
    ]
    if rows:
        head = (
            "predicted cost [m]",
            "subgoals",
            "mean true",
            "bias",
            "mean abs.",
            "root mean sq.",
            "median abs.",
            "R²",
        )
        parts += [markup.table(head, rows), markup.paragraph(_ERRORS, "muted")]
    return parts + _pictures(content, "estimates")


def _buildings(summary: Mapping[str, Any]) -> list[str]:
    buildings = summary["buildings"]
    planners = [name for name in summary["planners"] if name != BASELINE]
    if len(buildings) > MOST_BUILDINGS:
        return [markup.paragraph(_building_spread(buildings))]
    rows = [
        (
            building,
            f"{found['trials']:,}",
            *(number_text(found["planners"][name]["total_ratio"]) for name in planners),
            share_text(found["planners"].get(LEARNED, {}).get("lost_share")),
        )
        for building, found in buildings.items()
    ]
    return [markup.table(("building", "trials", *(title_of(name) for name in planners), "learned lost"), rows),
            markup.paragraph("Total cost over that of optimistic, within each building.", "muted")]  # fmt: skip


def _building_spread(buildings: Mapping[str, Any]) -> str:
    ratios = sorted(
        found["planners"][LEARNED]["total_ratio"]
        for found in buildings.values()
        if LEARNED in found["planners"] and found["planners"][LEARNED]["total_ratio"] is not None
    )
    if not ratios:
        return f"{len(buildings)} plans; no ratio of the learned planner in any of them."
    better = sum(ratio < 1.0 for ratio in ratios)
    return (
        f"The trials lie in {len(buildings)} plans, too many for a table here (summary.json of the evaluate stage has "
        f"them all). Total ratio of the learned planner per plan: from {ratios[0]:.3f} to {ratios[-1]:.3f}, median "
        f"{ratios[len(ratios) // 2]:.3f}; below 1 in {better} of {len(ratios)}."
    )


def _data(harvest: Mapping[str, Any]) -> list[str]:
    """Return the counts of the data set; its digest stands with the provenance."""
    shown = {key: value for key, value in harvest.items() if key != "digest"}
    return [markup.paragraph(_HARVEST), markup.pairs(_in_words(shown))] if shown else []


def _training(train: Mapping[str, Any]) -> list[str]:
    """Return the scores of each split as a table and the rest of the summary as names and values."""
    splits = [name for name in ("train", "validation") if isinstance(train.get(name), Mapping)]
    rest = {key: value for key, value in train.items() if key not in (*splits, "config", "fingerprint", "digest")}
    parts = [markup.pairs(_in_words(rest))] if rest else []
    names = dict.fromkeys(name for split in splits for name in train[split])
    if names:
        rows = [(name.replace("_", " "), *(_text(train[split].get(name)) for split in splits)) for name in names]
        parts += [markup.table(("score of the network kept", *splits), rows), markup.paragraph(_SCORES, "muted")]
    return parts


def _in_words(record: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [(name.replace("_", " ").replace(".", ", "), value) for name, value in flatten(record).items()]


def _settings(content: PageContent) -> str:
    summary = content.summary
    shown = {"seed": _text(summary["seed"]), **content.provenance, "trial table, SHA-256": summary["digest"]}
    return markup.pairs(shown.items()) + (
        markup.folded("Configuration", markup.pairs(flatten(content.settings).items())) if content.settings else ""
    )


def _pictures(content: PageContent, part: str) -> list[str]:
    return [
        markup.picture(figure.path, figure.title, figure.caption, figure.width)
        for figure in content.figures
        if figure.part == part
    ]


def _text(value: Any) -> str:
    if value is None:
        return NOT_FORMED
    if isinstance(value, bool | str):
        return str(value)
    if isinstance(value, int):
        return f"{value:,}" if abs(value) >= 10_000 else str(value)
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(_text(item) for item in value) or "none"
    return str(value)


_ERROR_KEYS = ("mean_true", "bias", "mae", "rmse", "median_error")
_COSTS = (
    "Cost is the distance travelled, summed over the trials that this planner and optimistic both finished; ratio is "
    "that sum over optimistic's on the same trials. Intervals are bootstrapped over buildings, each drawn with all its "
    "trials. Trimmed slope: of the line through the origin to which 95 % of the trials are closest. RANSAC line: with "
    "an intercept and inliers within {threshold:g} m, as the authors of learned subgoal planning fit it; the two "
    "slopes are different quantities. Median and mean are of the ratios of single trials. Lost: share of trials dearer "
    "than optimistic, and dearer by more than 10 %. The bounds read the true map, which no robot has: perfect "
    "estimates runs the same planner with true labels, known map is the shortest path. They are not ranked."
)
_ERRORS = (
    "Error is predicted minus true, in metres, over the subgoals for which the cost is defined: delta success where a "
    "subgoal leads to the goal, exploration where it does not. R² is the share of the variance explained; 0 is as good "
    "as always saying the mean."
)
_HARVEST = (
    "What the network learned from: subgoals met by the optimistic planner on the training plans, with true labels."
)
_SCORES = (
    "The training stage's own scores, on the plans learned from and on those that chose the step and the calibration "
    "that are kept: both flatter. What chose nothing stands under what the network knew. Names that hold base belong "
    "to a predictor that ignores its input: always the base rate, or the mean cost."
)
_SEED = "The same seed, configuration and code give the same trials, whatever the number of workers."
_FOOTER = (
    "Made by Hinterland from files of the evaluate, train and harvest stages. docs/metrics.md defines every number."
)
