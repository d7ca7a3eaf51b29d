"""Everything the trials say, as one JSON-able record: what the report prints and MLflow keeps.

No value is NaN: a number that cannot be formed is None, and the counts beside it say why.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from math import isfinite
from typing import Any

import pyarrow as pa

from pipeline.evaluation.competitors import Role
from pipeline.evaluation.paired import PairedCosts, pair_costs, restrict
from pipeline.evaluation.ransac import MAX_TRIALS, MOST_SAMPLES, THRESHOLD_M, fit_ransac_line
from pipeline.evaluation.statistics import (
    CLEAR_LOSS,
    CONFIDENCE,
    RESAMPLES,
    TIE_TOLERANCE,
    Intervals,
    bootstrap,
    bootstrap_buildings,
    cost_ratios,
)
from pipeline.evaluation.trials import ENDINGS, FINISHED, Entry, TrialRow, competitors_in, digest, trial_rows
from pipeline.evaluation.trimmed_line import INLIER_SHARE, OriginLine, fit_origin_line
from pipeline.randomness import stream

SUMMARY_VERSION = 3
_SPREAD = ("total_ratio", "trimmed_slope", "median_ratio", "mean_ratio")  # in the order of Intervals


def summarise(
    trials: pa.Table,
    seed: int,
    *,
    measures: Mapping[str, Mapping[str, Any]] | None = None,
    ransac_threshold_m: float = THRESHOLD_M,
    remarks: Sequence[str] = (),
    made_with: Mapping[str, Mapping[str, Any]] | None = None,
    weights: Mapping[str, str] | None = None,
    resamples: int = RESAMPLES,
) -> dict[str, Any]:
    """Return every number of docs/metrics.md for a trial table.

    ``seed`` feeds the bootstrap and the RANSAC draws only; each competitor has streams of its own, so adding one moves
    no other number. ``measures``: what the system's side tables say, by competitor; kept as it is, for JSON.
    ``remarks``: sentences that the reader of the numbers has to know, kept as they are. ``made_with``: the settings
    that the networks of competitors were made with, the training seed among them; ``weights``: the digests
    of those networks.
    Keys: version, seed, settings, remarks, trials, environments, splits, digest, competitors, buildings.
    """
    rows, entries = trial_rows(trials), competitors_in(trials)
    paired = {entry.name: pair_costs(trials, entry.name) for entry in entries}
    by_name = {entry.name: [row for row in rows if row.competitor == entry.name] for entry in entries}
    measured = measures or {}
    return {
        "version": SUMMARY_VERSION,
        "seed": seed,
        "settings": {
            "baseline": next((entry.name for entry in entries if entry.role == Role.baseline), None),
            "inlier_share": INLIER_SHARE,
            "ransac_threshold_m": ransac_threshold_m,
            "ransac_most_samples": MOST_SAMPLES,
            "ransac_max_trials": MAX_TRIALS,
            "resamples": resamples,
            "confidence": CONFIDENCE,
            "tie_tolerance": TIE_TOLERANCE,
            "clear_loss": CLEAR_LOSS,
        },
        "remarks": list(remarks),
        "trials": len({row.trial_id for row in rows}),
        "environments": sorted({row.environment for row in rows}),
        "splits": sorted({row.split for row in rows}),
        "digest": digest(trials),
        "competitors": {
            entry.name: _drives(place, entry, by_name[entry.name])
            | _costs(entry.name, paired[entry.name], seed, resamples)
            | _ransac(entry.name, paired[entry.name], seed, ransac_threshold_m)
            | {
                "measures": plain(measured.get(entry.name, {})),
                "made_with": plain((made_with or {}).get(entry.name)),
                "weights": (weights or {}).get(entry.name),
            }
            for place, entry in enumerate(entries)
        },
        "buildings": _buildings(rows, [entry for entry in entries if entry.role != Role.baseline], paired),
    }


def fit_line(paired: PairedCosts, competitor: str, seed: int) -> OriginLine | None:
    """Return the trimmed line of ``competitor``, from the same stream wherever it is asked; None without pairs."""
    if not paired.trial_ids:
        return None
    return fit_origin_line(paired.baseline_m, paired.ours_m, rng=stream(seed, "evaluation", "ransac", competitor))


def flat_metrics(summary: dict[str, Any]) -> dict[str, float]:
    """Return the headline numbers as ``<competitor>/<name>`` -> value, for a metric store; None is left out.

    Of the system's measures those are taken that are single numbers, ``<competitor>/<measure>`` with dots for depth.
    """
    metrics: dict[str, float] = {"trials": float(summary["trials"])}
    wanted = (
        "pairs", "total_cost_m", "total_ratio", "trimmed_slope", "ransac_slope", "ransac_intercept_m", "median_ratio",
        "mean_ratio", "lost_share", "clearly_lost_share", "ms_per_step",
    )  # fmt: skip
    for name, drives in summary["competitors"].items():
        found = {key: drives[key] for key in wanted}
        found["finished"] = drives["finished"]
        for key, suffix in product(("total_ratio", "trimmed_slope"), ("", "_trials")):
            if drives[f"{key}_interval{suffix}"] is not None:
                found[f"{key}_low{suffix}"], found[f"{key}_high{suffix}"] = drives[f"{key}_interval{suffix}"]
        found |= _numbers(drives["measures"])
        metrics |= {f"{name}/{key}": float(value) for key, value in found.items() if value is not None}
    return metrics


def _numbers(tree: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    """Return the single numbers of ``tree`` under dotted names."""
    found: dict[str, float] = {}
    for key, value in tree.items():
        if isinstance(value, Mapping):
            found |= _numbers(value, f"{prefix}{key}.")
        elif isinstance(value, int | float) and not isinstance(value, bool):
            found[f"{prefix}{key}"] = float(value)
    return found


def _drives(place: int, entry: Entry, rows: list[TrialRow]) -> dict[str, Any]:
    """Return how the drives of one competitor ended and what they took; ``rows`` are all its trials."""
    endings = Counter(row.ending for row in rows)
    seconds, steps = sum(row.seconds for row in rows), sum(row.steps for row in rows)
    timed = seconds > 0 and steps > 0
    return {
        "title": entry.title,
        "place": place,
        "role": entry.role,
        "bound": entry.role == Role.bound,
        "trials": len(rows),
        "endings": {ending: endings[ending] for ending in ENDINGS},
        "finished": sum(endings[ending] for ending in FINISHED),
        "steps": steps,
        "decisions": sum(row.decisions for row in rows),
        "ms_per_step": 1e3 * seconds / steps if timed else None,
        "trials_per_second": len(rows) / seconds if timed else None,
    }


def _costs(name: str, paired: PairedCosts, seed: int, resamples: int) -> dict[str, Any]:
    """Return costs, ratios, the trimmed slope and their intervals; all None without a pair."""
    counts = {
        "pairs": len(paired.trial_ids),
        "pair_buildings": len(set(paired.buildings)),
        "excluded": paired.excluded,
        "interval_reason": _interval_reason(paired),
    }
    line = fit_line(paired, name, seed)
    if line is None:
        shares = ("won_share", "tied_share", "lost_share", "clearly_lost_share")
        intervals = tuple(f"{key}_interval{suffix}" for key in _SPREAD for suffix in ("", "_trials"))
        rest = ("total_cost_m", "baseline_cost_m", "trimmed_slope_inliers", "trimmed_slope_residual_m")
        return counts | dict.fromkeys((*_SPREAD, *intervals, *shares, *rest))
    found = cost_ratios(paired.baseline_m, paired.ours_m)
    by_building, by_trial = _spread(name, paired, line.slope, seed, resamples)
    return {
        **counts,
        "total_cost_m": float(paired.ours_m.sum()),
        "baseline_cost_m": float(paired.baseline_m.sum()),
        "total_ratio": found.total,
        "trimmed_slope": line.slope,
        "trimmed_slope_inliers": int(line.inliers.sum()),
        "trimmed_slope_residual_m": line.residual_m,
        "median_ratio": found.median,
        "mean_ratio": found.mean,
        **{
            f"{key}_interval": None if by_building is None else list(by_building[index])
            for index, key in enumerate(_SPREAD)
        },
        **{f"{key}_interval_trials": list(by_trial[index]) for index, key in enumerate(_SPREAD)},
        "won_share": found.won,
        "tied_share": found.tied,
        "lost_share": found.lost,
        "clearly_lost_share": found.clearly_lost,
    }


def _spread(
    name: str, paired: PairedCosts, slope: float, seed: int, resamples: int
) -> tuple[Intervals | None, Intervals]:
    """Return the intervals over buildings and over trials; they are the same where each building has one pair."""
    by_trial = bootstrap(
        paired.baseline_m, paired.ours_m, slope=slope, rng=stream(seed, "evaluation", "bootstrap", name),
        resamples=resamples,
    )  # fmt: skip
    if 1 < len(set(paired.buildings)) == len(paired.buildings):
        return by_trial, by_trial
    by_building = bootstrap_buildings(
        paired.baseline_m, paired.ours_m, paired.buildings, slope=slope,
        rng=stream(seed, "evaluation", "bootstrap", "buildings", name), resamples=resamples,
    )  # fmt: skip
    return by_building, by_trial


def _interval_reason(paired: PairedCosts) -> str | None:
    """Return why there is no interval over buildings, None where there is one."""
    names = set(paired.buildings)
    if not names:
        return "no trial was finished by both"
    if len(names) == 1:
        return f"all pairs lie in one building ({min(names)}), which says nothing of how far buildings differ"
    return None


def _ransac(name: str, paired: PairedCosts, seed: int, threshold_m: float) -> dict[str, Any]:
    """Return the line of the authors' estimator; None where it finds none."""
    rng = stream(seed, "evaluation", "ransac with intercept", name)
    line = fit_ransac_line(paired.baseline_m, paired.ours_m, rng=rng, threshold_m=threshold_m)
    return {
        "ransac_slope": None if line is None else line.slope,
        "ransac_intercept_m": None if line is None else line.intercept_m,
        "ransac_inliers": None if line is None else int(line.inliers.sum()),
    }


def _buildings(rows: Iterable[TrialRow], entries: Iterable[Entry], paired: dict[str, PairedCosts]) -> dict[str, Any]:
    """Return per building: number of trials, and per competitor the pairs, total ratio and shares lost."""
    trials: dict[str, set[str]] = {}
    for row in rows:
        trials.setdefault(row.building, set()).add(row.trial_id)
    table: dict[str, Any] = {}
    for building in sorted(trials):
        competitors: dict[str, Any] = {}
        for entry in entries:
            part = restrict(paired[entry.name], building)
            found = cost_ratios(part.baseline_m, part.ours_m) if part.trial_ids else None
            competitors[entry.name] = {
                "pairs": len(part.trial_ids),
                "total_ratio": found.total if found else None,
                "lost_share": found.lost if found else None,
            }
        table[building] = {"trials": len(trials[building]), "competitors": competitors}
    return table


def plain(value: Any) -> Any:
    """Return ``value`` with every number that is not finite replaced by None, for JSON."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value
