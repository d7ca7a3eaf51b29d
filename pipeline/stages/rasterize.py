"""Rasterize: floor plans become occupancy grids, each in one split, with start-goal pairs."""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from statistics import median
from typing import NamedTuple

from omegaconf import DictConfig

from pipeline.errors import PlanError, one_line
from pipeline.files import write_json
from pipeline.floorplans.checks import Checked
from pipeline.floorplans.plan import FloorPlan, GridPlan
from pipeline.floorplans.store import read_plans
from pipeline.grids.layers import layers_of
from pipeline.grids.lost_area import MUCH_LOST, LostArea, lost_area, say_lost
from pipeline.grids.occupancy import OccupancyGrid, Point
from pipeline.grids.rasterize import check_doors
from pipeline.grids.rasterize import rasterize as rasterize_plan
from pipeline.grids.sampling import Ends, ends_between, largest_component, sample_ends, traversable_cells
from pipeline.grids.splits import SPLITS, split_buildings
from pipeline.grids.store import GridRecord, Pair, write_pairs, write_worlds
from pipeline.settings import RobotConfig, require
from pipeline.stages.door import StageResult, Workspace, launch, typed, workspace
from pipeline.stages.parallel import ON_ERROR, Refused, make_all
from pipeline.stages.plans import SplitCounts

NARROW_DOORS = ("stop", "keep")


@dataclass(frozen=True, kw_only=True)
class SplitShares:
    """A relative size for each split."""

    train: float = 0.6
    validation: float = 0.1
    test: float = 0.3


