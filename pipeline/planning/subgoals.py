"""A subgoal stands for one frontier: where known free space meets the space that may hold the goal."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pipeline.grids.distances import NOWHERE, Field, Indices, Workspace, workspace_for
from pipeline.grids.fields import MapField, RobotField
from pipeline.grids.frontiers import find_border, find_gates, group_border, renew_border
from pipeline.grids.partial_map import CHANGES, CLEAR, UNSEEN, PartialMap
from pipeline.grids.zones import FRESH, GOALWARD, REACHED, REBUILT, Zones, advance, divide
from pipeline.planning.seen import Seen


class Subgoal(NamedTuple):
    """One frontier and the cell that stands for it.

    cells: [k] int32 flat indices of the frontier's cells, ascending; its identity from step to step.
    point: flat index of the frontier cell nearest to the mean of all of them: where pictures and networks have it.
        Costs are measured from the gate instead, see ``Surroundings.gates``.
    key: the frontier's identity: equal exactly when the cells are.
    """

    cells: Indices
    point: int
    key: bytes


class Surroundings:
    """What a robot's map says of the ways on, kept up to date as the map grows. One instance serves one trial.

    zones: [cells] uint8, what is reached and what is beyond, see ``pipeline.grids.zones``.
    subgoals: the frontiers that may lead to the goal, in order of their first cells; empty when the goal is in reach or
        proved unreachable. Frontiers within twice ``Seen.widen`` cells of each other, by way of reached space, are one.
    cells, starts: the same frontiers as arrays, see ``pipeline.grids.frontiers.group_border``.
    entered: the cells that became reached, in order, since ``divisions`` last rose: a journal for whoever keeps
        something that depends on reached space.
    work: room for kernels.
    """

    zones: Zones
    subgoals: list[Subgoal]
    cells: Indices
    starts: Indices
    entered: Indices
    divisions: int
    work: Workspace
    _gates: Indices | None

    def __init__(self, seen: Seen) -> None:
        """Look at the map of ``seen`` as it is."""
        self._map, self._cols = seen.map, seen.map.status.shape[1]
        self._goal = seen.goal.row * self._cols + seen.goal.col
        size = seen.map.status.size
        self.work = workspace_for(size)
        self.zones = np.empty(size, dtype=np.uint8)
        self._sets, self._counts = np.empty(size, dtype=np.int32), np.zeros(2, dtype=np.int64)
        self._journal, self._order = np.empty(size, dtype=np.int32), np.zeros(size, dtype=np.int32)
        self._reach: RobotField | None = None
        self._ways: MapField | None = None
        self._read = int(seen.map.written[CHANGES])
        self._border: Indices = NOWHERE
        self.divisions = 0
        status, home = seen.map.status, self._home(seen)
        divide(status, home, self._goal, self.zones, self._sets, self._counts, self.work.stack)
        self._begin_journal()
        self._make_subgoals(seen)

    def are_of(self, map_: PartialMap) -> bool:
        """Whether these are the surroundings in this very map, earlier or now."""
        return map_.status is self._map.status

    def update(self, seen: Seen) -> None:
        """Take in what was seen since; ``seen`` is of the trial that this instance was made for."""
        written = int(seen.map.written[CHANGES])
        changed, room = seen.map.changes[self._read : written], self._journal[self.entered.size :]
        self._read = written
        status, home = seen.map.status, self._home(seen)
        advance(status, home, self._goal, changed, self.zones, self._sets, self._counts, room, self.work.stack)
        if self._counts[REBUILT]:
            self._begin_journal()
        else:
            fresh = room[: self._counts[FRESH]]
            self.entered = self._journal[: self.entered.size + fresh.size]
            self._border = renew_border(self.zones, self._cols, self._border, fresh)
        self._make_subgoals(seen)

    @property
    def goal_in_reach(self) -> bool:
        """Whether known free space leads to the goal."""
        return bool(self.zones[self._goal] == REACHED)

    @property
    def reach(self) -> RobotField:
        """Travel distances [cells] from the robot through known free space."""
        if self._reach is None:
            self._reach = RobotField(self._map, CLEAR, self._robot, self.work)
        self._reach.move(self._robot)
        return self._reach

    @property
    def onward(self) -> Field:
        """Travel distance [cells] to the goal with the unknown taken as free: [cells]."""
        return self.ways.catch_up()

    @property
    def ways(self) -> MapField:
        """The field of ``onward``, for whoever looks at it in his own time."""
        if self._ways is None:
            self._ways = MapField(self._map, UNSEEN, self._goal, self.work)
        return self._ways

    @property
    def gates(self) -> Indices:
        """Each subgoal's gate [n], its flat cell on the shortest way robot -> frontier -> goal (``find_gates``).

        All costs of a subgoal, true or estimated, are measured from where its gate was when they were stated.
        """
        if self._gates is None:
            reach = self.reach
            self._gates, _ = find_gates(self.cells, self.starts, reach.values, reach.base, self.onward)
        return self._gates

    def gates_of(self, subgoals: Sequence[Subgoal]) -> list[int]:
        """Return the gates of ``subgoals``, which are among those around."""
        place = {subgoal.key: k for k, subgoal in enumerate(self.subgoals)}
        return [int(self.gates[place[subgoal.key]]) for subgoal in subgoals]

    def _make_subgoals(self, seen: Seen) -> None:
        self._robot, self._gates = self._home(seen), None
        border = self._border if self.zones[self._goal] == GOALWARD else NOWHERE
        self.cells, self.starts, points = group_border(self.zones, self._cols, border, seen.widen, self._order)
        bounds: list[int] = self.starts.tolist()
        frontiers = [self.cells[first:last] for first, last in pairwise(bounds)]
        self.subgoals = [
            Subgoal(each, point, each.tobytes()) for each, point in zip(frontiers, points.tolist(), strict=True)
        ]

    def _begin_journal(self) -> None:
        self.divisions += 1
        self.entered = self._journal[:0]
        self._border = find_border(self.zones, self._cols)

    def _home(self, seen: Seen) -> int:
        return int(seen.pose.row * self._cols + seen.pose.col)
