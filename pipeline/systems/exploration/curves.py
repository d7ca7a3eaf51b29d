"""The curves that trials left: area seen over distance travelled, and measures of how fast a map grew."""

from collections.abc import Iterator, Mapping
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from pipeline.evaluation.competitors import Role

SHARES = (0.5, 0.8, 0.95)
"""The measures tell how far these were; each is a whole number of the 200ths that a curve keeps."""

Reals = NDArray[np.float64]


class Curve(NamedTuple):
    """A trial's growth. travelled_m: [n], rising; share: [n], each from its distance on."""

    trial_id: str
    competitor: str
    travelled_m: Reals
    share: Reals

    def at(self, distances_m: Reals) -> Reals:
        """Return the share seen after each of ``distances_m``."""
        places = np.searchsorted(self.travelled_m, distances_m + 1e-9, side="right") - 1
        return np.where(places >= 0, self.share[np.maximum(places, 0)], 0.0)

    def distance_to(self, share: float) -> float | None:
        """Return the distance [m] after which ``share`` had been seen, None where it never was."""
        met = np.flatnonzero(self.share >= share - 1e-12)
        return float(self.travelled_m[met[0]]) if met.size else None

    def mean_until(self, distance_m: float) -> float:
        """Return the mean share over the first ``distance_m``: the area under the curve over its width."""
        inside = self.travelled_m < distance_m
        edges = np.concatenate([self.travelled_m[inside], [distance_m]])
        return float((self.share[inside] * np.diff(edges)).sum() / distance_m)


def curves_in(table: pa.Table) -> Iterator[Curve]:
    """Yield the curves of a growth table, trial by trial."""
    columns = [table.column(name).to_pylist() for name in table.schema.names]
    for (trial, competitor), rows in groupby(zip(*columns, strict=True), key=lambda row: row[:2]):
        points = np.array([(row[2], row[4]) for row in rows])
        yield Curve(trial, competitor, points[:, 0], points[:, 1])


def measure_growth(tables: Mapping[str, pa.Table]) -> dict[str, dict[str, Any]]:
    """Return of each competitor how fast its maps grew; distances in metres, means over trials.

    Keys: distance_to.share_50, _80, _95 and to_end (None where no trial came so far), share_at.25_m and so on, and
    area_under_curve: the mean share over the distance that the baseline took to its end on the same trial.
    """
    curves: dict[str, list[Curve]] = {}
    for curve in curves_in(tables["growth"]):
        curves.setdefault(curve.competitor, []).append(curve)
    trials = tables["trials"]
    roles = dict(zip(trials.column("competitor").to_pylist(), trials.column("role").to_pylist(), strict=True))
    theirs = {
        curve.trial_id: float(curve.travelled_m[-1])
        for name, found in curves.items()
        if roles[name] == Role.baseline
        for curve in found
    }
    marks = _round_distances(float(np.median(list(theirs.values())))) if theirs else []
    return {name: _measure(found, theirs, marks) for name, found in curves.items()}


def _measure(curves: list[Curve], theirs: Mapping[str, float], marks: list[int]) -> dict[str, Any]:
    reached = {f"share_{100 * share:.0f}": [curve.distance_to(share) for curve in curves] for share in SHARES}
    reached["all"] = [curve.distance_to(1.0) for curve in curves]
    shares = np.array([curve.at(np.array(marks, dtype=np.float64)) for curve in curves])
    areas = [curve.mean_until(theirs[curve.trial_id]) for curve in curves if theirs.get(curve.trial_id)]
    return {
        "distance_to": {name: _mean([each for each in found if each is not None]) for name, found in reached.items()},
        "share_at": {f"{mark}_m": float(shares[:, k].mean()) for k, mark in enumerate(marks)},
        "area_under_curve": _mean(areas),
    }


def _mean(values: list[float]) -> float | None:
    return float(np.mean(values)) if values else None


def _round_distances(most_m: float) -> list[int]:
    """Return 10, 25, 50, 100, 250, 500, ... as far as ``most_m`` [m]."""
    series = [round(step * 10**power) for power in range(1, 7) for step in (1, 2.5, 5)]
    return [mark for mark in series if mark <= most_m]
