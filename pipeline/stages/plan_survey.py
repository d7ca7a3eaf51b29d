"""``hinterland plan survey``: a table of what each data set below a folder holds."""

import os
from argparse import Namespace
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from pipeline.errors import ConfigError, PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers import Classified
from pipeline.floorplans.survey import DataSet, FileTally, Loss, ReadFile, data_sets_in, survey_one, survey_table
from pipeline.grids.lost_area import MUCH_LOST, lost_area, say_lost
from pipeline.grids.rasterize import rasterize
from pipeline.stages.parallel import make_all
from pipeline.stages.plan_options import data_sets_from, in_flags


def survey(given: Namespace) -> int:
    """Print the table and every failure; files are read side by side.

    Raises:
        PlanError, ConfigError: no such folder, or options for a data set that is not there.
    """
    root = Path(given.source)
    places = data_sets_in(root)
    options = options_for(places, given.options)
    measure = (
        partial(loss_of, resolution=given.resolution, robot_radius=given.robot_radius) if given.resolution else None
    )
    rows = []
    for place in places:

        def spread(read: ReadFile, entries: Sequence[Classified], label: str = place.name) -> list[FileTally]:
            tasks = [(str(entry.file.original), entry) for entry in entries]
            workers = given.workers or os.cpu_count() or 1
            tallies, _ = make_all(
                read, tasks, on_error="stop", workers=workers, label=label, progress=not given.quiet and bool(tasks)
            )
            return tallies

        rows.append(survey_one(place, options.get(place.name, DataSet()), spread=spread, measure=measure))
    print(survey_table(rows))
    return 0


def loss_of(plan: FloorPlan | GridPlan, *, resolution: float, robot_radius: float) -> Loss:
    """Return how much of a plan a robot of ``robot_radius`` [m] loses on cells of ``resolution`` [m].

    The cells of a grid plan are taken together to the nearest whole multiple of their own side.
    """
    if isinstance(plan, GridPlan):
        resolution = max(1, round(resolution / plan.resolution)) * plan.resolution
    try:
        grid = rasterize(plan, resolution, doors_from_m=2 * robot_radius)
    except (PlanError, ConfigError) as problem:
        return Loss(1.0, f"plan {plan.plan_id} is lost: {in_flags(str(problem))}")
    lost = lost_area(plan, grid, robot_radius)
    return Loss(lost.share, in_flags(say_lost(plan.plan_id, resolution, lost)) if lost.share > MUCH_LOST else "")


def options_for(places: Sequence[Path], file: str | None) -> dict[str, DataSet]:
    """Return how to read the data sets at ``places``, from a YAML file; empty without one.

    Raises:
        ConfigError: the file names a data set that is not among them, or says something impossible.
    """
    options = data_sets_from(Path(file)) if file else {}
    names = [place.name for place in places]
    unknown = [name for name in options if name not in names]
    if unknown:
        raise ConfigError(f"{file}: no data set is named {unknown[0]}; there are {', '.join(names[:20])}.")
    return options
