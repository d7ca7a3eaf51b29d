"""The loop vouches for what it records: parts that are not its own are held to the truth at every step.

Sensors must report the true world within their reach, maps must hold what was observed and nothing else, and a move
must be a way through free space that costs at least its length.
"""

from itertools import pairwise
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import RobotError
from pipeline.grids.occupancy import FREE, UNKNOWN, Cells
from pipeline.grids.partial_map import PartialMap
from pipeline.planning.seen import CELLS, OCCUPANCY, Observation, Pose
from pipeline.simulation.protocols import Move
from pipeline.simulation.world import World

_FINEST = 1e-6  # relative error allowed in the cost of a move
_WORDS = {0: "free", 1: "an obstacle", 2: "not seen"}


def vouch_observation(observation: Observation, world: World, pose: Pose, reach_m: float, by: str) -> None:
    """Check that a sensor reports cells of ``world`` within ``reach_m`` of ``pose``, as they truly are.

    Raises:
        RobotError: it does not; ``by`` names the sensor and the plan.
    """
    cells, occupancy = (observation.channels.get(name) for name in (CELLS, OCCUPANCY))
    if not (_flat(cells, np.int32) and _flat(occupancy, np.uint8) and cells.shape == occupancy.shape):
        raise _refused(by, f"channels {CELLS} and {OCCUPANCY} are {_kind(cells)} and {_kind(occupancy)}, expected "
                           "int32 [k] and uint8 [k]", "sensor")  # fmt: skip
    rows, cols = world.grid.cells.shape
    outside = (cells < 0) | (cells >= rows * cols)
    if outside.any():
        raise _refused(by, f"it reports the flat cell {cells[outside][0]}, outside the {rows} x {cols} grid", "sensor")
    away = (
        np.hypot(cells // cols - pose.row, cells % cols - pose.col) - 1.0
    )  # a beam may end on the near edge of a cell
    far = away * world.grid.resolution > reach_m
    if far.any():
        raise _refused(
            by,
            f"it reports {_place(cells[far][0], cols)}, {(away[far][0] + 1.0) * world.grid.resolution:.1f} m from the "
            f"robot at {_at(pose)}, and says that it reaches {reach_m:g} m",
            "sensor",
        )
    wrong = (world.grid.cells.ravel()[cells] == FREE) != (occupancy == FREE)
    if wrong.any():
        said = "free" if occupancy[wrong][0] == FREE else "an obstacle"
        raise _refused(by, f"it reports {_place(cells[wrong][0], cols)} as {said}, which it is not: noise belongs into "
                           f"channels other than {CELLS}", "sensor")  # fmt: skip


def vouch_map(map_: PartialMap, observed: PartialMap, by: str) -> None:
    """Check that a mapper's map holds what was ``observed`` and nothing else.

    Raises:
        RobotError: it forgot, or invented; ``by`` names the mapper and the plan.
    """
    cols = observed.known.shape[1]
    for name in ("known", "status"):
        mine, its = getattr(observed, name), getattr(map_, name)
        if not isinstance(its, np.ndarray) or its.shape != mine.shape:
            raise _refused(by, f"its map has {name} {_kind(its)}, expected uint8 {mine.shape}", "mapper")
        if np.array_equal(mine, its):
            continue
        cell = int(np.flatnonzero(mine != its)[0])
        was, now = int(mine.flat[cell]), int(its.flat[cell])
        if name == "status":
            raise _refused(by, f"its map has status {now} at {_place(cell, cols)}, expected {was} for this robot: it "
                               "follows from what is known", "mapper")  # fmt: skip
        deed = "forgot" if now == UNKNOWN else "invented" if was == UNKNOWN else "changed"
        raise _refused(by, f"its map {deed} {_place(cell, cols)}: it says {_WORDS.get(now, now)}, observed was "
                           f"{_WORDS[was]}. Predictions belong into fields of the belief's own", "mapper")  # fmt: skip


def vouch_move(move: Move, pose: Pose, world: World, by: str) -> None:
    """Check that a move leads from ``pose`` through free space of ``world`` and costs at least its length.

    Raises:
        RobotError: it does not; ``by`` names the motion and the plan.
    """
    cols = world.blocked.shape[1]
    way = way_of(move, pose, cols)
    steps = np.hypot(*np.diff(way, axis=0).T) if len(way) > 1 else np.zeros(0)
    ends = np.array([way[0], way[-1]]) - [centre_of(pose), centre_of(move.pose)]
    if not np.isfinite(way).all() or np.abs(ends).max() > 1e-6:
        raise _refused(by, f"its way leads from {_spot(way[0])} to {_spot(way[-1])}, the robot stood at "
                           f"{_at(pose)} and is said to be at {_at(move.pose)} now", "motion")  # fmt: skip
    leaps = steps > np.sqrt(2.0) + 1e-6
    if leaps.any():
        at = int(np.flatnonzero(leaps)[0])
        raise _refused(by, f"it jumps {steps[at]:.1f} cells from {_spot(way[at])} to {_spot(way[at + 1])}, expected at "
                           "most one cell between two points of its way", "motion")  # fmt: skip
    cell = _hits(way, world.blocked)
    if cell >= 0:
        raise _refused(by, f"it drives through {_place(cell, cols)}, where a wall keeps the robot away", "motion")
    length = float(steps.sum())
    if not move.length >= length * (1.0 - _FINEST) - 1e-9 or not np.isfinite(move.length):
        raise _refused(by, f"it says that a way of {length * world.grid.resolution:.3f} m cost "
                           f"{move.length * world.grid.resolution:.3f} m", "motion")  # fmt: skip
    if move.rest.size and move.rest[0] != move.pose.row * cols + move.pose.col:
        raise _refused(by, f"the path it leaves starts at {_place(int(move.rest[0]), cols)}, the robot is at "
                           f"{_at(move.pose)}", "motion")  # fmt: skip


def way_of(move: Move, pose: Pose, cols: int) -> NDArray[np.float64]:
    """Return the line of the robot's centre during ``move``: [k, 2] (row, col) in cells."""
    if move.way is not None:
        return np.asarray(move.way, dtype=np.float64).reshape(-1, 2)
    passed = np.stack(np.divmod(move.cells, cols), axis=1).astype(np.float64)
    return np.concatenate([[centre_of(pose)], passed])


def centre_of(pose: Pose) -> tuple[float, float]:
    """Return the (row, col) of the robot's centre [cells]."""
    return pose.row + pose.north, pose.col + pose.east


def _hits(way: NDArray[np.float64], blocked: Cells) -> int:
    """Return the first blocked flat cell on ``way``, -1 for none; twenty points of each piece are looked at."""
    rows, cols = blocked.shape
    if len(way) < 2:
        return -1
    share = np.arange(20)[:, None] / 20.0
    points = np.concatenate([a + share * (b - a) for a, b in pairwise(way)] + [way[-1:]])
    row, col = np.floor(points + 0.5).astype(np.int64).T
    outside = (row < 0) | (row >= rows) | (col < 0) | (col >= cols)
    row, col = row.clip(0, rows - 1), col.clip(0, cols - 1)
    hit = np.flatnonzero(outside | (blocked[row, col] != 0))
    return int(row[hit[0]] * cols + col[hit[0]]) if hit.size else -1


def _flat(values: object, kind: type[np.generic]) -> TypeGuard[NDArray[Any]]:
    return isinstance(values, np.ndarray) and values.ndim == 1 and values.dtype == kind


def _kind(values: object) -> str:
    return f"{values.dtype} {values.shape}" if isinstance(values, np.ndarray) else type(values).__name__


def _place(cell: int, cols: int) -> str:
    return f"row {int(cell) // cols}, col {int(cell) % cols}"


def _spot(point: NDArray[np.float64]) -> str:
    return f"row {point[0]:.2f}, col {point[1]:.2f}"


def _at(pose: Pose) -> str:
    return "row {:.2f}, col {:.2f}".format(*centre_of(pose))


def _refused(by: str, what: str, part: str) -> RobotError:
    return RobotError(f"{by}: {what}. No cost is recorded; mend the {part}.")
