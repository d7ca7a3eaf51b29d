"""Whole trials per second on one core, beside the figures of the method's public reference implementation.

Setting: guided mazes of 144 x 188 cells of 0.3 m, a lidar of 18 m and 1,024 rays, a step of 1.8 cells, one thread.
The reference's figures (0.25 optimistic and 0.039 learned trials per second) are for mazes of the same size, range
and step, with corridors and a network of its own, on one core of a Xeon with two; here they are constants.
"""

import numpy as np
import pytest

from benchmarks.worlds import Trial, draw_trial
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.protocols import Planner
from pipeline.simulation.lidar import make_lidar
from pipeline.simulation.trial import Ending, run_trial
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner

REFERENCE_TRIALS_PER_S = {"optimistic": 0.25, "subgoal": 0.039}
TRIALS = 8


def planner_for(name: str, trial: Trial) -> Planner:
    """Labels cost more time than a network does, so the perfect estimator is the slow case of a subgoal planner."""
    return OptimisticPlanner() if name == "optimistic" else SubgoalPlanner(estimator=PerfectEstimator(trial.world))


@pytest.mark.parametrize("name", sorted(REFERENCE_TRIALS_PER_S))
def test_trials_per_second(benchmark, name: str) -> None:
    trials = [draw_trial(index) for index in range(TRIALS)]
    lidar = make_lidar(beams=1024, input_beams=256, max_range_m=18.0)

    def run_all() -> None:
        for trial in trials:
            episode = run_trial(trial.world, trial.start, trial.goal, planner_for(name, trial), lidar=lidar,
                                step_m=0.54, rng=np.random.default_rng(0))  # fmt: skip
            assert episode.ending is Ending.REACHED

    benchmark.pedantic(run_all, rounds=3, warmup_rounds=1)
    rate = TRIALS / benchmark.stats.stats.min
    benchmark.extra_info |= {"trials_per_s": rate, "over_reference": rate / REFERENCE_TRIALS_PER_S[name]}
    print(f"\n{name}: {rate:.2f} trials/s, {rate / REFERENCE_TRIALS_PER_S[name]:.0f} x the reference")
    assert rate >= 10.0 * REFERENCE_TRIALS_PER_S[name]
