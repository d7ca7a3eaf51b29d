"""One loop for every planner: sense, decide, move, until the trial ends."""

from collections.abc import Callable
from enum import StrEnum
from time import perf_counter
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import TrialError
from pipeline.grids.distances import NOWHERE, Indices
from pipeline.grids.occupancy import Cell, Cells
from pipeline.planning.protocols import Course, Notices, Planner
from pipeline.planning.seen import NO_GOAL, RANGES, Belief, Observation, Pose, Seen
from pipeline.simulation.answers import check_covered, check_surrender, checked_path, never_moves
from pipeline.simulation.car import Car
from pipeline.simulation.lidar import ALL_AROUND, Lidar
from pipeline.simulation.mapper import PartialMapper, contact
from pipeline.simulation.motion import Walk
from pipeline.simulation.protocols import MapperFactory, Motion, Move, Sensor
from pipeline.simulation.sweep import sweep_with
from pipeline.simulation.vouching import vouch_map, vouch_move, vouch_observation
from pipeline.simulation.world import World, require_inside, require_standing_room

_NO_RANGES = np.zeros(0, dtype=np.float32)


class Ending(StrEnum):
    """How a trial ended, in a sentence."""

    REACHED = "reached the goal"
    COVERED = "saw all that can be reached"
    UNREACHABLE = "no frontier is left that could lead to the goal: it cannot be reached"
    CUT_OFF = "step limit: the cost is only a lower bound, so no ratio is formed"


class Episode(NamedTuple):
    """A finished trial.

    ending: how it ended.
    travelled: distance really travelled [m].
    path: [k] int32 flat cells the robot's centre passed, from the start on.
    steps: number of scans; decisions: number of times the planner was asked.
    seconds: wall time of the loop [s]: sensing, deciding and moving, without what was done ``aside``.
    known: [rows, cols] uint8, the robot's map at the end.
    """

    ending: Ending
    travelled: float
    path: NDArray[np.int32]
    steps: int
    decisions: int
    seconds: float
    known: Cells


class Robot(NamedTuple):
    """What drives: its parts and its settings.

    sensor, motion, make_mapper: its parts, see ``pipeline.simulation.protocols``.
    step_m: distance between two looks [m], to the nearest cell on the path; at least one cell is moved.
    merge_m: frontiers less than this apart [m], by way of reached space, make one subgoal.
    """

    sensor: Sensor
    step_m: float
    merge_m: float = 0.0
    motion: Motion = Walk()
    make_mapper: MapperFactory = PartialMapper


class Task(Protocol):
    """What a drive is for."""

    @property
    def goal(self) -> Cell:
        """The cell that planners are told of, NO_GOAL for none."""
        ...

    def require(self, world: World) -> None:
        """Raise a TrialError where it cannot be asked in ``world``."""
        ...

    def done(self, seen: Seen) -> Ending | None:
        """Return how the drive ends where that is so; asked after every look."""
        ...

    def surrendered(self, seen: Seen, by: str) -> Ending:
        """Return how a drive ends whose planner sees nothing more to do; raise a PlannerError where there is."""
        ...


class Reach(NamedTuple):
    """Drive to a cell."""

    goal: Cell

    def require(self, world: World) -> None:
        """Check that the goal lies in the grid."""
        require_inside(world, self.goal, "goal")

    def done(self, seen: Seen) -> Ending | None:
        """Return REACHED where the robot stands there."""
        return Ending.REACHED if seen.pose[:2] == self.goal else None

    def surrendered(self, seen: Seen, by: str) -> Ending:
        """Return UNREACHABLE where the map proves it."""
        check_surrender(seen, by)
        return Ending.UNREACHABLE


class Cover(NamedTuple):
    """See all that can be reached; there is no goal."""

    goal: Cell = NO_GOAL

    def require(self, world: World) -> None:
        """Ask for nothing: any world can be covered."""

    def done(self, seen: Seen) -> Ending | None:
        """Leave it to the planner to say so: the robot does not know how large the building is."""
        return None

    def surrendered(self, seen: Seen, by: str) -> Ending:
        """Return COVERED where the map holds no frontier that the robot could drive to."""
        check_covered(seen, by)
        return Ending.COVERED


