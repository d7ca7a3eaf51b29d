"""Random forests: round trunks with gaps wide enough for the robot, in a rectangular clearing.

Source: Stein, Bradley, Roy, "Learning over Subgoals for Efficient Navigation of Structured, Unknown
Environments", CoRL 2018, section 3.2 (random forest).
"""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.stats import qmc

from pipeline.errors import PlanError
from pipeline.floorplans.generators.demand import demand
from pipeline.floorplans.plan import Bounds, FloorPlan, Location

ENVIRONMENT = "forest"

_MOST_DRAWS = 1000  # starts and goals drawn before giving up on two that are far apart
_MOST_ACROSS = 300  # trunks side by side along the longer side of the forest
_ARC = 8  # straight pieces of a quarter of a trunk

Trunks = NDArray[np.float64]  # [trunks, 3] middle x, y and radius [m]


@dataclass(frozen=True, kw_only=True)
class ForestShape:
    """Size of a forest and of what stands in it.

    width_m, height_m: extent along x and y [m]. gap_m: clear distance that is kept everywhere: between two trunks,
    from a trunk to the edge, and twice as much as from start and goal to a trunk [m].
    min_radius_m, max_radius_m: of a trunk, all between equally likely [m]. density: share of the trunks of a forest
    without room for another one that stand. min_distance_m: least distance of start and goal in a straight line [m].
    """

    width_m: float = 60.0
    height_m: float = 45.0
    gap_m: float = 1.8
    min_radius_m: float = 0.3
    max_radius_m: float = 0.9
    density: float = 1.0
    min_distance_m: float = 35.0

    def __post_init__(self) -> None:
        """Refuse impossible values; the ConfigError names the key."""
        _demand("gap_m", self.gap_m, self.gap_m > 0, "above 0 m")
        _demand("min_radius_m", self.min_radius_m, self.min_radius_m > 0, "above 0 m")
        radius = self.max_radius_m
        _demand("max_radius_m", radius, radius >= self.min_radius_m, f"at least min_radius_m = {self.min_radius_m:g} m")
        least, most = 2 * self.spacing_m, _MOST_ACROSS * self.spacing_m
        for name, side in (("width_m", self.width_m), ("height_m", self.height_m)):
            _demand(
                name, side, least < side <= most, f"above {least:g} m, two trunks with their gaps, up to {most:g} m"
            )
        _demand("density", self.density, 0 <= self.density <= 1, "a share from 0 to 1")
        longest = float(np.hypot(self.width_m, self.height_m)) - 2 * self.gap_m
        fits = 0 <= self.min_distance_m < longest
        _demand("min_distance_m", self.min_distance_m, fits, f"less than {longest:g} m, from corner to corner")

    @property
    def spacing_m(self) -> float:
        """Least distance between the middles of two trunks [m]."""
        return 2 * self.max_radius_m + self.gap_m


def draw_forest(shape: ForestShape, rng: np.random.Generator, *, plan_id: str, split: str | None = None) -> FloorPlan:
    """Draw one forest; ``rng`` is consumed. A robot narrower than ``shape.gap_m`` reaches everything.

    Grown by half a gap, no two trunks overlap, so what is left around them is one piece.

    Raises:
        PlanError: no start and goal as far apart as asked were found.
    """
    trunks = draw_trunks(shape, rng)
    start, goal = _draw_ends(shape, trunks, rng, plan_id)
    ground = shapely.box(0.0, 0.0, shape.width_m, shape.height_m)
    discs = shapely.buffer(shapely.points(trunks[:, :2]), trunks[:, 2], quad_segs=_ARC)
    return FloorPlan(
        plan_id=plan_id,
        building=plan_id,
        floor=plan_id,
        environment=ENVIRONMENT,
        source="generator forest",
        split=split,
        endpoints=(start, goal),
        free=ground.difference(shapely.union_all(discs)),
        bounds=Bounds(*ground.bounds),
    )


def draw_trunks(shape: ForestShape, rng: np.random.Generator) -> Trunks:
    """Draw the trunks; their middles are a Poisson-disc sample, so none are closer than `ForestShape.spacing_m`."""
    low = shape.max_radius_m + shape.gap_m
    room = np.array([shape.width_m, shape.height_m]) - 2 * low
    side = room.max()
    sample = qmc.PoissonDisk(2, radius=shape.spacing_m / side, rng=rng).fill_space() * side
    middles = low + sample[(sample <= room).all(axis=1)]
    standing = middles[rng.permutation(len(middles))[: round(shape.density * len(middles))]]
    radii = rng.uniform(shape.min_radius_m, shape.max_radius_m, size=len(standing))
    return np.column_stack([standing, radii])


def _draw_ends(shape: ForestShape, trunks: Trunks, rng: np.random.Generator, plan_id: str) -> tuple[Location, Location]:
    """Draw a start and a goal, half a gap clear of every trunk and of the edge."""
    clear = shape.gap_m / 2
    for _ in range(_MOST_DRAWS):
        ends = rng.uniform(clear, (shape.width_m - clear, shape.height_m - clear), size=(2, 2))
        apart = np.hypot(*(ends[1] - ends[0]))
        to_trunks = np.linalg.norm(ends[:, np.newaxis] - trunks[:, :2], axis=2) - trunks[:, 2]
        if apart >= shape.min_distance_m and to_trunks.min(initial=np.inf) >= clear:
            return Location(*ends[0].tolist()), Location(*ends[1].tolist())
    raise PlanError(
        f"plan {plan_id} (generator forest): no start and goal {shape.min_distance_m:g} m apart in {_MOST_DRAWS} "
        "draws. Lower plans.forest.min_distance_m or plans.forest.density."
    )


def _demand(key: str, value: float, holds: bool, allowed: str) -> None:
    demand(f"forest.{key}", value, holds, allowed)
