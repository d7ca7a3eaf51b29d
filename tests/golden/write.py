"""Golden episodes: what each planner does in worlds a reader can see. Rewrite them: python -m tests.golden.write

A commit that moves one says why.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.planning.optimistic import OptimisticPlanner
from pipeline.simulation.trial import Robot, run_trial
from pipeline.simulation.world import make_world
from pipeline.systems.subgoals.perfect import PerfectEstimator
from pipeline.systems.subgoals.planner import SubgoalPlanner
from tests.worlds import DEAD_END, SEALED_GOAL, TWO_ROOMS, WIDE_FRONTIERS, draw, small_lidar

FOLDER = Path(__file__).parent
WORLDS = {"two_rooms": TWO_ROOMS, "dead_end": DEAD_END, "sealed_goal": SEALED_GOAL, "wide_frontiers": WIDE_FRONTIERS}


def episodes(name: str) -> dict[str, Any]:
    """Return the drives of both planners through the world of this name, as plain values."""
    drawn = draw(*WORLDS[name])
    world = make_world(name, drawn.grid, 0.0)
    found = {}
    for planner in ("optimistic", "perfect"):
        driver = OptimisticPlanner() if planner == "optimistic" else SubgoalPlanner(estimator=PerfectEstimator(world))
        episode = run_trial(
            world,
            drawn.start,
            drawn.goal,
            driver,
            robot=Robot(small_lidar(3.0), step_m=1.8),
            rng=np.random.default_rng(0),
        )
        rows, cols = np.divmod(episode.path, world.grid.cells.shape[1])
        found[planner] = {
            "ending": str(episode.ending),
            "travelled_m": round(episode.travelled, 6),
            "scans": episode.steps,
            "path": [f"{row},{col}" for row, col in zip(rows, cols, strict=True)],
        }
    return found


if __name__ == "__main__":
    for world_name in WORLDS:
        text = json.dumps(episodes(world_name), indent=1)
        (FOLDER / f"{world_name}.json").write_text(text + "\n", encoding="utf-8")