def require_possible(episode: Episode, known_map_m: float, by: str) -> None:
    """Check that ``episode`` did not reach the goal by less than the shortest way in the true map.

    known_map_m: ``known_map_distance`` of its start and goal [m], times what the robot's motion may ``undercut`` it
    by. by: whose episode, for the message.

    Raises:
        TrialError: it did, so that one of the two belongs to another map, robot, start or goal.
    """
    if episode.ending is Ending.REACHED and episode.travelled < known_map_m - 1e-6:
        raise TrialError(
            f"{by}: reached the goal after {episode.travelled:.3f} m, less than the shortest way in the true map, "
            f"{known_map_m:.3f} m. The pairs belong to other grids or another robot.radius_m: rasterize again."
        )


def run_trial(
    world: World,
    start: Cell,
    goal: Cell | Task,
    planner: Planner,
    *,
    robot: Robot,
    rng: np.random.Generator,
    max_steps: int | None = None,
    aside: Callable[[], None] | None = None,
) -> Episode:
    """Let ``planner`` drive ``robot`` from ``start`` to ``goal``, or for another task, in a world it has not seen.

    The planner is asked again only when a look, or a touch, has changed the map. Between two decisions the map
    therefore grows by at least one cell, and every subgoal's cell borders a cell not yet seen, so a trial always
    ends, and a reachable goal is always reached, whatever an estimator says. Every path is checked before the robot
    follows it, and so is the claim that the goal cannot be reached. A robot that does not see all around turns where
    its way is not seen yet, and looks all around where its path ends in nothing new.

    max_steps: ends the trial as CUT_OFF; default 4 x the number of cells, which no planner of this project meets.
    aside: called after each decision, for whoever keeps records; the robot's clock stands meanwhile.

    Raises:
        TrialError: the robot cannot stand at the start, or the goal is outside the grid.
        PlannerError: an answer of the planner is no path to set out on, or gives up a goal that may be in reach.
        RobotError: a part of the robot reports what is not so.
    """
    task = Reach(goal) if isinstance(goal, Cell) else goal
    require_standing_room(world, start, "start")
    task.require(world)
    drive = _Drive(world, start, task, planner, robot, rng, aside)
    ending = drive.run(max_steps or 4 * world.blocked.size)
    return Episode(
        ending,
        drive.travelled * world.grid.resolution,
        np.concatenate(drive.track),
        drive.step + 1,
        drive.decisions,
        perf_counter() - drive.began - drive.paused,
        drive.belief.map.known,
    )


