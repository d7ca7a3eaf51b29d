"""Floor plans from files, each checked: the one way in which stages and commands read them."""

from collections.abc import Iterator

from pipeline.errors import PlanError
from pipeline.floorplans.checks import Checked, inspect
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers import Classified, ReadOptions, read_plans


def read_checked(entry: Classified, options: ReadOptions) -> Iterator[Checked | PlanError]:
    """Yield each plan of a file, or the error that refuses it or what is left of the file; no PlanError is raised."""
    if entry.problem is not None or entry.reader is None:
        yield entry.problem or PlanError(f"{entry.file.original}: not recognised.")
        return
    try:
        for plan in read_plans(entry.file, entry.reader, options):
            yield plan if isinstance(plan, PlanError) else _check(plan)
    except PlanError as problem:
        yield problem


def _check(plan: FloorPlan | GridPlan) -> Checked | PlanError:
    try:
        return Checked(plan, inspect(plan))
    except PlanError as problem:
        return problem
