"""The report: one self-contained HTML page, built from numbers and figures that are already there."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pipeline.evaluation.competitors import Role
from pipeline.evaluation.cost_table import (
    NOT_FORMED,
    baseline_title,
    interval_text,
    line_text,
    number_text,
    share_text,
    table_notes,
)
from pipeline.evaluation.trials import ENDINGS
from pipeline.reports import markup
from pipeline.reports.figures import ReportFigure, Section
from pipeline.reports.networks import networks
from pipeline.reports.stylesheet import STYLE

MOST_BUILDINGS = 40
_MOST_VERDICTS = 3


@dataclass(frozen=True, kw_only=True)
class PageContent:
    """Everything on the page.

    sections: the system's own. settings, provenance: name -> value, shown as they are. missing: sentences.
    elsewhere: no network that drove was trained in this run.
    """

    title: str
    summary: Mapping[str, Any]
    figures: list[ReportFigure] = field(default_factory=list)
    sections: list[Section] = field(default_factory=list)
    settings: Mapping[str, Any] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)
    harvest: Mapping[str, Any] = field(default_factory=dict)
    train: Mapping[str, Any] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)
    elsewhere: bool = False


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
        *(
            markup.section(own.title, *own.parts, *_pictures(content, own.name), name=own.name)
            for own in content.sections
        ),
        markup.section("Buildings", *_buildings(summary), name="buildings"),
        markup.section("Networks", *networks(summary, elsewhere=content.elsewhere), name="networks"),
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
    summary = content.summary
    parts = [markup.heading(content.title), markup.paragraph(_verdict(summary), "lead")]
    shown = [found for found in _candidates(summary) if found["pairs"]]
    if shown:
        parts.append(markup.tiles(_headlines(shown[0])))
    return "<header>" + "\n".join(parts) + "</header>"


def _candidates(summary: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return what is ranked against the baseline, in order."""
    return [found for found in summary["competitors"].values() if found["role"] == Role.candidate]


def _verdict(summary: Mapping[str, Any]) -> str:
    """Return the outcome in one or two sentences for each candidate, saying where the interval leaves it open."""
    where = f"{', '.join(summary['environments'])} ({', '.join(summary['splits'])} plans)"
    shown = [found for found in _candidates(summary) if found["pairs"]]
    if not shown:
        return (
            f"{summary['trials']} trials in {where}: no trial was finished by both the baseline and a candidate, so no "
            "ratio is formed."
        )
    return " ".join(_verdict_on(found, where, baseline_title(summary)) for found in shown[:_MOST_VERDICTS])


def _verdict_on(found: Mapping[str, Any], where: str, baseline: str) -> str:
    change = 100.0 * (found["total_ratio"] - 1.0)
    over_buildings = found["total_ratio_interval"] is not None
    edges = found["total_ratio_interval" if over_buildings else "total_ratio_interval_trials"]
    low, high = (100.0 * (edge - 1.0) for edge in edges)
    drawn = "buildings" if over_buildings else "trials of this one building"
    verdict = f"{abs(change):.1f} % {'less' if change < 0 else 'more'}"
    doubt = "" if high < 0.0 or low > 0.0 else " The interval includes 0: these trials do not settle which is better."
    return (
        f"Over {found['pairs']:,} paired trials in {where}, {found['title']} cost {verdict} than {baseline} "
        f"(95 % interval over {drawn} {low:+.1f} % to {high:+.1f} %).{doubt}"
    )


