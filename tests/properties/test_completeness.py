"""The hard invariant: every reachable goal is reached, whatever an estimator says; unreachable ones end saying so."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.grids.inflate import inflate
from pipeline.grids.occupancy import FREE, OCCUPIED
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.protocols import Estimates, Planner
from pipeline.planning.seen import Seen
from pipeline.planning.subgoals import Subgoal, Surroundings
from pipeline.simulation.trial import Ending, Episode, Robot, run_trial
from pipeline.simulation.world import World, known_map_distance, make_world
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner
from tests.systems.contestants import NAMES, contestant, ground_of
from tests.systems.networks import untrained
from tests.worlds import Drawing, cluttered_worlds, small_lidar


class Liar:
    """Says anything at all: sure of dead ends, huge and zero costs, and never the same twice."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    @property
    def lasting(self) -> bool:
        return bool(self._rng.integers(2))

    def estimate(self, seen: Seen, around: Surroundings, subgoals: Sequence[Subgoal]) -> Estimates:
        count = len(subgoals)
        p = self._rng.choice([0.0, 1e-9, 0.5, 1.0], count)
        return Estimates(p, self._rng.choice([0.0, 1e6], count), self._rng.choice([0.0, 3.0, 1e6], count))


# Sure of much that is not so, since they were never trained.
NETWORKS = {frame: [untrained(frame, seed=seed) for seed in range(4)] for frame in ("subgoal", "map")}
PLANNERS: dict[str, Callable[[World, int], Planner]] = {
    "optimistic": lambda world, seed: OptimisticPlanner(),
    "learned": lambda world, seed: SubgoalPlanner(estimator=Liar(seed), max_subgoals=5),
    "learned, rescaled": lambda world, seed: SubgoalPlanner(
        estimator=Liar(seed), max_subgoals=1, rescale_probabilities=True, failure_penalty_m=50.0, optimism=2.0
    ),
    "perfect": lambda world, seed: SubgoalPlanner(estimator=PerfectEstimator(world)),
    "learned, scans": lambda world, seed: SubgoalPlanner(estimator=NETWORKS["subgoal"][seed % 4]),
    "learned, map": lambda world, seed: SubgoalPlanner(estimator=NETWORKS["map"][seed % 4], optimism=1.0),
}


def check_trial(world: World, drawn: Drawing, episode: Episode) -> None:
    shortest = known_map_distance(world, drawn.start, drawn.goal)
    cols = world.blocked.shape[1]
    rows, columns = np.divmod(episode.path, cols)
    moves = np.hypot(np.diff(rows), np.diff(columns)) * world.grid.resolution
    assert (rows[0], columns[0]) == drawn.start
    assert not world.blocked.ravel()[episode.path].any(), "the robot's centre passed through an obstacle"
    corners = world.blocked[rows[:-1], columns[1:]] | world.blocked[rows[1:], columns[:-1]]
    assert not corners.any(), "the robot cut a corner"
    assert moves.max(initial=0.0) < 1.5 * world.grid.resolution
    assert episode.travelled == pytest.approx(moves.sum())
    if np.isinf(shortest):
        assert episode.ending is Ending.UNREACHABLE
        assert "cannot be reached" in episode.ending
    else:
        assert episode.ending is Ending.REACHED
        assert (rows[-1], columns[-1]) == drawn.goal
        assert episode.travelled >= shortest - 1e-9


@pytest.mark.parametrize("name", sorted(PLANNERS))
def test_every_reachable_goal_is_reached(name: str) -> None:
    tried = 0

    @settings(deadline=None, max_examples=1500)
    @given(
        drawn=cluttered_worlds(),
        seed=st.integers(0, 2**31),
        radius=st.sampled_from([0.0, 0.5, 0.8]),
        reach=st.sampled_from([1.3, 4.0, 30.0]),
        step=st.sampled_from([0.1, 0.9, 7.0]),
        merge=st.sampled_from([0.0, 1.0, 3.0]),
    )
    def drive(drawn: Drawing, seed: int, radius: float, reach: float, step: float, merge: float) -> None:
        nonlocal tried
        world = clear_start(drawn, radius)
        if world is None:
            return
        tried += 1
        episode = run_trial(
            world,
            drawn.start,
            drawn.goal,
            PLANNERS[name](world, seed),
            robot=Robot(small_lidar(max_range_m=reach), step_m=step, merge_m=merge),
            rng=np.random.default_rng(seed),
        )
        check_trial(world, drawn, episode)

    drive()
    assert tried > 400, "most worlds were passed over: the property says little"


@pytest.mark.parametrize("name", NAMES)
def test_every_reachable_goal_is_reached_in_the_contest(name: str) -> None:
    entrants = [
        contestant(name, frame=frame, reach=4.0, noise=0.5, step=0.9, merge=1.0, max_subgoals=3)
        for frame in ("subgoal", "map")
    ]
    tried = 0

    @settings(deadline=None, max_examples=300)
    @given(drawn=cluttered_worlds(), seed=st.integers(0, 2**31), radius=st.sampled_from([0.0, 0.5]))
    def compete(drawn: Drawing, seed: int, radius: float) -> None:
        nonlocal tried
        world = clear_start(drawn, radius)
        if world is None:
            return
        tried += 1
        ground, pair = ground_of(drawn._replace(grid=world.grid), radius)
        found = entrants[seed % 2].drive(ground, pair, np.random.default_rng(seed))
        assert found.ending == ("reached" if np.isfinite(pair.known_map_m) else "unreachable")
        assert found.ending != "reached" or found.cost_m >= pair.known_map_m - 1e-6
        for row in found.side.get("estimates", []):
            assert 0.0 < row.p_success < 1.0 and row.delta_success_m >= 0.0 and row.exploration_m >= 0.0
            assert (row.true_exploration_m is None) == row.leads_to_goal != (row.true_delta_success_m is None)

    compete()
    assert tried > 80, "most worlds were passed over: the property says little"


def clear_start(drawn: Drawing, radius: float) -> World | None:
    """Free the cells around the start so that nearly every world is a trial; None where the start stays blocked."""
    cells = drawn.grid.cells.copy()
    if inflate(cells != FREE, radius / drawn.grid.resolution)[drawn.start]:
        row, col = drawn.start
        cells[max(1, row - 2) : row + 3, max(1, col - 2) : col + 3] = FREE
        cells[0], cells[-1], cells[:, 0], cells[:, -1] = OCCUPIED, OCCUPIED, OCCUPIED, OCCUPIED
    world = make_world("random", drawn.grid._replace(cells=cells), radius)
    return None if world.blocked[drawn.start] else world