class _Drive:
    """One trial as it goes on."""

    belief: Belief
    observation: Observation

    def __init__(
        self,
        world: World,
        start: Cell,
        task: Task,
        planner: Planner,
        robot: Robot,
        rng: np.random.Generator,
        aside: Callable[[], None] | None,
    ) -> None:
        self.began, self.paused = perf_counter(), 0.0
        self.world, self.task, self.planner, self.robot, self.rng, self.aside = world, task, planner, robot, rng, aside
        rows, cols = world.blocked.shape
        self.cols, self.metres = cols, world.grid.resolution
        self.mapper = robot.make_mapper(rows, cols, world.disk)
        # A part of this package is held to the truth by its tests; anybody else's at every step.
        self.foreign_sensor, self.foreign_motion = (
            type(robot.sensor) is not Lidar,
            type(robot.motion) not in (Walk, Car),
        )
        self.observed = None if type(self.mapper) is PartialMapper else PartialMapper(rows, cols, world.disk)
        self.sweep = sweep_with(robot.sensor, self.mapper, world)
        self.narrow = robot.sensor.field_of_view < ALL_AROUND
        self.notices = planner if isinstance(planner, Notices) else None
        self.pose = Pose(start.row, start.col, 0.0)
        self.path: Indices = NOWHERE
        self.heading: float | None = None  # which way to face at the end of the path
        self.looks: list[float] | None = None  # where it has yet to look to from here; None: it has not begun to
        self.travelled, self.step, self.decisions = 0.0, 0, 0
        self.track = [np.array([start.row * cols + start.col], dtype=np.int32)]
        self.widen = round(robot.merge_m / (2.0 * self.metres))

    def run(self, most: int) -> Ending:
        for self.step in range(most):
            self.look()
            seen = self.seen()
            if self.notices is not None:
                self.notices.notice(seen)
            done = self.task.done(seen)
            if done is not None:
                return done
            if self.belief.fresh or (self.path.size < 2 and not self.looks):
                ending = self.decide(seen)
                if ending is not None:
                    return ending
            self.go_on()
        return Ending.CUT_OFF

    def look(self) -> None:
        sensor = self.robot.sensor
        if self.sweep is not None:
            self.observation, self.belief = self.sweep(self.pose)
            return
        self.observation = sensor.observe(self.world, self.pose, self.rng)
        if self.foreign_sensor:
            vouch_observation(self.observation, self.world, self.pose, sensor.reach_m, self.name(sensor))
        self.enter(self.observation)

    def enter(self, observation: Observation) -> None:
        self.belief = self.mapper.update(observation)
        if self.observed is not None:
            self.observed.update(observation)
            vouch_map(self.belief.map, self.observed.map, self.name(self.mapper))

    def seen(self) -> Seen:
        observation, belief = self.observation, self.belief
        ranges = observation.channels.get(RANGES, _NO_RANGES)
        return Seen(belief.map, self.pose, self.task.goal, ranges, self.metres, self.step, self.widen,
                    self.travelled * self.metres, observation, belief)  # fmt: skip

    def decide(self, seen: Seen) -> Ending | None:
        chosen = self.planner.plan(seen)
        self.decisions += 1
        if self.aside is not None:
            stopped = perf_counter()
            self.aside()
            self.paused += perf_counter() - stopped
        if chosen is None:
            return self.task.surrendered(seen, self.name(self.planner))
        path, self.heading = chosen if isinstance(chosen, Course) else (chosen, None)
        may_stand = self.narrow or self.heading is not None
        self.path = checked_path(path, seen, self.name(self.planner), may_stand=may_stand)
        return None

    def go_on(self) -> None:
        """Follow the path; turn where that leads nowhere, for the way may lie out of sight."""
        if self.path.size > 1:
            step = self.robot.step_m / self.metres
            move = self.robot.motion.follow(self.path, self.belief.map, self.pose, self.world, step)
            self.make(move)
            if move.cells.size or move.touched.size:
                self.looks = None
                if self.path.size == 1 and self.heading is not None:
                    self.turn(self.heading)
                return
        if self.path.size == 1 and self.heading is not None and _apart(self.heading, self.pose.heading) > 1e-9:
            self.turn(self.heading)
        elif not self.narrow:
            raise never_moves(self.seen(), self.name(self.planner))
        else:
            self.look_around()

    def look_around(self) -> None:
        """Turn on by what is seen at once, first along the path, until all around this place was looked at."""
        if self.looks is None:
            ahead = self.pose.heading
            if self.path.size > 1:
                (row, col), (to_row, to_col) = (
                    divmod(int(self.path[0]), self.cols),
                    divmod(int(self.path[1]), self.cols),
                )
                ahead = float(np.arctan2(to_row - row, to_col - col))
            count = int(np.ceil(ALL_AROUND / self.robot.sensor.field_of_view - 1e-9))
            order = sorted(range(count), key=lambda k: min(k, count - k))
            self.looks = [(ahead + k * ALL_AROUND / count) % ALL_AROUND for k in order]
        if not self.looks:
            raise never_moves(self.seen(), self.name(self.planner))
        self.turn(self.looks.pop(0))

    def turn(self, heading: float) -> None:
        self.make(self.robot.motion.turn(self.pose, heading, self.metres)._replace(rest=self.path))

    def make(self, move: Move) -> None:
        if self.foreign_motion:
            vouch_move(move, self.pose, self.world, self.name(self.robot.motion))
        self.track.append(move.cells)
        self.pose, self.path = move.pose, move.rest
        self.travelled += move.length
        if move.touched.size:
            self.enter(contact(self.pose, move.touched))
            self.path = NOWHERE

    def name(self, part: object) -> str:
        return f"{type(part).__name__} on {self.world.name}"


def _apart(heading: float, other: float) -> float:
    return abs((heading - other + np.pi) % ALL_AROUND - np.pi)
