"""Small trial tables for tests: costs by competitor, everything else filled in."""

from collections.abc import Mapping, Sequence

import pyarrow as pa

from pipeline.evaluation.trials import TrialRow, trials_table

# Role and place of the competitors that the tests compare; any other name is a candidate after them.
ROLES = {"optimistic": ("baseline", 0), "learned": ("candidate", 1), "perfect": ("bound", 8), "known_map": ("bound", 9)}

TITLES = {"perfect": "perfect estimates"}


def trial(trial_id: str, competitor: str, cost_m: float, **changes: object) -> TrialRow:
    """Return one row; a trial "b/0" lies in building "b"."""
    role, place = ROLES.get(competitor, ("candidate", 2))
    row = TrialRow(
        trial_id=trial_id, plan_id=trial_id, building=trial_id.split("/")[0], environment="test_world", split="test",
        competitor=competitor, role=role, title=TITLES.get(competitor, competitor.replace("_", " ")), place=place,
        cost_m=cost_m, ending="reached", steps=10, decisions=3, seconds=0.5,
        start_x_m=0.0, start_y_m=0.0, goal_x_m=1.0, goal_y_m=1.0,
    )  # fmt: skip
    return row._replace(**changes)  # type: ignore[arg-type]


def table_of(costs: Mapping[str, Sequence[float]]) -> pa.Table:
    """Return the table of competitors with their costs [m] on trials plan0/0, plan1/0, ..."""
    return trials_table(
        trial(f"plan{index}/0", name, cost) for name, listed in costs.items() for index, cost in enumerate(listed)
    )
