"""Exploration as the stages see it (Yamauchi 1997; Gonzalez-Banos and Latombe 2002)."""

from pipeline.systems.exploration.settings import EvaluateConfig, HarvestConfig, PlannerConfig
from pipeline.systems.system import System

SYSTEM = System(
    name="exploration",
    title="Exploration",
    settings={"planner": PlannerConfig, "harvest": HarvestConfig, "evaluate": EvaluateConfig},
    harvest="pipeline.systems.exploration.harvest:HARVEST",
    contest="pipeline.systems.exploration.contest:CONTEST",
    figures="pipeline.systems.exploration.figures:FIGURES",
)
