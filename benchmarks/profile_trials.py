"""Where the time of a trial goes: python -m benchmarks.profile_trials [FILE.json]

One thread, the subgoal planner and the optimistic one, in a guided maze and on a real MIT floor as the reference drives
it. Shares are of the time in each module of this project, numba kernels and the Python around them apart.
"""

import cProfile
import json
import pstats
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
from numba.core.dispatcher import Dispatcher

from benchmarks.worlds import MIT, SETTINGS, Trial
from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.planning.protocols import Planner
from pipeline.simulation.trial import run_trial
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner

TRIALS = 6


def share_of_kernels(name: str, who: str) -> dict[str, float]:
    """Return the share of the time in each kernel of at least 1 %; the rest is Python."""
    setting = SETTINGS[name]
    trials = [setting.draw(index) for index in range(TRIALS)]

    def planner(trial: Trial) -> Planner:
        return OptimisticPlanner() if who == "optimistic" else SubgoalPlanner(estimator=PerfectEstimator(trial.world))

    def drive_all() -> None:
        for trial in trials:
            run_trial(*trial, planner(trial), robot=setting.robot, rng=np.random.default_rng(0))  # fmt: skip

    drive_all()
    profile = cProfile.Profile()
    profile.runcall(drive_all)
    seconds: dict[str, float] = defaultdict(float)
    for (file, _, function), (_, _, own, _, _) in pstats.Stats(profile).stats.items():  # type: ignore[attr-defined]
        path = Path(file)
        module = (
            ".".join(path.parts[path.parts.index("pipeline") :]).removesuffix(".py") if "pipeline" in path.parts else ""
        )
        found = getattr(sys.modules.get(module), function, None)
        kernel = isinstance(found, Dispatcher) and found.py_func.__module__ == module
        seconds[f"{module.removeprefix('pipeline.')}.{function}" if kernel else "Python"] += own
    whole = sum(seconds.values())
    shares = {name: value / whole for name, value in seconds.items() if value >= 0.01 * whole}
    return dict(sorted(shares.items(), key=lambda item: -item[1]))


def main() -> None:
    """Print the shares, and write them where asked."""
    names = ["maze", *(["fine floors"] if MIT.is_dir() else [])]
    found = {f"{name}, {who}": share_of_kernels(name, who) for name in names for who in ("optimistic", "perfect")}
    for title, shares in found.items():
        print(title)
        for name, share in shares.items():
            print(f"  {share:5.1%}  {name}")
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
