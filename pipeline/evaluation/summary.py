"""Everything the trials say, as one JSON-able record: what the report prints and MLflow keeps.

No value is NaN: a number that cannot be formed is None, and the counts beside it say why.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from itertools import product
from math import isfinite
from typing import Any

import numpy as np
import pyarrow as pa

from pipeline.evaluation.calibration import calibrate, regression_error
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
from pipeline.evaluation.trials import BASELINE, BOUNDS, ENDINGS, REACHED, TrialRow, digest, planners_in, trial_rows
from pipeline.evaluation.trimmed_line import INLIER_SHARE, OriginLine, fit_origin_line
from pipeline.randomness import stream

SUMMARY_VERSION = 2
_SPREAD = ("total_ratio", "trimmed_slope", "median_ratio", "mean_ratio")  # in the order of Intervals


def summarise(
    trials: pa.Table,
    estimates: pa.Table | None,
    seed: int,
    *,
    ransac_threshold_m: float = THRESHOLD_M,
    remarks: Sequence[str] = (),
    network: Mapping[str, Any] | None = None,
    resamples: int = RESAMPLES,
) -> dict[str, Any]:
    """Return every number of docs/metrics.md for a trial table and, where there are any, the network's estimates.

    ``seed`` feeds the bootstrap and the RANSAC draws only; each planner has streams of its own, so adding a planner
    moves no other number. ``remarks``: sentences that the reader of the numbers has to know, kept as they are.
    ``network``: the settings that the network was made with, its training seed among them.
    Keys: version, seed, settings, remarks, network, trials, digest, planners, buildings, estimates.
    """
    rows = trial_rows(trials)
    names = planners_in(trials)
    paired = {name: pair_costs(trials, name) for name in names}
    by_planner = {name: [row for row in rows if row.planner == name] for name in names}
    return {
        "version": SUMMARY_VERSION,
        "seed": seed,
        "settings": {
            "baseline": BASELINE,
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
        "network": None if network is None else dict(network),
        "trials": len({row.trial_id for row in rows}),
        "environments": sorted({row.environment for row in rows}),
        "splits": sorted({row.split for row in rows}),
        "digest": digest(trials),
        "planners": {
            name: _planner(name, by_planner[name])
            | _costs(name, paired[name], seed, resamples)
            | _ransac(name, paired[name], seed, ransac_threshold_m)
            for name in names
        },
        "buildings": _buildings(rows, paired),
        "estimates": summarise_estimates(estimates),
    }


def fit_planner(paired: PairedCosts, planner: str, seed: int) -> OriginLine | None:
    """Return the trimmed line of ``planner``, from the same random stream wherever it is asked; None without pairs."""
    if not paired.trial_ids:
        return None
    return fit_origin_line(paired.baseline_m, paired.ours_m, rng=stream(seed, "evaluation", "ransac", planner))


def summarise_estimates(estimates: pa.Table | None) -> dict[str, Any] | None:
    """Return calibration and regression errors of an estimate table; None where there are no estimates."""
    if estimates is None or estimates.num_rows == 0:
        return None
    leads = np.asarray(estimates.column("leads_to_goal").to_numpy(), dtype=bool)
    quality = calibrate(np.asarray(estimates.column("p_success").to_numpy(), dtype=np.float64), leads)
    found = {
        **asdict(quality),
        "delta_success": _errors(estimates, "delta_success_m"),
        "exploration": _errors(estimates, "exploration_m"),
    }
    return {key: _plain(value) for key, value in found.items()}


def flat_metrics(summary: dict[str, Any]) -> dict[str, float]:
    """Return the headline numbers as ``<planner>/<name>`` -> value, for a metric store; None is left out."""
    metrics: dict[str, float] = {"trials": float(summary["trials"])}
    wanted = (
        "pairs", "total_cost_m", "total_ratio", "trimmed_slope", "ransac_slope", "ransac_intercept_m", "median_ratio",
        "mean_ratio", "lost_share", "clearly_lost_share", "ms_per_step",
    )  # fmt: skip
    for name, planner in summary["planners"].items():
        found = {key: planner[key] for key in wanted}
        found["reached"] = planner["endings"][REACHED]
        for key, suffix in product(("total_ratio", "trimmed_slope"), ("", "_trials")):
            if planner[f"{key}_interval{suffix}"] is not None:
                found[f"{key}_low{suffix}"], found[f"{key}_high{suffix}"] = planner[f"{key}_interval{suffix}"]
        metrics |= {f"{name}/{key}": float(value) for key, value in found.items() if value is not None}
    if summary["estimates"]:
        quality = summary["estimates"]
        metrics |= {f"p_success/{key}": quality[key] for key in ("ece", "brier", "auc") if quality[key] is not None}
        for key in ("delta_success", "exploration"):
            if quality[key]:
                metrics |= {f"{key}/{part}": quality[key][part] for part in ("mae", "bias")}
    return metrics


def _planner(name: str, rows: list[TrialRow]) -> dict[str, Any]:
    """Return how the drives of one planner ended and what they took; ``rows`` are all its trials."""
    endings = Counter(row.ending for row in rows)
    seconds, steps = sum(row.seconds for row in rows), sum(row.steps for row in rows)
    timed = seconds > 0 and steps > 0
    return {
        "bound": name in BOUNDS,
        "trials": len(rows),
        "endings": {ending: endings[ending] for ending in ENDINGS},
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
    line = fit_planner(paired, name, seed)
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
        return "no trial was finished by both planners"
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


def _buildings(rows: Iterable[TrialRow], paired: dict[str, PairedCosts]) -> dict[str, Any]:
    """Return per building: number of trials, and per planner the pairs, total ratio and shares lost."""
    trials: dict[str, set[str]] = {}
    for row in rows:
        trials.setdefault(row.building, set()).add(row.trial_id)
    table: dict[str, Any] = {}
    for building in sorted(trials):
        planners: dict[str, Any] = {}
        for name, costs in paired.items():
            if name == BASELINE:
                continue
            part = restrict(costs, building)
            found = cost_ratios(part.baseline_m, part.ours_m) if part.trial_ids else None
            planners[name] = {
                "pairs": len(part.trial_ids),
                "total_ratio": found.total if found else None,
                "lost_share": found.lost if found else None,
            }
        table[building] = {"trials": len(trials[building]), "planners": planners}
    return table


def _errors(estimates: pa.Table, name: str) -> dict[str, Any] | None:
    """Compare column ``name`` with its truth where the truth is known."""
    true = estimates.column(f"true_{name}").to_numpy()
    known = ~np.isnan(np.asarray(true, dtype=np.float64))
    predicted = np.asarray(estimates.column(name).to_numpy(), dtype=np.float64)
    found = regression_error(predicted[known], np.asarray(true, dtype=np.float64)[known])
    return None if found is None else asdict(found)


def _plain(value: Any) -> Any:
    """Return ``value`` with every number that is not finite replaced by None, for JSON."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not isfinite(value) else value
