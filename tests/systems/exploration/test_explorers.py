"""Explorers: every one sees all that can be reached, in random worlds, with any field of view; and which is next."""

import numpy as np
import pytest

from pipeline.errors import ConfigError, PlannerError
from pipeline.grids.occupancy import FREE, Cell, OccupancyGrid, Point
from pipeline.planning.seen import Seen
from pipeline.simulation.trial import Ending, run_trial
from pipeline.simulation.world import make_world
from pipeline.systems.exploration.explorers import GainSettings, Nearest
from pipeline.systems.exploration.growth import Survey
from pipeline.systems.exploration.settings import PlannerConfig
from tests.systems.exploration.explorations import NAMES, explore, explorer, in_reach, robot_of
from tests.worlds import DEAD_END, Drawing, draw, scattered


def random_world(seed: int) -> tuple[Drawing, float]:
    rng = np.random.default_rng(seed)
    rows, cols = int(rng.integers(5, 19)), int(rng.integers(5, 19))
    cells = scattered(rng, rows, cols, float(rng.uniform(0.0, 0.5)))
    start = Cell(int(rng.integers(1, rows - 1)), int(rng.integers(1, cols - 1)))
    radius = float(rng.choice([0.0, 0.0, 0.5]))
    around = slice(max(1, start.row - 1), start.row + 2), slice(max(1, start.col - 1), start.col + 2)
    cells[around] = FREE
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = 1, 1, 1, 1
    grid = OccupancyGrid(cells, 0.5, Point(-3.0, 2.0))
    if make_world("random", grid, radius).blocked[start]:
        radius = 0.0
    return Drawing(grid, start, start), radius


@pytest.mark.parametrize("view", [360.0, 90.0, 25.0])
@pytest.mark.parametrize("name", NAMES)
def test_all_that_can_be_reached_is_seen_in_random_worlds(name: str, view: float) -> None:
    for seed in range(120):  # 360 worlds for each explorer, a third with each field of view
        drawn, radius = random_world(1000 * int(view) + seed)
        episode, survey, world = explore(
            name, drawn, robot_of(2.0 if seed % 2 else 6.0, view, 0.5 + seed % 3), radius=radius, commit=seed % 4 > 0
        )
        assert episode.ending is Ending.COVERED, (seed, episode.ending)
        assert (episode.known[in_reach(world, drawn)] == FREE).all(), seed
        assert survey.seen == survey.reachable == in_reach(world, drawn).sum(), seed


@pytest.mark.parametrize("view", [360.0, 90.0])
@pytest.mark.parametrize("name", NAMES)
def test_the_same_exploration_twice_takes_one_way_and_leaves_the_map_alone(name: str, view: float) -> None:
    drawn = draw(*DEAD_END)
    runs = [explore(name, drawn, robot_of(3.0, view))[0] for _ in range(2)]
    assert np.array_equal(runs[0].path, runs[1].path) and runs[0].travelled == runs[1].travelled > 0.0


# S sees 2.2 m around: to the east the hall goes on four cells wide, to the west begins a corridor, one cell nearer.
FORK = (
    "################",
    "######.........#",
    "######.........#",
    "#......S.......#",
    "######.........#",
    "################",
)


def first_target(name: str) -> Cell:
    drawn = draw(*FORK)
    world, robot = make_world("fork", drawn.grid, 0.0), robot_of(2.2)
    planner = explorer(name, robot, world)
    targets = []

    class Once:
        def plan(self, seen: Seen) -> np.ndarray | None:
            path = planner.plan(seen)
            targets.append(divmod(int(path[-1]), seen.map.status.shape[1]))
            return path

    run_trial(world, drawn.start, Survey(world, drawn.start), Once(), robot=robot, rng=np.random.default_rng(0),
              max_steps=1)  # fmt: skip
    return Cell(*targets[0])


def test_the_largest_frontier_and_the_gain_point_into_the_hall() -> None:
    assert first_target("largest").col > 7
    assert first_target("exponential").col > 7
    assert first_target("true_gain").col > 7


class _Liar(Nearest):
    def plan(self, seen: Seen) -> object:
        return None if seen.step > 3 else super().plan(seen)


def test_an_explorer_that_stops_too_early_is_refused() -> None:
    drawn, robot = draw(*DEAD_END), robot_of(3.0)
    world = make_world("house", drawn.grid, 0.0)
    with pytest.raises(PlannerError, match="_Liar on house, scan 5: all was said to be seen, although"):
        run_trial(world, drawn.start, Survey(world, drawn.start), _Liar(robot, PlannerConfig()), robot=robot,
                  rng=np.random.default_rng(0))  # fmt: skip


def test_scores() -> None:
    assert GainSettings(decay_per_m=0.5).score(10.0, 2.0, 0.3) == pytest.approx(10.0 / np.e)
    assert GainSettings(rule="per_distance").score(10.0, 4.0, 0.3) == 2.5
    assert GainSettings(rule="per_distance").score(3.0, 0.0, 0.3) == pytest.approx(10.0)
    with pytest.raises(ConfigError, match=r"settings\.rule = best: expected one of exponential, per_distance"):
        GainSettings(rule="best")
