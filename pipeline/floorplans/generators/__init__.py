"""Generators of floor plans, by name: each a shape that the configuration fills in, and a function that draws one."""

from typing import Any, NamedTuple, Protocol

import numpy as np

from pipeline.floorplans.generators.campus import CampusShape, draw_campus
from pipeline.floorplans.generators.forest import ForestShape, draw_forest
from pipeline.floorplans.generators.guided_maze import MazeShape, draw_guided_maze
from pipeline.floorplans.generators.office import OfficeShape, draw_office
from pipeline.floorplans.plan import FloorPlan


class DrawPlan(Protocol):
    """Draws one plan of a shape; ``rng`` is consumed and decides alone, with the shape, what comes out."""

    def __call__(self, shape: Any, rng: np.random.Generator, *, plan_id: str, split: str | None = None) -> FloorPlan:
        """Return the plan, a building of its own, drawn for ``split``."""
        ...


class Generator(NamedTuple):
    """What draws the plans of one class of environments.

    shape: its parameters, a frozen dataclass. draw: one plan. section: the key of conf/plans that holds the
    parameters, and the first word in the names of its plans.
    """

    shape: type
    draw: DrawPlan
    section: str


GENERATORS: dict[str, Generator] = {
    "guided_maze": Generator(MazeShape, draw_guided_maze, "maze"),
    "forest": Generator(ForestShape, draw_forest, "forest"),
    "office": Generator(OfficeShape, draw_office, "office"),
    "campus": Generator(CampusShape, draw_campus, "campus"),
}
