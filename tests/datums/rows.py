"""Datums made up for tests: well-formed, meaningless."""

import numpy as np

from pipeline.datums import MAP_VIEW, Datum


def make_datum(index: int, *, leads: bool, split: str = "train", seed: int = 0, map_view: bool = False) -> Datum:
    rng = np.random.default_rng([seed, index])
    return Datum(
        pair_id=f"plan-{index % 3}/{index}",
        plan_id=f"plan-{index % 3}",
        building=f"building-{index % 2}",
        environment="guided_maze",
        split=split,
        seed=seed,
        step=index,
        subgoal=index % 4,
        pose_x_m=float(rng.normal()),
        pose_y_m=float(rng.normal()),
        heading_rad=float(rng.uniform(-3, 3)),
        ranges=rng.uniform(0.5, 10.0, 256),
        goal_x_m=float(rng.normal() * 5),
        goal_y_m=float(rng.normal() * 5),
        subgoal_x_m=float(rng.normal() * 3),
        subgoal_y_m=float(rng.normal() * 3),
        leads_to_goal=leads,
        delta_success_m=float(rng.uniform(0, 9)) if leads else None,
        exploration_m=None if leads else float(rng.uniform(1, 30)),
        weight_m=float(rng.uniform(1, 20)),
        frontier_cells=7,
        map_view=rng.uniform(0.0, 15.0, MAP_VIEW) if map_view else None,
    )


def make_datums(count: int, *, split: str = "train", seed: int = 0, map_view: bool = False) -> list[Datum]:
    return [
        make_datum(index, leads=index % 3 == 0, split=split, seed=seed, map_view=map_view) for index in range(count)
    ]
