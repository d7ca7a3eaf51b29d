"""Which trials are worth a picture: chosen after all are driven, so that no failure goes unseen."""

from math import inf

import pyarrow as pa

from pipeline.evaluation.trials import BASELINE, LEARNED, REACHED, TrialRow, planners_in, trial_rows


def telling_trials(trials: pa.Table, count: int) -> list[str]:
    """Return up to ``count`` trial ids, sorted: a third the worst losses, a third the best gains, a third typical.

    Trials are ranked by the cost of the learned planner over optimistic's, or of the first other planner where the
    learned one did not drive; a trial that either did not finish counts as worse than any. Typical ones lie in the
    middle of the ranks. Equals are ranked by trial id, so that the choice depends on the table alone.
    """
    names = planners_in(trials)
    judged = LEARNED if LEARNED in names else next((name for name in names if name != BASELINE), BASELINE)
    rows = trial_rows(trials)
    theirs, ours = ({row.trial_id: row for row in rows if row.planner == name} for name in (BASELINE, judged))
    ranked = sorted(ours, key=lambda name: (-_ratio(ours[name], theirs.get(name)), name))
    count = min(count, len(ranked))
    losses = -(-count // 3)
    gains = -(-(count - losses) // 2)
    typical = count - losses - gains
    first = min(max((len(ranked) - typical) // 2, losses), len(ranked) - gains - typical)
    return sorted([*ranked[:losses], *ranked[first : first + typical], *ranked[len(ranked) - gains :]])


def _ratio(ours: TrialRow, theirs: TrialRow | None) -> float:
    if theirs is None or ours.ending != REACHED or theirs.ending != REACHED:
        return inf
    return ours.cost_m / theirs.cost_m if theirs.cost_m > 0.0 else 1.0
