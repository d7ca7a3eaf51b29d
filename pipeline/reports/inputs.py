"""What a report is made of: the files of earlier stages. Optional ones may be missing; the page then says so."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa

from pipeline.errors import TableError
from pipeline.evaluation.trials import EpisodeRow, read_episodes, read_estimates, read_trials
from pipeline.files import check_sum
from pipeline.reports.training import Curves, read_curves


@dataclass(frozen=True, kw_only=True)
class ReportInputs:
    """Contents of artifacts/{evaluate, train, harvest}.

    evaluate, harvest, train: the JSON of those stages, empty where missing. missing: a sentence for each file that
    is not there.
    """

    trials: pa.Table
    estimates: pa.Table | None = None
    episodes: list[EpisodeRow] = field(default_factory=list)
    curves: Curves = field(default_factory=dict)
    evaluate: dict[str, Any] = field(default_factory=dict)
    train: dict[str, Any] = field(default_factory=dict)
    harvest: dict[str, Any] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)


def read_inputs(artifacts: Path) -> ReportInputs:
    """Read what lies under ``artifacts``; only evaluate/trials.parquet has to be there.

    Raises TableError for missing or empty trials, and for any file that is there but damaged or of another version.
    """
    source = artifacts / "evaluate"
    trials = read_trials(source / "trials.parquet")
    if trials.num_rows == 0:
        raise TableError(
            f"{source / 'trials.parquet'} holds no trial, expected at least one: raise the number of start-goal pairs "
            f"in conf/rasterize and run `dvc repro evaluate`."
        )
    missing: list[str] = []

    def found(path: Path, consequence: str) -> bool:
        if not path.is_file():
            missing.append(f"{path.relative_to(artifacts)} is not there: {consequence}.")
        return path.is_file()

    summary = source / "summary.json"
    estimates, episodes = source / "estimates.parquet", source / "episodes.parquet"
    curves, train = artifacts / "train" / "curves.parquet", artifacts / "train" / "train.json"
    harvest = artifacts / "harvest" / "harvest.json"
    return ReportInputs(
        trials=trials,
        estimates=read_estimates(estimates) if found(estimates, "no calibration") else None,
        episodes=read_episodes(episodes) if found(episodes, "no trajectories") else [],
        curves=read_curves(curves) if found(curves, "no training curves") else {},
        evaluate=_read_json(summary) if found(summary, "settings of the slopes are the default ones") else {},
        train=_read_json(train) if found(train, "no training summary") else {},
        harvest=_read_json(harvest) if found(harvest, "no counts of the data set") else {},
        missing=missing,
    )


def _read_json(path: Path) -> dict[str, Any]:
    check_sum(path, f"Run `dvc repro -f {path.parent.name}`.")
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise TableError(f"{path}: not readable JSON ({error}): run `dvc repro -f {path.parent.name}`.") from error
    if not isinstance(content, dict):
        raise TableError(f"{path}: got a JSON {type(content).__name__}, expected an object: run its stage again.")
    return content
