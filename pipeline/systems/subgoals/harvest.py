"""Explore a building as the optimistic planner does, and label each new or changed subgoal (LSP section 2.3)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.datums import Datum
from pipeline.grids.occupancy import Cell, center_of
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Surroundings
from pipeline.simulation.trial import Episode, Robot, run_trial
from pipeline.simulation.world import World
from pipeline.systems.subgoals.labels import LabelBook, Marked
from pipeline.systems.subgoals.map_view import MapViews
from pipeline.systems.subgoals.observation import observe


class Origin(NamedTuple):
    """Where a datum comes from; the columns of the table that a trial does not change."""

    pair_id: str
    plan_id: str
    building: str
    environment: str
    split: str
    seed: int


class _Harvester:
    """Drives as the optimistic planner does and keeps a datum of every subgoal it meets."""

    def __init__(self, world: World, origin: Origin, floor_m: float, map_views: bool) -> None:
        self._world = world
        self._origin = origin
        self._book = LabelBook(world, floor_m=floor_m)
        self._map_views = map_views
        self._met: _Met | None = None
        self.datums: list[Datum] = []

    def plan(self, seen: Seen) -> NDArray[np.int32] | None:
        if self._met is None:
            around = Surroundings(seen)
            views = MapViews(seen, around) if self._map_views else None
            self._met = _Met(around, OptimisticPlanner(around.ways), views)
        else:
            self._met.around.update(seen)
        marked = self._book.mark_changed(seen, self._met.around)
        if marked:
            subgoals = [mark.subgoal for mark in marked]
            found = None if self._met.views is None else self._met.views.views(seen, subgoals)
            self.datums += _to_datums(marked, seen, self._world, self._origin, found)
        return self._met.optimist.plan(seen)


class _Met(NamedTuple):
    """What begins with the first thing seen. views: where they are to be stored."""

    around: Surroundings
    optimist: OptimisticPlanner
    views: MapViews | None


def harvest_trial(
    world: World,
    start: Cell,
    goal: Cell,
    origin: Origin,
    *,
    robot: Robot,
    weight_floor_m: float,
    rng: np.random.Generator,
    max_steps: int | None = None,
    map_views: bool = False,
) -> tuple[Episode, list[Datum]]:
    """Return the optimistic planner's episode and the datums met on its way, in order of step and subgoal.

    map_views: store with each datum how the whole map shows its subgoal.
    """
    harvester = _Harvester(world, origin, weight_floor_m, map_views)
    episode = run_trial(world, start, goal, harvester, robot=robot, rng=rng, max_steps=max_steps)
    return episode, harvester.datums


def _to_datums(
    marked: list[Marked], seen: Seen, world: World, origin: Origin, map_views: NDArray[np.float32] | None
) -> list[Datum]:
    view = observe(seen, [mark.subgoal for mark in marked])
    stand = center_of(world.grid, Cell(seen.pose.row, seen.pose.col))
    return [
        Datum(
            *origin,
            step=seen.step,
            subgoal=mark.place,
            pose_x_m=stand.x,
            pose_y_m=stand.y,
            heading_rad=seen.pose.heading,
            ranges=view.ranges,
            goal_x_m=float(view.goal[0]),
            goal_y_m=float(view.goal[1]),
            subgoal_x_m=float(view.subgoals[k, 0]),
            subgoal_y_m=float(view.subgoals[k, 1]),
            leads_to_goal=mark.label.leads,
            delta_success_m=mark.label.delta_success if mark.label.leads else None,
            exploration_m=None if mark.label.leads else mark.label.exploration,
            weight_m=mark.cost,
            frontier_cells=int(mark.subgoal.cells.size),
            map_view=None if map_views is None else map_views[k],
        )
        for k, mark in enumerate(marked)
    ]
