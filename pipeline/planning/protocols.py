"""What the simulation loop asks of a planner, and a subgoal planner of its estimator."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings


class Planner(Protocol):
    """Chooses where to go next. One instance serves one trial and may keep state between steps."""

    def plan(self, seen: Seen) -> NDArray[np.int32] | None:
        """Return the path to follow as flat cells [k] from the robot's cell on, or None if the goal is unreachable.

        The robot follows the path through space it has seen to be free, until its map changes.
        """
        ...


class Estimates(NamedTuple):
    """What lies beyond n subgoals (LSP section 2.2). Costs begin at the gate, see ``Surroundings.gates``.

    p_success: [n] probability that the subgoal leads to the goal.
    delta_success: [n] cost of success beyond the optimistic distance gate -> goal [m].
    exploration: [n] cost of exploring in vain and coming back [m].
    """

    p_success: NDArray[np.float64]
    delta_success: NDArray[np.float64]
    exploration: NDArray[np.float64]


class Estimator(Protocol):
    """Estimates the properties of subgoals from what was seen."""

    @property
    def lasting(self) -> bool:
        """Whether an estimate holds until its frontier changes; otherwise it is made anew whenever the map does."""
        ...

    def estimate(self, seen: Seen, around: Surroundings, subgoals: Sequence[Subgoal]) -> Estimates:
        """Return the estimates of ``subgoals``, in their order; ``around`` holds all subgoals of this step."""
        ...
