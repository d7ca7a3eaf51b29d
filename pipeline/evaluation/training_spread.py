"""How far results differ between trainings on the same data: the part of a difference that is luck of the training."""

from collections.abc import Mapping
from statistics import mean, stdev
from typing import Any

from pipeline.errors import TableError
from pipeline.evaluation.competitors import Role
from pipeline.evaluation.cost_table import interval_text, line_text, number_text, share_text

_HEADER = ("train.seed", "ratio", "95 % interval", "trimmed", "RANSAC line", "median", "lost")
_NUMBERS = ("total_ratio", None, "trimmed_slope", "ransac_slope", "median_ratio", "lost_share")


def training_spread(summaries: Mapping[str, Mapping[str, Any]]) -> str:
    """Return a table of the first candidate that has a network, then mean, spread and range over the runs.

    One row is one run, ``summaries``: its name -> its summary.json.

    Raises TableError for fewer than two runs, two of one training seed, or runs that did not drive the same trials.
    """
    if len(summaries) < 2:
        raise TableError("a spread needs the summary.json of at least two runs: give one for each train.seed.")
    seeds = {_seed(name, summary): name for name, summary in summaries.items()}
    _check(summaries, seeds)
    ordered = [(seed, _trained(summaries[seeds[seed]])) for seed in sorted(seeds)]
    rows = [_HEADER, *(_row(str(seed), planner) for seed, planner in ordered)]
    found = [[planner[key] for _, planner in ordered] if key else [] for key in _NUMBERS]
    for title, one in (("mean", mean), ("std. dev.", stdev), ("least", min), ("most", max)):
        rows.append((title, *(_number(key, one(values)) if key and None not in values else "-"
                              for key, values in zip(_NUMBERS, found, strict=True))))  # fmt: skip
    widths = [max(len(row[column]) for row in rows) for column in range(len(_HEADER))]
    lines = ["  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    rule = "-" * len(lines[0])
    return "\n".join([lines[0], rule, *lines[1 : len(ordered) + 1], rule, *lines[len(ordered) + 1 :]])


def _seed(name: str, summary: Mapping[str, Any]) -> int:
    seed = (_trained(summary).get("made_with") or {}).get("train.seed")
    if not isinstance(seed, int):
        raise TableError(
            f"{name}: does not say the train.seed of a candidate, expected the summary.json of an evaluate stage with "
            "a candidate that drives with a network: run `dvc repro train evaluate`."
        )
    return seed


def _trained(summary: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the first candidate that says what its network was made with, empty where there is none."""
    competitors = sorted(summary.get("competitors", {}).values(), key=lambda found: int(found["place"]))
    return next((found for found in competitors if found["role"] == Role.candidate and found["made_with"]), {})


def _check(summaries: Mapping[str, Mapping[str, Any]], seeds: Mapping[int, str]) -> None:
    if len(seeds) < len(summaries):
        twice = next(name for name in summaries if name not in seeds.values())
        seed = _seed(twice, summaries[twice])
        raise TableError(f"{twice} and {seeds[seed]}: both have train.seed = {seed}, expected one run for each seed.")
    first, *others = summaries
    for name in others:
        for what, ours, theirs in (
            ("seed", summaries[name]["seed"], summaries[first]["seed"]),
            ("trials", summaries[name]["trials"], summaries[first]["trials"]),
            ("cost of the baseline [m]", *(_baseline(summaries[run]) for run in (name, first))),
        ):
            if ours != theirs:
                raise TableError(
                    f"{name}: {what} = {ours}, but {first} has {theirs}: only train.seed may differ between the runs."
                )


def _baseline(summary: Mapping[str, Any]) -> Any:
    return summary["competitors"][summary["settings"]["baseline"]]["total_cost_m"]


def _row(title: str, planner: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        title,
        number_text(planner["total_ratio"]),
        interval_text(planner["total_ratio_interval"]),
        number_text(planner["trimmed_slope"]),
        line_text(planner["ransac_slope"], planner["ransac_intercept_m"]),
        number_text(planner["median_ratio"]),
        share_text(planner["lost_share"]),
    )


def _number(key: str, value: float) -> str:
    return share_text(value) if key == "lost_share" else number_text(value)
