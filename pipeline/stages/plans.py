"""Plans: draw them with a generator, or read real floors; check each and write them to one table."""

import re
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
from pipeline.floorplans.generators.own import draw_own, find_generator
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.readers.own import find_reader
from pipeline.floorplans.store import write_plans
from pipeline.grids.splits import SPLITS
from pipeline.randomness import stream
from pipeline.settings import require
from pipeline.stages.door import StageResult, Workspace, launch, typed, workspace
from pipeline.stages.parallel import ON_ERROR, Refused, make_all
from pipeline.stages.reading import ReadConfig, name_apart, read_all
from pipeline.stages.roots import KEY, Root, RootsConfig, sent_to, set_aside, whole_buildings

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
    """A generator draws them, ours by name or your own as package.module:function; files reads them."""
    source_settings: dict[str, Any] = field(default_factory=dict)
    """Of a generator of your own, typed by itself."""
    counts: SplitCounts = field(default_factory=SplitCounts)
    """Plans to draw for each split."""
    maze: MazeShape = field(default_factory=MazeShape)
    forest: ForestShape = field(default_factory=ForestShape)
    office: OfficeShape = field(default_factory=OfficeShape)
    campus: CampusShape = field(default_factory=CampusShape)
    root: str | None = None
    """Folder, file or archive to read, relative to the working directory; asked for where files are read."""
    roots: RootsConfig = field(default_factory=RootsConfig)
    """Instead of root: what to read for each split."""
    validation_share: float = 0.2
    """Of the floors of roots.train, whole buildings, set aside where roots.validation is null; 0 sets none aside."""
    split: str | None = None
    """Sends all plans to this split, whatever they say; null: what says nothing is divided by rasterize.shares."""
    reader: str | None = None
    """Format of the files, or a reader of your own as package.module:class; null looks into each file."""
    reader_settings: dict[str, Any] = field(default_factory=dict)
    """Of a reader of your own, typed by itself."""
    glob: str = "*"
    """Only files whose name matches."""
    limit: int | None = None
    """Read at most so many files of each root, the first by name; null reads all."""
    on_error: str = "stop"
    """stop: a bad file or plan ends the run; skip: it is named in rejected.json and left out."""
    read: ReadConfig = field(default_factory=ReadConfig)
    """What the files do not say themselves: scale, polarity, thresholds."""
    clutter: ClutterShape = field(default_factory=lambda: ClutterShape(per_m2=0.0))
    """Furniture put at random on every plan, drawn or read; per_m2 = 0 leaves the plans as they are."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        if ":" in self.source:
            find_generator(self.source, self.source_settings)
        else:
            known = f"one of {', '.join(SOURCES)}, or your own as package.module:function"
            require(self.source in SOURCES, "plans.source", self.source, known)
            unread = "nothing, since this source is one of ours and has sections of its own"
            require(not self.source_settings, "plans.source_settings", self.source_settings, unread)
        require(self.on_error in ON_ERROR, "plans.on_error", self.on_error, f"one of {', '.join(ON_ERROR)}")
        require(self.limit is None or self.limit > 0, "plans.limit", self.limit, "null or at least 1")
        find_reader(self.reader, self.reader_settings)
        self._check_splits()
        if self.source != FILES:
            drawn = [getattr(self.counts, split) for split in SPLITS]
            require(min(drawn) >= 0 and sum(drawn) > 0, "plans.counts", self.counts, "at least one plan, none below 0")

    def _check_splits(self) -> None:
        roots = self.roots.listed()
        require(
            self.split is None or self.split in SPLITS, "plans.split", self.split, f"null or one of {', '.join(SPLITS)}"
        )
        require(0 <= self.validation_share < 1, "plans.validation_share", self.validation_share, "from 0 to below 1")
        if roots:
            shown = ", ".join(f"{root.split}: {root.path}" for root in roots)
            require(self.source == FILES, "plans.roots", shown, f"null for each split where plans.source={self.source}")
            require(not self.root, "plans.roots", shown, f"null for each split where plans.root={self.root}")
            require(self.split is None, "plans.split", self.split, "null where plans.roots give each plan its split")


def plans(raw: DictConfig) -> StageResult:
    """Write ``artifacts/plans``: plans.parquet, and rejected.json with the files that were left out.

    Raises:
        PlanError: no file, no usable plan, two plans of one name, or a bad file where plans.on_error is "stop".
    """
    config, work = typed(PlansConfig, raw, "plans"), workspace(raw)
    checked, rejected = _read(config, work) if config.source == FILES else _draw(config, work)
    if not checked:
        raise PlanError(f"{_said(config)}: none of {len(rejected)} files is usable; the first: {rejected[0].reason}")
    _refuse_doubles([plan for plan, _ in checked])
    checked = sent_to(config.split, checked, "plans.split") if config.split else whole_buildings(checked)
    if config.roots.train and not config.roots.validation and config.validation_share:
        checked = set_aside(checked, config.validation_share, work.seed)
    checked = _furnish(checked, config.clutter, work)
    folder = work.folder("plans")
    write_plans(folder / "plans.parquet", checked)
    write_json(folder / "rejected.json", [{"file": bad.name, "reason": bad.reason} for bad in rejected])
    return _summarise(folder, checked, rejected)


def _draw(config: PlansConfig, work: Workspace) -> tuple[list[Checked], list[Refused]]:
    own = ":" in config.source
    section = re.split("[.:]", config.source)[-2] if own else GENERATORS[config.source].section
    names = [(split, f"{section}-{split}-{k:05d}") for split in SPLITS for k in range(getattr(config.counts, split))]
    tasks = [(plan_id, (split, plan_id)) for split, plan_id in names]
    shape = config.source_settings if own else getattr(config, section)
    draw = partial(_draw_one, source=config.source, shape=shape, seed=work.seed)
    return make_all(draw, tasks, on_error="stop", workers=work.workers, label="plans", progress=work.progress)


def _draw_one(name: tuple[str, str], *, source: str, shape: Any, seed: int) -> Checked:
    split, plan_id = name
    rng = stream(seed, "plans", plan_id)
    if ":" in source:
        plan = draw_own(*find_generator(source, shape), rng, plan_id=plan_id, split=split)
    else:
        plan = GENERATORS[source].draw(shape, rng, plan_id=plan_id, split=split)
    return Checked(plan, inspect(plan))


def _read(config: PlansConfig, work: Workspace) -> tuple[list[Checked], list[Refused]]:
    roots = config.roots.listed() or [Root(Path(config.root or ""))]
    if not config.root and roots[0].split is None:
        raise ConfigError("plans.root is not given: expected the folder or file to read. Add plans.root=/data/floors")
    named: list[tuple[str, Checked]] = []
    rejected: list[Refused] = []
    for root in roots:
        found, refused = _read_root(root, config, work)
        names, checked = [name for name, _ in found], [each for _, each in found]
        if root.split is not None:
            names = [
                f"{root.path.absolute().as_posix()}/{name}" for name in names
            ]  # equal ids are told by their folders
            checked = sent_to(root.split, checked, f"{KEY}.{root.split}")
        named += zip(names, checked, strict=True)
        rejected += refused
    return name_apart(named), rejected


def _read_root(root: Root, config: PlansConfig, work: Workspace) -> tuple[list[tuple[str, Checked]], list[Refused]]:
    try:
        return read_all(
            root.path,
            reader=find_reader(config.reader, config.reader_settings),
            options=config.read.options(),
            glob=config.glob,
            limit=config.limit,
            on_error=config.on_error,
            work=work,
        )
    except PlanError as problem:
        if root.split is None:
            raise
        raise PlanError(str(problem).replace("plans.root = ", f"{KEY}.{root.split} = ", 1)) from problem


def _said(config: PlansConfig) -> str:
    """Return where the plans were sought, as messages name it."""
    roots = config.roots.listed()
    return f"{KEY} = {', '.join(str(root.path) for root in roots)}" if roots else f"plans.root = {config.root}"


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
