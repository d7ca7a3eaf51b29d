"""Small trial tables for tests: costs by planner, everything else filled in."""

from collections.abc import Mapping, Sequence

import pyarrow as pa

from pipeline.evaluation.trials import TrialRow, trials_table


def trial(trial_id: str, planner: str, cost_m: float, **changes: object) -> TrialRow:
    """Return one row; a trial "b/0" lies in building "b"."""
    row = TrialRow(
        trial_id=trial_id, plan_id=trial_id, building=trial_id.split("/")[0], environment="test_world", split="test",
        planner=planner, cost_m=cost_m, ending="reached", steps=10, decisions=3, seconds=0.5,
        start_x_m=0.0, start_y_m=0.0, goal_x_m=1.0, goal_y_m=1.0,
    )  # fmt: skip
    return row._replace(**changes)  # type: ignore[arg-type]


def table_of(costs: Mapping[str, Sequence[float]]) -> pa.Table:
    """Return the table of planners with their costs [m] on trials plan0/0, plan1/0, ..."""
    return trials_table(
        trial(f"plan{index}/0", planner, cost) for planner, listed in costs.items() for index, cost in enumerate(listed)
    )
