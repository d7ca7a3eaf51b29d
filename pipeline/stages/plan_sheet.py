"""``hinterland plan sheet``: every plan below a folder on one picture."""

import os
import sys
from argparse import Namespace
from functools import partial
from pathlib import Path

from pipeline.errors import ConfigError, PlanError
from pipeline.floorplans.survey import DataSet, data_sets_in
from pipeline.reports.contact_sheet import Tile, draw_tile, tile_size, write_contact_sheet
from pipeline.stages.parallel import make_all
from pipeline.stages.plan_files import Found, keep_existing, plan_files, read_side_by_side, told_apart
from pipeline.stages.plan_options import in_flags, read_options
from pipeline.stages.plan_survey import options_for
from pipeline.stages.reading import unused_in


def sheet(given: Namespace) -> int:
    """Write the picture, or one for each data set; what cannot be used is named on stderr. Return 1 where it was all.

    Raises:
        PlanError, ConfigError: nothing there, no usable plan, or a picture that is there already.
    """
    root, out = Path(given.source), Path(given.out)
    common = DataSet(reader=given.reader, options=read_options(given))
    if not given.data_sets:
        if given.options:
            raise ConfigError("--options: it is for --data-sets. For one sheet say it with --scale, --invert, ...")
        if out.suffix.lower() != ".png":
            raise ConfigError(f"{out}: a contact sheet is a PNG. Give it a name that ends in .png.")
        keep_existing([out], force=given.force)
        _draw(root, out, common, given)
        return 0
    places = data_sets_in(root)
    options = options_for(places, given.options)
    targets = [out / f"{place.resolve().name}.png" for place in places]
    keep_existing(targets, force=given.force)
    drawn = 0
    for place, target in zip(places, targets, strict=True):
        try:
            _draw(place, target, options.get(place.name, common), given)
            drawn += 1
        except PlanError as problem:
            print(f"error: {in_flags(str(problem))}", file=sys.stderr)
    return int(drawn == 0)


def _draw(root: Path, out: Path, data_set: DataSet, given: Namespace) -> None:
    workers, shown = given.workers or os.cpu_count() or 1, not given.quiet
    with plan_files(root, data_set.reader) as entries:
        unused = unused_in(entries, data_set.options)
        read = read_side_by_side(entries, data_set.options, workers=workers, shown=shown, limit=given.limit)
    found = told_apart([each for each in read if isinstance(each, Found)])
    problems = [in_flags(str(each)) for each in read if isinstance(each, PlanError)]
    if not found:
        raise PlanError(f"{root}: none of {len(problems)} plans is usable; the first: {problems[0]}")
    for sentence in unused:
        print(in_flags(sentence), file=sys.stderr)
    for problem in problems:
        print(f"left out: {problem}", file=sys.stderr)
    tiles, _ = make_all(
        partial(_draw_one, side=tile_size(len(found))),
        [(each.plan.plan_id, each) for each in found],
        on_error="stop",
        workers=workers,
        label="tiles",
        progress=shown,
    )
    name = root.resolve().name
    write_contact_sheet(tiles, out, title=f"{name}: {_plans(len(found))}")
    left_out = f", {_plans(len(problems))} left out" if problems else ""
    print(f"{out}: {_plans(len(found))}{left_out}")


def _draw_one(found: Found, *, side: int) -> Tile:
    return draw_tile(found.plan, side)


def _plans(count: int) -> str:
    return f"{count} {'plan' if count == 1 else 'plans'}"