def _headlines(found: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    ratio, slope = (f"95 %: {interval_text(found[f'{key}_interval'])}" for key in ("total_ratio", "trimmed_slope"))
    clearly = share_text(found["clearly_lost_share"])
    return [
        (number_text(found["total_ratio"]), "total cost ratio", ratio),
        (number_text(found["trimmed_slope"]), "trimmed slope through the origin", slope),
        (
            number_text(found["ransac_slope"]),
            "RANSAC slope with an intercept",
            line_text(found["ransac_slope"], found["ransac_intercept_m"]),
        ),
        (f"{found['finished']}/{found['trials']}", "trials finished", found["title"]),
        (share_text(found["lost_share"]), "of trials lost", f"{clearly} by over 10 %"),
    ]


def _cost_table(summary: Mapping[str, Any]) -> str:
    head = ("competitor", "trials", "cost [m]", "ratio", "95 % interval", "trimmed slope", "95 % interval",
            "RANSAC line", "median", "mean",
            "lost", "lost > 10 %", "ms/step")  # fmt: skip
    rows: list[tuple[str, ...]] = []
    marks: list[str] = []
    for found in summary["competitors"].values():
        first = found["bound"] and "bound" not in " ".join(marks)
        marks.append("bound first-bound" if first else "bound" if found["bound"] else "")
        rows.append(
            (
                found["title"] + (" (bound)" if found["bound"] else ""),
                f"{found['pairs']:,}",
                number_text(found["total_cost_m"], 0),
                number_text(found["total_ratio"]),
                interval_text(found["total_ratio_interval"]),
                number_text(found["trimmed_slope"]),
                interval_text(found["trimmed_slope_interval"]),
                line_text(found["ransac_slope"], found["ransac_intercept_m"]),
                number_text(found["median_ratio"]),
                number_text(found["mean_ratio"]),
                share_text(found["lost_share"]),
                share_text(found["clearly_lost_share"]),
                number_text(found["ms_per_step"], 2),
            )
        )
    return markup.table(head, rows, marked=marks) + markup.paragraph(
        _COSTS.format(baseline=baseline_title(summary), threshold=summary["settings"]["ransac_threshold_m"]), "muted"
    )


def _endings(summary: Mapping[str, Any]) -> str:
    competitors = summary["competitors"].values()
    met = [ending for ending in ENDINGS if any(found["endings"][ending] for found in competitors)]
    rows = [(found["title"], *(f"{found['endings'][ending]:,}" for ending in met)) for found in competitors]
    return markup.table(("competitor", *(ENDINGS[ending] for ending in met)), rows)


def _buildings(summary: Mapping[str, Any]) -> list[str]:
    buildings, baseline = summary["buildings"], summary["settings"]["baseline"]
    ours = {name: found for name, found in summary["competitors"].items() if name != baseline}
    ranked = [name for name, found in ours.items() if found["role"] == Role.candidate]
    if len(buildings) > MOST_BUILDINGS:
        return [markup.paragraph(_building_spread(buildings, name, ours[name]["title"])) for name in ranked]
    rows = [
        (
            building,
            f"{found['trials']:,}",
            *(number_text(found["competitors"][name]["total_ratio"]) for name in ours),
            *(share_text(found["competitors"][name]["lost_share"]) for name in ranked),
        )
        for building, found in buildings.items()
    ]
    head = (*(found["title"] for found in ours.values()), *(f"{ours[name]['title']} lost" for name in ranked))
    said = f"Total cost over that of {baseline_title(summary)}, within each building."
    return [markup.table(("building", "trials", *head), rows), markup.paragraph(said, "muted")]


def _building_spread(buildings: Mapping[str, Any], name: str, title: str) -> str:
    ratios = sorted(
        found["competitors"][name]["total_ratio"]
        for found in buildings.values()
        if found["competitors"][name]["total_ratio"] is not None
    )
    if not ratios:
        return f"{len(buildings)} plans; no ratio of {title} in any of them."
    better = sum(ratio < 1.0 for ratio in ratios)
    return (
        f"The trials lie in {len(buildings)} plans, too many for a table here (summary.json of the evaluate stage has "
        f"them all). Total ratio of {title} per plan: from {ratios[0]:.3f} to {ratios[-1]:.3f}, median "
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
        if figure.section == part
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


_COSTS = (
    "Cost is what was travelled or paid, summed over the trials that this competitor and {baseline} both "
    "finished; ratio is that sum over {baseline}'s on the same trials. Intervals are bootstrapped over buildings, "
    "each drawn with all its trials. Trimmed slope: of the line through the origin to which 95 % of the trials "
    "are closest. RANSAC line: with an intercept and inliers within {threshold:g} m, as published "
    "comparisons fit it; the two slopes are different quantities. Median and mean are of the ratios of "
    "single trials. Lost: share of trials dearer than {baseline}, and dearer by more than 10 %. Bounds know what "
    "no robot knows, such as the true map; they are not ranked."
)
_HARVEST = "What the training plans gave to learn from."
_SCORES = (
    "The training stage's own scores, on the plans it fitted and on those that chose the step and the calibration "
    "that are kept: both flatter. What chose nothing stands under what the network knew. Names that hold base belong "
    "to a predictor that ignores its input: always the base rate, or the mean cost."
)
_SEED = "The same seed, configuration and code give the same trials, whatever the number of workers."
_FOOTER = (
    "Made by Hinterland from files of the evaluate, train and harvest stages. docs/metrics.md defines every number."
)
