"""What the simulation loop asks of a planner, and a subgoal planner of its estimator."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings


class Course(NamedTuple):
    """A path and, where the planner cares, which way to face at its end.

    path: flat cells [k] int32 from the robot's cell on; the robot's cell alone to turn where it stands.
    heading: [rad], 0 along +x, counter-clockwise; None leaves it to the robot.
    """

    path: NDArray[np.int32]
    heading: float | None = None


class Planner(Protocol):
    """Chooses where to go next. One instance serves one trial and may keep state between steps.

    A planner may also have a method ``notice(seen)``: it is then told of every observation, before it is asked to
    plan with it or the robot goes on along its path.
    """

    def plan(self, seen: Seen) -> NDArray[np.int32] | Course | None:
        """Return the path to follow as flat cells [k] from the robot's cell on, or None if there is nothing to do.

        The robot follows the path through space it has seen to be free, until its map changes. None says that the goal
        is unreachable or, without a goal, that nothing is left to see.
        """
        ...


@runtime_checkable
class Notices(Protocol):
    """A planner that wants to be told of every observation."""

    def notice(self, seen: Seen) -> None:
        """Take note of what was just seen."""
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
