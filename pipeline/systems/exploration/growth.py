"""How a map grows on a drive: the area seen over the distance travelled, as a task that writes it down."""

from collections.abc import Iterable
from math import ceil
from typing import NamedTuple

import numpy as np
import pyarrow as pa

from pipeline.errors import TrialError
from pipeline.grids.distances import NOWHERE, open_field, settle, workspace_for
from pipeline.grids.occupancy import Cell
from pipeline.grids.partial_map import CHANGES
from pipeline.planning.seen import NO_GOAL, Seen
from pipeline.simulation.trial import Cover, Ending, Episode
from pipeline.simulation.world import World
from pipeline.tables import Table, column

STEPS = 200
"""A curve keeps the first look at which each 200th of the area had been seen, and the last look."""


class GrowthRow(NamedTuple):
    """One point of a curve: after ``travelled_m`` so much of the area in reach had been seen."""

    trial_id: str
    competitor: str
    travelled_m: float
    seen_m2: float
    share: float


GROWTH = Table(
    "growth",
    1,
    [
        column("trial_id", pa.string()),
        column("competitor", pa.string()),
        column("travelled_m", pa.float64(), unit="m"),
        column("seen_m2", pa.float64(), unit="m2"),
        column("share", pa.float64()),
    ],
    stage="evaluate",
)


class Survey:
    """The task of covering a world, and a record of how that went; one instance serves one trial.

    The area in reach is that of the cells where the robot's centre can be: each of them is in sight from itself.

    reachable: their number. seen: how many have been seen.
    """

    def __init__(self, world: World, start: Cell) -> None:
        """Find what is in reach of ``start``."""
        self._cover, self.goal, self._metres = Cover(), NO_GOAL, world.grid.resolution
        cols = world.blocked.shape[1]
        field = open_field(world.blocked, 0)
        settle(field, cols, start.row * cols + start.col, NOWHERE, workspace_for(field.size))
        self._in_reach = np.isfinite(field) & (field >= 0.0)
        self.reachable, self.seen = int(self._in_reach.sum()), 0
        self._read = 0
        self._points: list[tuple[float, int]] = []
        self._last_m = 0.0

    def require(self, world: World) -> None:
        """Ask for nothing: any world can be covered."""

    def done(self, seen: Seen) -> Ending | None:
        """Write down how much has been seen; it is for the planner to say that it is all."""
        written, self._last_m = int(seen.map.written[CHANGES]), seen.travelled
        fresh = int(self._in_reach[seen.map.changes[self._read : written]].sum())  # these only ever become CLEAR
        self._read = written
        if fresh or not self._points:
            self.seen += fresh
            self._points.append((seen.travelled, self.seen))
        return None

    def surrendered(self, seen: Seen, by: str) -> Ending:
        """Return COVERED where the map proves it."""
        return self._cover.surrendered(seen, by)

    @property
    def share(self) -> float:
        """Share of the area in reach that has been seen."""
        return self.seen / self.reachable

    def cost_m(self, coverage: float) -> float:
        """Return what was travelled [m] until the share ``coverage`` had been seen; if never, what was travelled."""
        wanted = ceil(coverage * self.reachable - 1e-9)
        return next((travelled for travelled, seen in self._points if seen >= wanted), self._last_m)

    def vouch(self, episode: Episode, by: str) -> None:
        """Check that a drive that ended COVERED has seen all in reach.

        Raises:
            TrialError: it has not.
        """
        if episode.ending is Ending.COVERED and self.seen < self.reachable:
            raise TrialError(
                f"{by}: ended as covered after {self.seen} of {self.reachable} cells in reach had been seen, expected "
                "all. No cost is recorded; mend the mapper."
            )

    def rows(self, trial_id: str, competitor: str) -> list[GrowthRow]:
        """Return the curve, thinned to at most 202 points."""
        kept: list[tuple[float, int]] = []
        level = -1
        for travelled, seen in self._points:
            if (reached := seen * STEPS // self.reachable) > level:
                kept.append((travelled, seen))
                level = reached
        if self._points and kept[-1][0] < self._last_m:
            kept.append((self._last_m, self.seen))
        area = self._metres**2
        return [
            GrowthRow(trial_id, competitor, travelled, seen * area, seen / self.reachable) for travelled, seen in kept
        ]


def growth_table(rows: Iterable[GrowthRow]) -> pa.Table:
    """Return ``rows`` as a table, in their order."""
    return GROWTH.stack(rows)
