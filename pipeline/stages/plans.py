"""Plans: draw guided mazes, or read real floors; check each and write them to one table."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from omegaconf import DictConfig

from pipeline.errors import ConfigError, PlanError
from pipeline.files import write_json
from pipeline.floorplans.checks import PlanReport, inspect
from pipeline.floorplans.guided_maze import MazeShape, draw_guided_maze
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers import READERS, find_plan_files, read_plan_file
from pipeline.floorplans.store import write_plans
from pipeline.grids.splits import SPLITS
from pipeline.randomness import stream
from pipeline.stages.door import StageResult, Workspace, launch, typed, workspace
from pipeline.stages.parallel import ON_ERROR, Refused, make_all
from pipeline.stages.settings import require

Checked = tuple[FloorPlan | GridPlan, PlanReport]

SOURCES = ("guided_maze", "files")


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
    """guided_maze draws them, files reads them."""
    counts: SplitCounts = field(default_factory=SplitCounts)
    """Mazes to draw for each split."""
    maze: MazeShape = field(default_factory=MazeShape)
    root: str | None = None
    """Folder (or one file) to read, relative to the working directory; the stage asks for it where files are read."""
    reader: str | None = None
    """Format of the files; null looks into each file."""
    glob: str = "*"
    """Only files whose name matches."""
    limit: int | None = None
    """Read at most so many files, the first by name; null reads all."""
    on_error: str = "stop"
    """stop: a bad file ends the run; skip: it is named in rejected.json and left out."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(self.source in SOURCES, "plans.source", self.source, f"one of {', '.join(SOURCES)}")
        require(self.on_error in ON_ERROR, "plans.on_error", self.on_error, f"one of {', '.join(ON_ERROR)}")
        require(self.limit is None or self.limit > 0, "plans.limit", self.limit, "null or at least 1")
        readers = f"null or one of {', '.join(READERS)}"
        require(self.reader is None or self.reader in READERS, "plans.reader", self.reader, readers)
        if self.source == "guided_maze":
            drawn = [getattr(self.counts, split) for split in SPLITS]
            require(min(drawn) >= 0 and sum(drawn) > 0, "plans.counts", self.counts, "at least one maze, none below 0")


def plans(raw: DictConfig) -> StageResult:
    """Write ``artifacts/plans``: plans.parquet, and rejected.json with the files that were left out.

    Raises:
        PlanError: no file, no usable plan, two plans of one name, or a bad file where plans.on_error is "stop".
    """
    config, work = typed(PlansConfig, raw, "plans"), workspace(raw)
    checked, rejected = _draw(config, work) if config.source == "guided_maze" else _read(config, work)
    if not checked:
        raise PlanError(
            f"plans.root = {config.root}: none of {len(rejected)} files is usable; the first: {rejected[0].reason}"
        )
    _refuse_doubles([plan for plan, _ in checked])
    folder = work.folder("plans")
    write_plans(folder / "plans.parquet", checked)
    write_json(folder / "rejected.json", [{"file": bad.name, "reason": bad.reason} for bad in rejected])
    return _summarise(folder, checked, rejected)


def _draw(config: PlansConfig, work: Workspace) -> tuple[list[Checked], list[Refused]]:
    names = [(split, f"maze-{split}-{k:05d}") for split in SPLITS for k in range(getattr(config.counts, split))]
    tasks = [(plan_id, (split, plan_id)) for split, plan_id in names]
    draw = partial(_draw_one, shape=config.maze, seed=work.seed)
    return make_all(draw, tasks, on_error="stop", workers=work.workers, label="plans", progress=work.progress)


def _draw_one(name: tuple[str, str], *, shape: MazeShape, seed: int) -> Checked:
    split, plan_id = name
    plan = draw_guided_maze(shape, stream(seed, "plans", plan_id), plan_id=plan_id, split=split)
    return plan, inspect(plan)


def _read(config: PlansConfig, work: Workspace) -> tuple[list[Checked], list[Refused]]:
    if not config.root:
        raise ConfigError("plans.root is not given: expected the folder or file to read. Add plans.root=/data/floors")
    root = Path(config.root)
    files = [path for path in find_plan_files(root, config.reader) if path.match(config.glob)][: config.limit]
    if not files:
        raise PlanError(f"plans.glob = {config.glob}: no file below {root} has such a name. Change it in conf/plans/.")
    read = partial(_read_one, reader=config.reader)
    tasks = [(str(path), path) for path in files]
    found, rejected = make_all(
        read, tasks, on_error=config.on_error, workers=work.workers, label="plans", progress=work.progress
    )
    return [checked for of_file in found for checked in of_file], rejected


def _read_one(path: Path, *, reader: str | None) -> list[Checked]:
    checked = []
    for plan in read_plan_file(path, reader):
        if isinstance(plan, PlanError):
            raise plan
        checked.append((plan, inspect(plan)))
    return checked


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
        print(f"  rejected: {bad.reason}")
    metrics = {"plans": len(checked), "buildings": buildings, "warned": len(warned), "rejected": len(rejected)}
    return StageResult(
        metrics={name: float(value) for name, value in metrics.items()},
        files=[folder / "rejected.json"],
    )


if __name__ == "__main__":
    launch("plans", plans)
