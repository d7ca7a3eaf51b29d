"""The side table of this system: what an estimator said of each subgoal it was asked about, beside the truth."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from pipeline.errors import TableError
from pipeline.evaluation.calibration import calibrate, regression_error
from pipeline.tables import Table, column


class EstimateRow(NamedTuple):
    """What a competitor's estimator said about one subgoal on a drive, beside the truth.

    true_delta_success_m is None unless the subgoal leads to the goal, true_exploration_m is None if it does.
    weight_m: misclassification cost [m].
    """

    trial_id: str
    competitor: str
    step: int
    p_success: float
    delta_success_m: float
    exploration_m: float
    leads_to_goal: bool
    true_delta_success_m: float | None
    true_exploration_m: float | None
    weight_m: float


_text, _int, _single = pa.string(), pa.int32(), pa.float32()
ESTIMATES = Table(
    "estimates",
    2,
    [
        column("trial_id", _text),
        column("competitor", _text),
        column("step", _int),
        column("p_success", _single),
        column("delta_success_m", _single, unit="m"),
        column("exploration_m", _single, unit="m"),
        column("leads_to_goal", pa.bool_()),
        column("true_delta_success_m", _single, unit="m", optional=True),
        column("true_exploration_m", _single, unit="m", optional=True),
        column("weight_m", _single, unit="m"),
    ],
    stage="evaluate",
)


def estimates_table(rows: Iterable[EstimateRow]) -> pa.Table:
    """Return ``rows`` as a table in the given order. Raises TableError for a probability outside [0, 1]."""
    listed = list(rows)
    for row in listed:
        if not 0.0 <= row.p_success <= 1.0:
            raise TableError(
                f"estimates: trial {row.trial_id!r}, step {row.step} has P_S = {row.p_success}, expected 0 to 1."
            )
    return ESTIMATES.stack(listed)


def measure_estimates(tables: Mapping[str, pa.Table]) -> dict[str, dict[str, Any]]:
    """Return of each competitor that estimates the calibration of its P_S and the errors of its costs.

    Keys: those of `pipeline.evaluation.calibration.Calibration` under p_success, of `RegressionError` under
    delta_success and exploration (None where there is nothing to compare).
    """
    table = tables["estimates"]
    names = sorted(pc.unique(table.column("competitor")).to_pylist())
    return {name: _measure(table.filter(pc.equal(table.column("competitor"), name))) for name in names}


def _measure(estimates: pa.Table) -> dict[str, Any]:
    leads = np.asarray(estimates.column("leads_to_goal").to_numpy(), dtype=bool)
    quality = calibrate(np.asarray(estimates.column("p_success").to_numpy(), dtype=np.float64), leads)
    return {
        "p_success": asdict(quality),
        "delta_success": _errors(estimates, "delta_success_m"),
        "exploration": _errors(estimates, "exploration_m"),
    }


def _errors(estimates: pa.Table, name: str) -> dict[str, Any] | None:
    """Compare column ``name`` with its truth where the truth is known."""
    true = np.asarray(estimates.column(f"true_{name}").to_numpy(), dtype=np.float64)
    known = ~np.isnan(true)
    predicted = np.asarray(estimates.column(name).to_numpy(), dtype=np.float64)
    found = regression_error(predicted[known], true[known])
    return None if found is None else asdict(found)
