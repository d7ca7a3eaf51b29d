"""Draw the pictures of environments.md: ``python docs/draw_environments.py``, a minute."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from pipeline.floorplans.generators.campus import CampusShape, draw_campus
from pipeline.floorplans.generators.campus_layout import LAYOUTS
from pipeline.floorplans.generators.clutter import ClutterShape, add_clutter
from pipeline.floorplans.generators.forest import ForestShape, draw_forest
from pipeline.floorplans.generators.guided_maze import MazeShape, draw_guided_maze
from pipeline.floorplans.generators.office import OfficeShape, draw_office
from pipeline.floorplans.plan import FloorPlan
from pipeline.randomness import stream
from pipeline.reports.contact_sheet import draw_tile, write_contact_sheet

IMAGES = Path(__file__).parent / "images"
SIDE = 330  # of one plan [pixels]


class Picture(NamedTuple):
    """A picture of several plans, and how many stand side by side."""

    name: str
    plans: Sequence[FloorPlan]
    columns: int


def pictures() -> list[Picture]:
    """Draw all plans; the name of each says what was changed from the defaults."""
    return [
        Picture("guided-maze", mazes(), 4),
        Picture("forest", forests(), 3),
        Picture("office", offices(), 3),
        Picture("campus", campus_floors(), 3),
        Picture("clutter", furnished_floors(), 3),
    ]


def mazes() -> list[FloorPlan]:
    """Return the default maze, one with loops, one with narrower corridors, and a larger one."""
    shapes = {
        "defaults": MazeShape(),
        "loops=0.3": MazeShape(loops=0.3),
        "corridor_m=1.2": MazeShape(corridor_m=1.2),
        "columns=12 rows=16": MazeShape(columns=12, rows=16),
    }
    return [draw_guided_maze(shape, stream(0, "maze"), plan_id=name) for name, shape in shapes.items()]


def forests() -> list[FloorPlan]:
    """Return forests of three densities."""
    shapes = {
        "defaults": ForestShape(),
        "density=0.5": ForestShape(density=0.5),
        "gap_m=1.0 max_radius_m=0.5": ForestShape(gap_m=1.0, max_radius_m=0.5),
    }
    return [draw_forest(shape, stream(0, "forest"), plan_id=name) for name, shape in shapes.items()]


def offices() -> list[FloorPlan]:
    """Return one long hallway, and crossing ones."""
    shapes = {f"hallways={count}": OfficeShape(hallways=count) for count in (1, 3, 5)}
    return [draw_office(shape, stream(0, "office"), plan_id=name) for name, shape in shapes.items()]


def campus_floors() -> list[FloorPlan]:
    """Return a floor of each layout."""
    return [
        draw_campus(CampusShape(layout=layout), stream(2, "campus", layout), plan_id=f"layout={layout}")
        for layout in LAYOUTS
    ]


def furnished_floors() -> list[FloorPlan]:
    """Return one floor with three arrangements of furniture."""
    plan = draw_campus(CampusShape(layout="ell", length_high_m=40.0, width_high_m=22.0), stream(0, "c"), plan_id="c")
    shapes = {
        "defaults": ClutterShape(),
        "per_m2=0.2": ClutterShape(per_m2=0.2),
        "per_m2=0.2 turned_share=1": ClutterShape(per_m2=0.2, turned_share=1.0),
    }
    return [
        add_clutter(replace(plan, plan_id=name), shape, stream(0, "clutter", name)) for name, shape in shapes.items()
    ]


if __name__ == "__main__":
    for name, plans, columns in pictures():
        write_contact_sheet([draw_tile(plan, SIDE) for plan in plans], IMAGES / f"env-{name}.png", columns=columns)
