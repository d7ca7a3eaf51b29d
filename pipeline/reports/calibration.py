"""The reliability diagram of P_S: what the network said against how often it was so."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from pipeline.reports.style import BLUE, INK, MUTED, dress, new_figure


def draw_reliability(estimates: dict[str, Any]) -> Figure:
    """Return the reliability diagram of ``summary["estimates"]``, with the number of estimates per bin beneath."""
    bins = [row for row in estimates["bins"] if row["count"]]
    predicted = np.array([row["predicted"] for row in bins])
    observed = np.array([row["observed"] for row in bins])
    spread = np.abs(np.array([[row["observed_low"], row["observed_high"]] for row in bins]).T - observed)
    figure = new_figure(5.4, 6.0)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[4, 1])
    upper.plot([0, 1], [0, 1], color=MUTED, linestyle="--", linewidth=1.0, label="perfectly calibrated")
    upper.errorbar(predicted, observed, yerr=spread, color=BLUE, marker="o", capsize=3, linewidth=1.6, label="network")
    score = f"ECE {estimates['ece']:.3f}\nBrier {estimates['brier']:.3f}"
    if estimates["auc"] is not None:
        score += f"\nAUC {estimates['auc']:.3f}"
    upper.text(0.97, 0.05, score, transform=upper.transAxes, ha="right", va="bottom", color=INK, fontsize=10)
    upper.set(xlim=(0, 1), ylim=(0, 1))
    dress(upper, x="", y="share that leads to the goal")
    upper.legend(loc="upper left", fontsize=9, frameon=False)
    every = estimates["bins"]
    lower.bar(
        [row["low"] for row in every], [row["count"] for row in every],
        width=0.92 / len(every), align="edge", color=BLUE, alpha=0.6,
    )  # fmt: skip
    dress(lower, x="predicted $P_S$", y="estimates")
    return figure
