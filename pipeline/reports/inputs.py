"""What a report is made of: the files of earlier stages. Optional ones may be missing; the page then says so."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa

from pipeline.errors import TableError
from pipeline.evaluation.summary import SUMMARY_VERSION
from pipeline.evaluation.trials import EpisodeRow, digest, read_episodes, read_trials
from pipeline.files import check_sum, digest_file
from pipeline.reports.training import Curves, read_curves


@dataclass(frozen=True, kw_only=True)
class ReportInputs:
    """Contents of artifacts/{evaluate, train, harvest}.

    folder: the artifacts, for side tables that only a system knows. summary: of the evaluate stage.
    harvest, train: the JSON of those stages, empty where missing. missing: a sentence for each file that is not there
    and for each stage that the system has no part for; what lies in its folder is then another system's, and not read.
    elsewhere: networks drove and none is of this run's training; what that may have left behind is not read then.
    """

    folder: Path
    trials: pa.Table
    episodes: list[EpisodeRow] = field(default_factory=list)
    curves: Curves = field(default_factory=dict)
    summary: dict[str, Any] = field(default_factory=dict)
    train: dict[str, Any] = field(default_factory=dict)
    harvest: dict[str, Any] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)
    elsewhere: bool = False


def read_inputs(artifacts: Path) -> ReportInputs:
    """Read what lies under ``artifacts``; trials and summary of the evaluate stage have to be there.

    Raises TableError for missing or empty trials, a summary of other trials, and for any file that is there but damaged
    or of another version.
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
        if elsewhere and path.parent != source:
            return False
        if not path.is_file():
            missing.append(f"{path.relative_to(artifacts)} is not there: {consequence}.")
        return path.is_file()

    summary = _read_json(source / "summary.json")
    if summary.get("version") != SUMMARY_VERSION or summary.get("digest") != digest(trials):
        raise TableError(
            f"{source / 'summary.json'} is of version {summary.get('version')} or of other trials than those beside "
            f"it, expected version {SUMMARY_VERSION} of these: run `dvc repro -f evaluate`."
        )
    in_order = sorted(summary["competitors"].items(), key=lambda entry: int(entry[1]["place"]))
    summary["competitors"] = dict(in_order)  # JSON sorts by name
    elsewhere = _trained_elsewhere(summary, artifacts / "train")

    def part(stage: str, consequence: str) -> dict[str, Any]:
        """Return the summary of a stage; empty where it is not there, or where the system has no part for the stage."""
        path = artifacts / stage / f"{stage}.json"
        content = _read_json(path) if found(path, consequence) else {}
        if why := content.get("nothing"):
            missing.append(f"{stage}: {why}.")
            content = {}
            without.add(stage)
        return content

    without: set[str] = set()
    train = part("train", "no training summary")
    episodes = source / "episodes.parquet"
    curves = artifacts / "train" / "curves.parquet"
    return ReportInputs(
        folder=artifacts,
        trials=trials,
        episodes=read_episodes(episodes) if found(episodes, "no trajectories") else [],
        curves=read_curves(curves) if "train" not in without and found(curves, "no training curves") else {},
        summary=summary,
        train=train,
        harvest=part("harvest", "no counts of the data set"),
        missing=missing,
        elsewhere=elsewhere,
    )


def _trained_elsewhere(summary: dict[str, Any], folder: Path) -> bool:
    """Return whether networks drove, none of which lies in the ``folder`` of this run's training."""
    driven = {digest for found in summary["competitors"].values() if (digest := found.get("weights"))}
    return bool(driven) and driven.isdisjoint(map(digest_file, folder.glob("*.safetensors")))


def _read_json(path: Path) -> dict[str, Any]:
    check_sum(path, f"Run `dvc repro -f {path.parent.name}`.")
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise TableError(f"{path}: not readable JSON ({error}): run `dvc repro -f {path.parent.name}`.") from error
    if not isinstance(content, dict):
        raise TableError(f"{path}: got a JSON {type(content).__name__}, expected an object: run its stage again.")
    return content
