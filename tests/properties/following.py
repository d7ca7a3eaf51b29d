"""A planner that drives, and checks at every step that what is kept up to date equals what is worked out anew."""

import numpy as np
from numpy.typing import NDArray

from pipeline.grids.distances import DIAGONAL, NOWHERE, open_field, settle, workspace_for
from pipeline.grids.fields import MapField
from pipeline.grids.frontiers import find_gates
from pipeline.grids.partial_map import CLEAR, UNSEEN, map_of
from pipeline.grids.zones import REACHED
from pipeline.planning.gate_distances import GateDistances
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.protocols import Planner
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Surroundings
from pipeline.simulation.world import World
from pipeline.systems.subgoals.beyond import Beyond
from pipeline.systems.subgoals.map_view import MapViews


class Follower:
    """Drives as ``planner`` does, with surroundings, distances, labels and views that live as long as the trial."""

    def __init__(self, world: World, planner: Planner) -> None:
        self._world, self._planner = world, planner
        self._optimist = OptimisticPlanner()
        self._around: Surroundings | None = None
        self.compared = 0

    def plan(self, seen: Seen) -> NDArray[np.int32] | None:
        if self._around is None:
            self._around = Surroundings(seen)
            self._distances = GateDistances(seen.map, self._around.work)
            self._beyond = Beyond(self._world, seen, self._around)
            self._views = MapViews(seen, self._around)
        else:
            self._around.update(seen)
        fresh = seen._replace(map=map_of(seen.map.known.copy(), seen.map.status.copy()))
        self._compare(seen, self._around, fresh, Surroundings(fresh))
        check_path(self._optimist.plan(seen), fresh)
        self.compared += 1
        return self._planner.plan(seen)

    def _compare(self, seen: Seen, kept: Surroundings, fresh: Seen, anew: Surroundings) -> None:
        assert np.array_equal(kept.zones == REACHED, anew.zones == REACHED)
        assert np.array_equal(kept.cells, anew.cells) and np.array_equal(kept.starts, anew.starts)
        assert [(each.key, each.point) for each in kept.subgoals] == [(each.key, each.point) for each in anew.subgoals]
        assert np.array_equal(kept.onward, anew.onward)
        if not anew.subgoals:
            return
        reach = kept.reach
        assert np.array_equal(reach.distance_to(kept.cells), anew.reach.distance_to(anew.cells))
        gates, _ = find_gates(kept.cells, kept.starts, reach.values, reach.base, kept.onward)
        assert np.array_equal(self._distances.between(gates), pairs_between(seen, gates))
        self._beyond.follow()
        beyond = Beyond(self._world, fresh, anew)
        for each in anew.subgoals:
            assert self._beyond.way_to_goal(each.cells, each.point) == beyond.way_to_goal(each.cells, each.point)
            assert self._beyond.extent(each.cells, each.point) == beyond.extent(each.cells, each.point)
        views = MapViews(fresh, anew).views(fresh, anew.subgoals)
        assert np.array_equal(self._views.views(seen, kept.subgoals), views)


def pairs_between(seen: Seen, gates: NDArray[np.int32]) -> NDArray[np.float64]:
    """Distances between ``gates`` through known free space, one search for each."""
    status, work = seen.map.status, workspace_for(seen.map.status.size)
    pairs = np.empty((gates.size, gates.size))
    for place, gate in enumerate(gates):
        field = open_field(status, CLEAR)
        settle(field, status.shape[1], gate, NOWHERE, work)
        pairs[place] = field[gates]
    return pairs


def check_path(path: NDArray[np.int32] | None, seen: Seen) -> None:
    """The optimistic path is open, and as short as the distance to the goal says."""
    status, cols = seen.map.status, seen.map.status.shape[1]
    robot, goal = seen.pose.row * cols + seen.pose.col, seen.goal.row * cols + seen.goal.col
    field = MapField(seen.map, UNSEEN, goal, workspace_for(status.size)).values
    if path is None:
        assert field[robot] == np.inf
        return
    rows, columns = np.divmod(path, cols)
    beside = np.concatenate((rows[:-1] * cols + columns[1:], rows[1:] * cols + columns[:-1]))
    moves = np.where((np.diff(rows) != 0) & (np.diff(columns) != 0), DIAGONAL, 1.0)
    assert path[0] == robot and path[-1] == goal
    assert (status.ravel()[path] <= UNSEEN).all() and (status.ravel()[beside] <= UNSEEN).all()
    assert moves.sum() == field[robot]
