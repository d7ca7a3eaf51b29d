"""The parts of a robot that the loop drives: what it senses with, what it makes of that, how it moves.

Each may be somebody's own. The loop vouches for what is recorded: see ``pipeline.simulation.vouching``.
"""

from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from pipeline.grids.partial_map import PartialMap
from pipeline.planning.seen import Belief, Observation, Pose
from pipeline.simulation.world import World

Indices = NDArray[np.int32]


@runtime_checkable
class Sensor(Protocol):
    """Looks at the true world from where the robot stands."""

    @property
    def reach_m(self) -> float:
        """How far it sees [m]."""
        ...

    @property
    def field_of_view(self) -> float:
        """The angle it sees at once, the heading in its middle [rad]: 2 pi for all around."""
        ...

    def observe(self, world: World, pose: Pose, rng: np.random.Generator) -> Observation:
        """Return one look, see `Observation`; ``rng`` feeds its noise and is drawn from at every look alike."""
        ...


class Mapper(Protocol):
    """Turns observations into a belief, in place; one instance serves one trial."""

    def update(self, observation: Observation) -> Belief:
        """Take in one look, or what the robot touched, and return the belief, whose map is the same at each call."""
        ...


class MapperFactory(Protocol):
    """Makes the mapper of a trial."""

    def __call__(self, rows: int, cols: int, disk: Indices) -> Mapper:
        """Return one that has seen nothing of a grid so large. ``disk``: offsets one obstacle blocks, as in `World`."""
        ...


class Move(NamedTuple):
    """What came of one command.

    pose: where it ended. length: what it cost [cells], at least the length of the way.
    cells: [k] int32, the flat cells that the robot's centre passed, without the first one.
    rest: [k] int32, the path that is left, from the robot's cell on; as given where the robot could not set out.
    touched: [k] int32, flat cells of obstacles that it ran into unseen; it then stopped before them.
    way: [k, 2] float64 (row, col), the line of its centre from the old pose to the new one [cells], cell centres at
        whole numbers; None for straight moves from centre to centre.
    """

    pose: Pose
    length: float
    cells: Indices
    rest: Indices
    touched: Indices
    way: NDArray[np.float64] | None = None


@runtime_checkable
class Motion(Protocol):
    """Carries out a planner's path."""

    @property
    def undercut(self) -> float:
        """The least length of a way of this motion over the 8-connected one between the same cells: 1 for a walk."""
        ...

    def follow(self, path: Indices, map_: PartialMap, pose: Pose, world: World, length: float) -> Move:
        """Follow ``path`` through space seen to be free for about ``length`` [cells], at least one cell.

        world: the truth, for what the robot runs into.
        """
        ...

    def turn(self, pose: Pose, heading: float, resolution: float) -> Move:
        """Turn where the robot stands to ``heading`` [rad]; resolution: side of a cell [m]."""
        ...


def flat_cells(cells: Sequence[int]) -> Indices:
    """Return ``cells`` as the parts pass them."""
    return np.array(cells, dtype=np.int32)
