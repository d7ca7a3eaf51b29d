"""``hinterland plan statistics``: what floors are like in numbers, generated campus floors beside real ones."""

from argparse import Namespace
from collections.abc import Iterator
from pathlib import Path

from pipeline.errors import PlanError
from pipeline.floorplans.generators.campus import CampusShape, draw_campus
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers import PLAN, classify, read_plans
from pipeline.floorplans.sources import open_source
from pipeline.floorplans.statistics import compare, floor_statistics
from pipeline.randomness import stream


def statistics(given: Namespace) -> int:
    """Print a table: a column for generated floors, and one for the floors below each folder.

    Raises:
        PlanError: no such folder, or a floor on which no room is marked.
    """
    columns = {"campus": [floor_statistics(plan) for plan in _draw_floors(given.seed, given.floors)]}
    for folder in given.sources:
        columns[folder] = [floor_statistics(plan) for plan in _read_floors(Path(folder), given.floors)]
    print(compare(columns))
    return 0


def _draw_floors(seed: int, count: int) -> Iterator[FloorPlan]:
    for name in (f"campus-{k}" for k in range(count)):
        yield draw_campus(CampusShape(), stream(seed, name), plan_id=name)


def _read_floors(root: Path, most: int) -> Iterator[FloorPlan | GridPlan]:
    """Yield one plan of each floor below ``root``, the first by name, at most ``most``; what is no plan is left out."""
    seen: set[str] = set()
    with open_source(root) as files:
        for entry in classify(files):
            if entry.role != PLAN or entry.reader is None:
                continue
            for plan in read_plans(entry.file, entry.reader):
                if len(seen) >= most:
                    return
                if not isinstance(plan, PlanError) and plan.floor not in seen:
                    seen.add(plan.floor)
                    yield plan
