"""Which trials are worth a picture: chosen after all are driven, so that no failure goes unseen."""

from math import inf

import pyarrow as pa

from pipeline.evaluation.competitors import Role
from pipeline.evaluation.trials import FINISHED, TrialRow, competitors_in, trial_rows


def telling_trials(trials: pa.Table, count: int) -> list[str]:
    """Return up to ``count`` trial ids, sorted: a third the worst losses, a third the best gains, a third typical.

    Trials are ranked by the cost of the first candidate over the baseline's, or of the first bound where there is no
    candidate; a trial that either did not finish counts as worse than any. Typical ones lie in the middle of the ranks.
    Equals are ranked by trial id, so that the choice depends on the table alone.
    """
    entries = competitors_in(trials)
    baseline = next((entry.name for entry in entries if entry.role == Role.baseline), "")
    judged = next((entry.name for entry in entries if entry.name != baseline), baseline)
    rows = trial_rows(trials)
    theirs, ours = ({row.trial_id: row for row in rows if row.competitor == name} for name in (baseline, judged))
    ranked = sorted(ours, key=lambda name: (-_ratio(ours[name], theirs.get(name)), name))
    count = min(count, len(ranked))
    losses = -(-count // 3)
    gains = -(-(count - losses) // 2)
    typical = count - losses - gains
    first = min(max((len(ranked) - typical) // 2, losses), len(ranked) - gains - typical)
    return sorted([*ranked[:losses], *ranked[first : first + typical], *ranked[len(ranked) - gains :]])


def _ratio(ours: TrialRow, theirs: TrialRow | None) -> float:
    if theirs is None or ours.ending not in FINISHED or theirs.ending not in FINISHED:
        return inf
    return ours.cost_m / theirs.cost_m if theirs.cost_m > 0.0 else 1.0