@dataclass(frozen=True, kw_only=True)
class RasterizeConfig:
    """How plans become grids, splits and trials (conf/rasterize/)."""

    resolution_m: float
    """Side of a cell [m]; a whole multiple of a grid plan's own."""
    narrow_doors: str = "stop"
    """stop: every door must be at least three cells wide; keep: narrower ones may close, see keep_doors_open."""
    keep_doors_open: bool = True
    """Open marked doors that the robot passes and the cells close, by the fewest cells."""
    drop_clutter: bool = False
    """Count furniture, where the source marks it, as free."""
    variants_per_floor: int | None = None
    """Keep at most so many furniture variants of one floor; null keeps all."""
    shares: SplitShares = field(default_factory=SplitShares)
    """Relative sizes of the splits, in floors; whole buildings. Plans drawn for a split stay in it."""
    pairs_per_plan: SplitCounts = field(default_factory=lambda: SplitCounts(train=1, validation=1, test=1))
    """Start-goal pairs. Where a plan was drawn for one, it is pair 0, and pair 1 is the way back."""
    min_distance_m: float
    """Least travel distance between a sampled start and goal [m]."""
    on_error: str = "stop"
    """stop: a plan that cannot be used ends the run; skip: it is named in rejected.json and left out."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        require(0.01 <= self.resolution_m <= 1, "rasterize.resolution_m", self.resolution_m, "0.01 to 1 m per cell")
        require(0 < self.min_distance_m < 2000, "rasterize.min_distance_m", self.min_distance_m, "between 0 and 2000 m")
        require(self.narrow_doors in NARROW_DOORS, "rasterize.narrow_doors", self.narrow_doors, "stop or keep")
        require(self.on_error in ON_ERROR, "rasterize.on_error", self.on_error, "stop or skip")
        variants = self.variants_per_floor
        require(variants is None or variants >= 1, "rasterize.variants_per_floor", variants, "null or at least 1")
        counts = asdict(self.pairs_per_plan)
        require(min(counts.values()) >= 0, "rasterize.pairs_per_plan", counts, "no number below 0")


class _Task(NamedTuple):
    plan: FloorPlan | GridPlan
    narrowest_door_m: float | None
    split: str


class _World(NamedTuple):
    record: GridRecord
    pairs: list[Pair]
    connected_share: float
    lost: LostArea


def rasterize(raw: DictConfig) -> StageResult:
    """Write ``artifacts/rasterize``: grids.parquet, pairs.parquet, and rejected.json with the plans left out.

    Raises:
        TableError: the table of plans is missing or of another version.
        ConfigError: the resolution or the shares do not fit the plans.
        PlanError, TrialError: a plan that cannot be used, where rasterize.on_error is "stop"; or none can.
    """
    config, robot = typed(RasterizeConfig, raw, "rasterize"), typed(RobotConfig, raw, "robot")
    work = workspace(raw)
    kept = keep_variants(read_plans(work.folder("plans") / "plans.parquet"), config.variants_per_floor)
    splits = assign_splits([plan for plan, _ in kept], asdict(config.shares), work.seed)
    _tell_given([plan for plan, _ in kept])
    tasks = [(plan.plan_id, _Task(plan, report.narrowest_door_m, splits[plan.building])) for plan, report in kept]
    make = partial(_make_world, config=config, robot_radius=robot.radius_m, seed=work.seed)
    worlds, rejected = make_all(
        make, tasks, on_error=config.on_error, workers=work.workers, label="rasterize", progress=work.progress
    )
    if not worlds:
        raise PlanError(f"none of {len(rejected)} plans can be used; the first: {rejected[0].reason}")
    return _write(work, worlds, rejected)


def _tell_given(plans: Sequence[FloorPlan | GridPlan]) -> None:
    """Say so where some buildings come with a split and the others are divided: shares hold among the others alone."""
    given = {plan.building for plan in plans if plan.split is not None}
    free = {plan.building for plan in plans} - given
    if given and free:
        print(f"rasterize: {len(given)} buildings have their split, {len(free)} are divided by rasterize.shares")


def keep_variants(found: Sequence[Checked], most: int | None) -> list[Checked]:
    """Return the plans, by name, with at most ``most`` variants of each floor, the first ones; None keeps all."""
    seen: Counter[tuple[str, str]] = Counter()
    kept = []
    for plan, report in sorted(found, key=lambda checked: checked[0].plan_id):
        seen[plan.building, plan.floor] += 1
        if most is None or seen[plan.building, plan.floor] <= most:
            kept.append(Checked(plan, report))
    return kept


def assign_splits(plans: Sequence[FloorPlan | GridPlan], shares: Mapping[str, float], seed: int) -> dict[str, str]:
    """Return the split of every building: the one its plans were drawn for, else by `split_buildings`.

    Raises:
        PlanError: plans of one building were drawn for different splits.
    """
    drawn: dict[str, set[str | None]] = defaultdict(set)
    floors: dict[str, set[str]] = defaultdict(set)
    for plan in plans:
        drawn[plan.building].add(plan.split)
        floors[plan.building].add(plan.floor)
    for building, found in drawn.items():
        if len(found) > 1:
            raise PlanError(
                f"plans of building {building} were drawn for {sorted(map(str, found))}; expected one split."
            )
    free = {building: len(floors[building]) for building, found in drawn.items() if found == {None}}
    fixed = {building: split for building, (split,) in drawn.items() if split is not None}
    return fixed | (split_buildings(free, shares, seed) if free else {})


def _make_world(task: _Task, *, config: RasterizeConfig, robot_radius: float, seed: int) -> _World:
    plan = task.plan
    if config.narrow_doors == "stop":
        check_doors(plan.plan_id, task.narrowest_door_m, config.resolution_m)
    doors_from = 2 * robot_radius if config.keep_doors_open else None
    grid = rasterize_plan(plan, config.resolution_m, drop_clutter=config.drop_clutter, doors_from_m=doors_from)
    lost = lost_area(plan, grid, robot_radius, drop_clutter=config.drop_clutter)
    identity = (plan.plan_id, plan.building, plan.environment, task.split)
    ends = choose_ends(
        plan,
        grid,
        count=getattr(config.pairs_per_plan, task.split),
        min_distance=config.min_distance_m,
        robot_radius=robot_radius,
        seed=seed,
    )
    pairs = [Pair(f"{plan.plan_id}/{k}", *identity, *found) for k, found in enumerate(ends)]
    room = traversable_cells(grid, robot_radius)
    share = float(largest_component(room).sum() / room.sum()) if room.any() else 0.0
    areas = (lost.reachable_m2, lost.lost_m2)
    return _World(GridRecord(*identity, grid, robot_radius, *areas, layers_of(plan, grid)), pairs, share, lost)


def choose_ends(
    plan: FloorPlan | GridPlan, grid: OccupancyGrid, *, count: int, min_distance: float, robot_radius: float, seed: int
) -> list[Ends]:
    """Return ``count`` starts and goals: the pair the plan was drawn for and its way back, then sampled ones.

    Raises:
        TrialError: a given end is in a wall or not connected, or no two cells are ``min_distance`` [m] apart.
    """
    given = []
    if plan.endpoints is not None and count:
        start, goal = (Point(*end) for end in plan.endpoints)
        there = ends_between(grid, start, goal, plan_id=plan.plan_id, robot_radius=robot_radius)
        given = [there, Ends(there.goal, there.start, there.known_map_m)][:count]
    sampled = sample_ends(
        grid,
        plan_id=plan.plan_id,
        count=count - len(given),
        min_distance=min_distance,
        robot_radius=robot_radius,
        seed=seed,
    )
    return given + sampled


def _write(work: Workspace, worlds: Sequence[_World], rejected: Sequence[Refused]) -> StageResult:
    folder = work.folder("rasterize")
    write_worlds(folder, [world.record for world in worlds])
    write_pairs(folder, [pair for world in worlds for pair in world.pairs])
    write_json(folder / "rejected.json", [{"plan": bad.name, "reason": bad.reason} for bad in rejected])
    metrics = {"rejected": float(len(rejected)), "connected_share": median(world.connected_share for world in worlds)}
    for split in SPLITS:
        of_split = [world for world in worlds if world.record.split == split]
        buildings = {world.record.building for world in of_split}
        pairs = sum(len(world.pairs) for world in of_split)
        metrics |= {f"plans_{split}": float(len(of_split)), f"pairs_{split}": float(pairs)}
        metrics[f"buildings_{split}"] = float(len(buildings))
        print(f"rasterize: {split:<10} {len(of_split)} plans of {len(buildings)} buildings, {pairs} pairs")
    metrics |= _tell_lost(worlds)
    for bad in rejected:
        print(f"  rejected: {one_line(bad.reason)}")
    return StageResult(metrics=metrics, files=[folder / "rejected.json"])


def _tell_lost(worlds: Sequence[_World]) -> dict[str, float]:
    """Print how much floor was lost on the way to the cells, and where it was much; return it as metrics."""
    shares = [world.lost.share for world in worlds]
    much = [world for world in worlds if world.lost.share > MUCH_LOST]
    print(
        f"rasterize: floor lost to the cells: median {median(shares):.1%}, most {max(shares):.1%} of what is reachable"
    )
    for world in much:
        print(f"  warning: {say_lost(world.record.plan_id, world.record.grid.resolution, world.lost)}")
    return {
        "lost_share_median": median(shares),
        "lost_share_most": max(shares),
        "plans_with_floor_lost": float(len(much)),
    }


if __name__ == "__main__":
    launch("rasterize", rasterize)
