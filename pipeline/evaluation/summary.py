"""Everything the trials say, as one JSON-able record: what the report prints and MLflow keeps.

No value is NaN: a number that cannot be formed is None, and the counts beside it say why.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import asdict
from math import isfinite
from typing import Any

import numpy as np
import pyarrow as pa

from pipeline.evaluation.calibration import calibrate, regression_error
from pipeline.evaluation.paired import PairedCosts, pair_costs, restrict
from pipeline.evaluation.ransac import INLIER_SHARE, OriginLine, fit_origin_line
from pipeline.evaluation.statistics import CLEAR_LOSS, CONFIDENCE, RESAMPLES, TIE_TOLERANCE, bootstrap, cost_ratios
from pipeline.evaluation.trials import BASELINE, BOUNDS, ENDINGS, REACHED, TrialRow, digest, planners_in, trial_rows
from pipeline.randomness import stream

SUMMARY_VERSION = 1


def summarise(trials: pa.Table, estimates: pa.Table | None, seed: int, *, resamples: int = RESAMPLES) -> dict[str, Any]:
    """Return every number of docs/metrics.md for a trial table and, where there are any, the network's estimates.

    ``seed`` feeds the bootstrap and the RANSAC draws only; each planner has streams of its own, so adding a planner
    moves no other number. Keys: version, seed, settings, trials, digest, planners, buildings, estimates.
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
            "resamples": resamples,
            "confidence": CONFIDENCE,
            "tie_tolerance": TIE_TOLERANCE,
            "clear_loss": CLEAR_LOSS,
        },
        "trials": len({row.trial_id for row in rows}),
        "environments": sorted({row.environment for row in rows}),
        "splits": sorted({row.split for row in rows}),
        "digest": digest(trials),
        "planners": {name: _planner(name, by_planner[name], paired[name], seed, resamples) for name in names},
        "buildings": _buildings(rows, paired),
        "estimates": summarise_estimates(estimates),
    }


def fit_planner(paired: PairedCosts, planner: str, seed: int) -> OriginLine | None:
    """Return the RANSAC line of ``planner``, from the same random stream wherever it is asked; None without pairs."""
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
    wanted = ("pairs", "total_cost_m", "total_ratio", "slope", "median_ratio", "mean_ratio", "lost_share")
    for name, planner in summary["planners"].items():
        found = {key: planner[key] for key in (*wanted, "clearly_lost_share", "ms_per_step")}
        found["reached"] = planner["endings"][REACHED]
        for key in ("total_ratio", "slope"):
            if planner[f"{key}_interval"] is not None:
                found[f"{key}_low"], found[f"{key}_high"] = planner[f"{key}_interval"]
        metrics |= {f"{name}/{key}": float(value) for key, value in found.items() if value is not None}
    if summary["estimates"]:
        quality = summary["estimates"]
        metrics |= {f"p_success/{key}": quality[key] for key in ("ece", "brier", "auc") if quality[key] is not None}
        for key in ("delta_success", "exploration"):
            if quality[key]:
                metrics |= {f"{key}/{part}": quality[key][part] for part in ("mae", "bias")}
    return metrics


def _planner(name: str, rows: list[TrialRow], paired: PairedCosts, seed: int, resamples: int) -> dict[str, Any]:
    """Return the numbers of one planner; rows are all its trials, paired those that can be compared."""
    endings = Counter(row.ending for row in rows)
    seconds, steps = sum(row.seconds for row in rows), sum(row.steps for row in rows)
    timed = seconds > 0 and steps > 0
    return {
        "bound": name in BOUNDS,
        "trials": len(rows),
        "endings": {ending: endings[ending] for ending in ENDINGS},
        "pairs": len(paired.trial_ids),
        "excluded": paired.excluded,
        "steps": steps,
        "decisions": sum(row.decisions for row in rows),
        "ms_per_step": 1e3 * seconds / steps if timed else None,
        "trials_per_second": len(rows) / seconds if timed else None,
        **_costs(name, paired, seed, resamples),
    }


def _costs(name: str, paired: PairedCosts, seed: int, resamples: int) -> dict[str, Any]:
    """Return costs, ratios, slope and their intervals; all None without a pair."""
    line = fit_planner(paired, name, seed)
    if line is None:
        ratios = ("total_ratio", "slope", "median_ratio", "mean_ratio")
        shares = ("won_share", "tied_share", "lost_share", "clearly_lost_share")
        intervals = tuple(f"{key}_interval" for key in ratios)
        rest = ("total_cost_m", "baseline_cost_m", "slope_inliers", "slope_residual_m")
        return dict.fromkeys((*ratios, *intervals, *shares, *rest))
    found = cost_ratios(paired.baseline_m, paired.ours_m)
    spread = bootstrap(
        paired.baseline_m,
        paired.ours_m,
        slope=line.slope,
        rng=stream(seed, "evaluation", "bootstrap", name),
        resamples=resamples,
    )
    return {
        "total_cost_m": float(paired.ours_m.sum()),
        "baseline_cost_m": float(paired.baseline_m.sum()),
        "total_ratio": found.total,
        "total_ratio_interval": list(spread.total),
        "slope": line.slope,
        "slope_interval": list(spread.slope),
        "slope_inliers": int(line.inliers.sum()),
        "slope_residual_m": line.residual_m,
        "median_ratio": found.median,
        "median_ratio_interval": list(spread.median),
        "mean_ratio": found.mean,
        "mean_ratio_interval": list(spread.mean),
        "won_share": found.won,
        "tied_share": found.tied,
        "lost_share": found.lost,
        "clearly_lost_share": found.clearly_lost,
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
