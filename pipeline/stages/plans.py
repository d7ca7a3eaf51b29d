"""Plans: draw them with a generator, or read real floors; check each and write them to one table."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from omegaconf import DictConfig

from pipeline.errors import ConfigError, PlanError, one_line
from pipeline.files import write_json
from pipeline.floorplans.checks import Checked, inspect
from pipeline.floorplans.generators import GENERATORS
from pipeline.floorplans.generators.campus import CampusShape
from pipeline.floorplans.generators.clutter import ClutterShape, add_clutter
from pipeline.floorplans.generators.forest import ForestShape
from pipeline.floorplans.generators.guided_maze import MazeShape
from pipeline.floorplans.generators.office import OfficeShape
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers import READERS
from pipeline.floorplans.store import write_plans
from pipeline.grids.splits import SPLITS
from pipeline.randomness import stream
from pipeline.stages.door import StageResult, Workspace, launch, typed, workspace
from pipeline.stages.parallel import ON_ERROR, Refused, make_all
from pipeline.stages.reading import ReadConfig, read_all
from pipeline.stages.settings import require

FILES = "files"
SOURCES = (*GENERATORS, FILES)


@dataclass(frozen=True, kw_only=True)
class SplitCounts:
    """A whole number for each split."""

    train: int = 0
    validation: int = 0
    test: int = 0


@dataclass(frozen=True, kw_only=True)
class PlansConfig:
    """Where floor plans come from (conf/plans/)."""

    source: str = "guided_maze"
    """A generator draws them; files reads them."""
    counts: SplitCounts = field(default_factory=SplitCounts)
    """Plans to draw for each split."""
    maze: MazeShape = field(default_factory=MazeShape)
    forest: ForestShape = field(default_factory=ForestShape)
    office: OfficeShape = field(default_factory=OfficeShape)
    campus: CampusShape = field(default_factory=CampusShape)
    root: str | None = None
    """Folder, file or archive to read, relative to the working directory; asked for where files are read."""
    reader: str | None = None
    """Format of the files; null looks into each file."""
    glob: str = "*"
    """Only files whose name matches."""
    limit: int | None = None
    """Read at most so many files, the first by name; null reads all."""
    on_error: str = "stop"
    """stop: a bad file or plan ends the run; skip: it is named in rejected.json and left out."""
    read: ReadConfig = field(default_factory=ReadConfig)
    """What the files do not say themselves: scale, polarity, thresholds."""
    clutter: ClutterShape = field(default_factory=lambda: ClutterShape(per_m2=0.0))
    """Furniture put at random on every plan, drawn or read; per_m2 = 0 leaves the plans as they are."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(self.source in SOURCES, "plans.source", self.source, f"one of {', '.join(SOURCES)}")
        require(self.on_error in ON_ERROR, "plans.on_error", self.on_error, f"one of {', '.join(ON_ERROR)}")
        require(self.limit is None or self.limit > 0, "plans.limit", self.limit, "null or at least 1")
        readers = f"null or one of {', '.join(READERS)}"
        require(self.reader is None or self.reader in READERS, "plans.reader", self.reader, readers)
        if self.source != FILES:
            drawn = [getattr(self.counts, split) for split in SPLITS]
            require(min(drawn) >= 0 and sum(drawn) > 0, "plans.counts", self.counts, "at least one plan, none below 0")


def plans(raw: DictConfig) -> StageResult:
    """Write ``artifacts/plans``: plans.parquet, and rejected.json with the files that were left out.

    Raises:
        PlanError: no file, no usable plan, two plans of one name, or a bad file where plans.on_error is "stop".
    """
    config, work = typed(PlansConfig, raw, "plans"), workspace(raw)
    checked, rejected = _read(config, work) if config.source == FILES else _draw(config, work)
    if not checked:
        raise PlanError(
            f"plans.root = {config.root}: none of {len(rejected)} files is usable; the first: {rejected[0].reason}"
        )
    _refuse_doubles([plan for plan, _ in checked])
    checked = _furnish(checked, config.clutter, work)
    folder = work.folder("plans")
    write_plans(folder / "plans.parquet", checked)
    write_json(folder / "rejected.json", [{"file": bad.name, "reason": bad.reason} for bad in rejected])
    return _summarise(folder, checked, rejected)


def _draw(config: PlansConfig, work: Workspace) -> tuple[list[Checked], list[Refused]]:
    section = GENERATORS[config.source].section
    names = [(split, f"{section}-{split}-{k:05d}") for split in SPLITS for k in range(getattr(config.counts, split))]
    tasks = [(plan_id, (split, plan_id)) for split, plan_id in names]
    draw = partial(_draw_one, source=config.source, shape=getattr(config, section), seed=work.seed)
    return make_all(draw, tasks, on_error="stop", workers=work.workers, label="plans", progress=work.progress)


def _draw_one(name: tuple[str, str], *, source: str, shape: Any, seed: int) -> Checked:
    split, plan_id = name
    plan = GENERATORS[source].draw(shape, stream(seed, "plans", plan_id), plan_id=plan_id, split=split)
    return Checked(plan, inspect(plan))


def _read(config: PlansConfig, work: Workspace) -> tuple[list[Checked], list[Refused]]:
    if not config.root:
        raise ConfigError("plans.root is not given: expected the folder or file to read. Add plans.root=/data/floors")
    return read_all(
        Path(config.root),
        reader=config.reader,
        options=config.read.options(),
        glob=config.glob,
        limit=config.limit,
        on_error=config.on_error,
        work=work,
    )


def _furnish(checked: Sequence[Checked], clutter: ClutterShape, work: Workspace) -> list[Checked]:
    if not clutter.per_m2:
        return list(checked)
    furnish = partial(_furnish_one, clutter=clutter, seed=work.seed)
    tasks = [(plan.plan_id, plan) for plan, _ in checked]
    furnished, _ = make_all(
        furnish, tasks, on_error="stop", workers=work.workers, label="clutter", progress=work.progress
    )
    return furnished


def _furnish_one(plan: FloorPlan | GridPlan, *, clutter: ClutterShape, seed: int) -> Checked:
    """Put furniture on one plan; its seed is apart from the plan's, so that the walls stay what they were."""
    rng = stream(seed, "clutter", plan.plan_id)
    furnished = add_clutter(plan, clutter, rng)
    return Checked(furnished, inspect(furnished))


def _refuse_doubles(found: Sequence[FloorPlan | GridPlan]) -> None:
    sources: dict[str, str] = {}
    for plan in found:
        if plan.plan_id in sources:
            raise PlanError(
                f"two plans are named {plan.plan_id}: {sources[plan.plan_id]} and {plan.source}. Rename one of them."
            )
        sources[plan.plan_id] = plan.source


def _summarise(folder: Path, checked: Sequence[Checked], rejected: Sequence[Refused]) -> StageResult:
    warned = [(plan.plan_id, report.warnings) for plan, report in checked if report.warnings]
    buildings = len({plan.building for plan, _ in checked})
    print(
        f"plans: {len(checked)} of {buildings} buildings, {len(warned)} with warnings, {len(rejected)} files rejected"
    )
    for bad in rejected:
        print(f"  rejected: {one_line(bad.reason)}")
    metrics = {"plans": len(checked), "buildings": buildings, "warned": len(warned), "rejected": len(rejected)}
    return StageResult(
        metrics={name: float(value) for name, value in metrics.items()},
        files=[folder / "rejected.json"],
    )


if __name__ == "__main__":
    launch("plans", plans)
