"""A made-up artifacts folder: what evaluate, train and harvest would leave behind, without running them."""

from pathlib import Path

import numpy as np

from pipeline.evaluation.summary import summarise
from pipeline.evaluation.trials import EpisodeRow, TrialRow, write_episodes, write_trials
from pipeline.files import write_json
from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN
from pipeline.learning.curves import CurvePoint, write_curves
from pipeline.systems.subgoals.estimates import EstimateRow, estimates_table, measure_estimates

ROLES = {"optimistic": "baseline", "learned": "candidate", "perfect": "bound", "known_map": "bound"}
REMARK = "The network was made with sensor.max_range_m = 6.0, these trials are driven with 8.0."


def write_artifacts(root: Path, *, trials: int = 80, buildings: int = 4, recorded: int = 5, seed: int = 0) -> Path:
    """Write a whole folder and return it."""
    rng = np.random.default_rng(seed)
    rows = [row for index in range(trials) for row in made_up_trial(rng, index, f"building-{index % buildings}")]
    table = write_trials(root / "evaluate/trials.parquet", rows)
    measures = measure_estimates({"estimates": estimates_table(made_up_estimates(rng, 600))})
    costs = {(row.trial_id, row.competitor): row.cost_m for row in rows}
    episodes = [
        made_up_episode(trial_id, name, costs[trial_id, name])
        for trial_id in sorted({row.trial_id for row in rows})[:recorded]
        for name in ("optimistic", "learned")
    ]
    write_episodes(root / "evaluate/episodes.parquet", episodes)
    points = [
        CurvePoint(step, split, name, float(lift + 2.0 * np.exp(-step / 2000) + 0.02 * rng.normal()))
        for name, lift in (("loss", 1.0), ("cross_entropy", 0.4), ("delta_success_loss", 0.3))
        for step in range(100, 10_001, 100)
        for split in ("train", "validation")
    ]
    write_curves(root / "train/curves.parquet", points)
    write_json(
        root / "train/train.json", {"steps": 10000, "train": {"auc": 0.94}, "validation": {"auc": 0.91, "rows": 4000.0}}
    )
    summary = summarise(table, 7, measures=measures, ransac_threshold_m=3.0, remarks=[REMARK], resamples=200)
    write_json(root / "evaluate/summary.json", summary)
    write_json(root / "harvest/harvest.json", {"datums": 31234, "plans": 90, "digest": "ab" * 32})
    return root


def made_up_trial(rng: np.random.Generator, index: int, building: str) -> list[TrialRow]:
    """Return one trial of all competitors; roughly one in thirty goes badly for the learned planner."""
    known = rng.uniform(8.0, 30.0)
    optimistic = known * rng.uniform(1.0, 2.4)
    perfect = min(optimistic, known * rng.uniform(1.0, 1.4))
    learned = optimistic * rng.uniform(1.2, 1.6) if index % 30 == 17 else min(optimistic, known * rng.uniform(1, 1.9))
    costs = dict(zip(ROLES, (optimistic, learned, perfect, known), strict=True))
    return [
        TrialRow(
            trial_id=f"plan-{index:03d}/0",
            plan_id=f"plan-{index:03d}",
            building=building,
            environment="guided_maze",
            split="test",
            competitor=name,
            role=ROLES[name],
            title=name.replace("_", " "),
            place=list(ROLES).index(name),
            cost_m=cost,
            ending="reached",
            steps=0 if name == "known_map" else 120,
            decisions=0 if name == "known_map" else 30,
            seconds=0.0 if name == "known_map" else 0.36,
            start_x_m=1.0,
            start_y_m=2.0,
            goal_x_m=9.0,
            goal_y_m=3.0,
        )
        for name, cost in costs.items()
    ]


def made_up_estimates(rng: np.random.Generator, count: int) -> list[EstimateRow]:
    """Return estimates of a network that is a little too sure of itself."""
    rows = []
    for index in range(count):
        chance = float(rng.beta(0.5, 0.8))
        leads = bool(rng.random() < 0.1 + 0.8 * chance)
        delta, beyond = float(rng.exponential(4.0)), float(rng.exponential(9.0))
        rows.append(
            EstimateRow(
                trial_id=f"plan-{index % 40:03d}/0",
                competitor="learned",
                step=index // 40,
                p_success=chance,
                delta_success_m=delta + float(rng.normal(0.3, 1.0)),
                exploration_m=beyond + float(rng.normal(0.0, 2.0)),
                leads_to_goal=leads,
                true_delta_success_m=delta if leads else None,
                true_exploration_m=None if leads else beyond,
                weight_m=beyond,
            )
        )
    return rows


def made_up_episode(trial_id: str, competitor: str, cost_m: float) -> EpisodeRow:
    """Return a drive through two rows of rooms off a corridor; its eastern end stays unseen."""
    truth = np.full((41, 81), OCCUPIED, dtype=np.uint8)
    truth[18:23, 1:80] = FREE
    for left in range(1, 80, 10):
        truth[1:17, left : left + 8] = FREE
        truth[24:40, left : left + 8] = FREE
        truth[17, left + 3 : left + 5] = FREE
        truth[23, left + 3 : left + 5] = FREE
    known = truth.copy()
    known[:, 61:] = UNKNOWN
    known[24:40, 20:40] = UNKNOWN
    path_col = np.concatenate([np.arange(4, 55), np.full(14, 54)])
    path_row = np.concatenate([np.full(51, 20), np.arange(20, 34)])
    frontier_col = np.array([*range(21, 29), *range(31, 39), *([60] * 5)])
    frontier_row = np.array([*([24] * 16), *range(18, 23)])
    chance = np.repeat([0.15, 0.55, 0.9], [8, 8, 5])
    if competitor == "optimistic":
        frontier_col, frontier_row, chance = frontier_col[:0], frontier_row[:0], chance[:0]
    return EpisodeRow(
        trial_id=trial_id,
        competitor=competitor,
        plan_id=trial_id.split("/")[0],
        resolution_m=0.25,
        origin_x_m=-2.0,
        origin_y_m=1.0,
        truth=truth,
        known=known,
        path_row=path_row,
        path_col=path_col,
        frontier_step=np.arange(frontier_col.size),
        frontier_row=frontier_row,
        frontier_col=frontier_col,
        frontier_p=chance,
        cost_m=cost_m,
        start_row=20,
        start_col=4,
        goal_row=33,
        goal_col=54,
    )
