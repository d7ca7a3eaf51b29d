"""What a planner answers is checked before the robot follows it: the loop vouches for the cost that it records."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.errors import PlannerError
from pipeline.grids.distances import NOWHERE, SHUT, Field, Indices, Status, open_field, settle, wide, workspace_for
from pipeline.grids.partial_map import CLEAR, UNSEEN
from pipeline.planning.seen import Seen

SOUND, ELSEWHERE, OUTSIDE, JUMPS, OBSTACLE, CORNER = range(6)  # what may be wrong with a path


def checked_path(answer: object, seen: Seen, by: str, *, may_stand: bool = False) -> NDArray[np.int32]:
    """Return a copy of the path that a planner answered; it may write into its own again.

    by: who answered, and on which plan. may_stand: a path of the robot's cell alone is one, to turn there.

    Raises:
        PlannerError: it is no path that the robot could set out on.
    """
    if not isinstance(answer, np.ndarray) or answer.ndim != 1 or answer.dtype != np.int32:
        came = f"{answer.dtype} {answer.shape}" if isinstance(answer, np.ndarray) else type(answer).__name__
        raise _fault(by, seen, f"the path is {came}, expected flat cells as int32 [k], or None where no way is left")
    fault, place = path_fault(answer, seen.map.status, _home(seen))
    if fault != SOUND:
        raise _fault(by, seen, _in_words(fault, answer, place, seen))
    if answer.size < 2 and not may_stand:
        raise never_moves(seen, by)
    return answer.copy()


def never_moves(seen: Seen, by: str) -> PlannerError:
    """Return the error for a path that ends where the robot stands, or sets out into what was not seen."""
    return _fault(
        by,
        seen,
        "the path never moves the robot, which is not at the goal: its first move must lead through space seen to be "
        "free. A planner that sees no way on returns None",
    )


def check_surrender(seen: Seen, by: str) -> None:
    """Check that a planner that gives the goal up may do so.

    Raises:
        PlannerError: free or unseen space still leads from the robot to the goal.
    """
    field, goal = open_field(seen.map.status, UNSEEN), seen.goal.row * seen.map.status.shape[1] + seen.goal.col
    settle(field, seen.map.status.shape[1], _home(seen), NOWHERE, workspace_for(field.size))
    if field[goal] != SHUT and np.isfinite(field[goal]):
        raise _fault(
            by,
            seen,
            f"the goal was given up, although free or unseen space leads there, {field[goal] * seen.resolution:.1f} m "
            "long. Only a goal that the map proves out of reach may be answered by None",
        )


def check_covered(seen: Seen, by: str) -> None:
    """Check that a planner that says all has been seen may say so.

    Raises:
        PlannerError: the robot can drive to a cell beside which it may go on into what it has not seen.
    """
    status, cols = seen.map.status, seen.map.status.shape[1]
    field = open_field(status, CLEAR)
    settle(field, cols, _home(seen), NOWHERE, workspace_for(field.size))
    left = frontier_cells(field, status)
    if left.size:
        nearest = int(left[np.argmin(field[left])])
        raise _fault(
            by,
            seen,
            f"all was said to be seen, although {left.size} cells in reach border unseen space, the nearest at row "
            f"{nearest // cols}, col {nearest % cols}, {field[nearest] * seen.resolution:.1f} m away. Only where no "
            "frontier is left may a planner without a goal answer None",
        )


@njit(cache=True, nogil=True)
def frontier_cells(field: Field, status: Status) -> Indices:
    """Return the flat cells that ``field`` reaches and that have an UNSEEN 4-neighbour, ascending."""
    cols, flat = status.shape[1], status.ravel()
    found = np.empty(flat.size, dtype=np.int32)
    count = 0
    for cell in range(cols + 1, flat.size - cols - 1):
        if not 0.0 <= field[cell] < np.inf:
            continue
        north, south, east, west = flat[cell + cols], flat[cell - cols], flat[cell + 1], flat[cell - 1]
        if north == UNSEEN or south == UNSEEN or east == UNSEEN or west == UNSEEN:
            found[count] = cell
            count += 1
    return found[:count].copy()


@njit(cache=True, nogil=True)
def path_fault(path: Indices, status: Status, robot: int) -> tuple[int, int]:
    """Return what is wrong with ``path``, SOUND if nothing, and the place of the first wrong cell in it.

    A sound path starts at the flat cell ``robot`` and goes from neighbour to neighbour through cells of ``status`` at
    most UNSEEN; a diagonal move has both cells beside it open.
    """
    cols = status.shape[1]
    flat = status.ravel()
    if path.size == 0 or path[0] != robot:
        return ELSEWHERE, 0
    col = wide(path[0]) % cols
    for k in range(1, path.size):
        here, there = wide(path[k - 1]), wide(path[k])
        if there < 0 or there >= flat.size:
            return OUTSIDE, k
        step = there - here
        drow = 1 if step > 1 else -1 if step < -1 else 0
        dcol = step - drow * cols
        col += dcol
        if step == 0 or abs(dcol) > 1 or col < 0 or col >= cols:
            return JUMPS, k
        if flat[there] > UNSEEN:
            return OBSTACLE, k
        if flat[here + dcol] > UNSEEN or flat[here + drow * cols] > UNSEEN:
            return CORNER, k
    return SOUND, 0


def _in_words(fault: int, path: NDArray[np.int32], place: int, seen: Seen) -> str:
    rows, cols = seen.map.status.shape
    if path.size == 0:
        return "the path is empty, expected at least the robot's cell and the next, or None where no way is left"
    there, before = (f"row {cell // cols}, col {cell % cols}" for cell in (int(path[place]), int(path[place - 1])))
    if fault == ELSEWHERE:
        return f"the path starts at {there}, expected the robot's cell at row {seen.pose.row}, col {seen.pose.col}"
    if fault == OUTSIDE:
        return f"the path has the flat cell {path[place]} at place {place}, outside the {rows} x {cols} grid"
    if fault == JUMPS:
        return f"the path jumps from {before} to {there} at place {place}, expected one of the 8 neighbours"
    if fault == OBSTACLE:
        return f"the path runs through a seen obstacle, or too close to one for the robot, at {there}, place {place}"
    return f"the path cuts the corner of a seen obstacle from {before} to {there} at place {place}"


def _fault(by: str, seen: Seen, what: str) -> PlannerError:
    return PlannerError(f"{by}, scan {seen.step + 1}: {what}. No cost is recorded; mend the planner.")


def _home(seen: Seen) -> int:
    return int(seen.pose.row * seen.map.status.shape[1] + seen.pose.col)
