"""Learned subgoal planning as the stages see it (Stein, Bradley and Roy, CoRL 2018)."""

from pipeline.systems.subgoals.settings import EvaluateConfig, HarvestConfig, PlannerConfig, TrainConfig
from pipeline.systems.system import System

SYSTEM = System(
    name="subgoals",
    title="Learned subgoal planning",
    settings={
        "planner": PlannerConfig,
        "harvest": HarvestConfig,
        "train": TrainConfig,
        "evaluate": EvaluateConfig,
    },
    harvest="pipeline.systems.subgoals.harvest_units:HARVEST",
    training="pipeline.systems.subgoals.training:train",
    contest="pipeline.systems.subgoals.contest:CONTEST",
    figures="pipeline.systems.subgoals.figures:FIGURES",
)
