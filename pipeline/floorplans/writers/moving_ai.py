"""Moving AI benchmark maps (.map), and their lists of scenarios (.scen).

A map holds which cells are passable and the terrain of each, nothing else: its cells have no size and no place, so
resolution and origin are lost and must be given again to whoever reads it. Unknown cells are written as out of bounds
and furniture as trees, which are obstacles both; unknown is obstacle when the map is read back.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np

from pipeline.errors import PlanError
from pipeline.files import write_text
from pipeline.floorplans.plan import CLUTTER, FREE, OCCUPIED, UNKNOWN, FloorPlan, GridPlan
from pipeline.floorplans.readers.moving_ai import PASSABLE, TERRAIN, Scenario
from pipeline.floorplans.writers.cells import as_grid, coded

_LETTER_OF = {FREE: ord("."), OCCUPIED: ord("@"), UNKNOWN: ord("O"), CLUTTER: ord("T")}
_LAYER = "terrain"


@dataclass(frozen=True)
class MovingAi:
    """Writer of ``.map`` grids; a layer "terrain" as the reader makes it is kept."""

    name: str = "moving_ai"
    ending: str = ".map"
    needs_cells: bool = True

    def write(self, plan: FloorPlan | GridPlan, path: Path) -> list[Path]:
        """Write ``plan`` to ``path``; see `Writer.write`."""
        grid = as_grid(plan, self.name)
        letters = coded(grid, _LETTER_OF)
        if _LAYER in grid.layers:
            values, labels = grid.layers[_LAYER]
            free = grid.cells[::-1] == FREE
            for letter, terrain in TERRAIN.items():
                of_it = np.isin(values[::-1], [value for value, label in labels.items() if label == terrain])
                letters[of_it & (free == (letter in PASSABLE))] = ord(letter)
        rows, cols = letters.shape
        lines = b"\n".join(row.tobytes() for row in letters).decode("ascii")
        write_text(path, f"type octile\nheight {rows}\nwidth {cols}\nmap\n{lines}\n")
        return [path]


def write_scenarios(path: Path, plan: GridPlan, map_name: str, scenarios: Iterable[Scenario]) -> None:
    """Write ``scenarios`` on ``plan``, which is stored as ``map_name``, atomically.

    Their lengths are those of shortest paths over the passable cells [cells]: a straight move is 1, a diagonal one
    sqrt(2) and needs both cells beside it. They are taken as given, and written to 8 decimals as the benchmark does.

    Raises:
        PlanError: an end is outside the grid or not free, a length is not finite, or the name cannot stand in a table.
    """
    if not map_name.isprintable() or not map_name:
        raise PlanError(f"{path}: {map_name!r} is no name of a map, expected plain letters.")
    rows, cols = plan.cells.shape
    lines = ["version 1"]
    for number, scenario in enumerate(scenarios, start=1):
        for end in (scenario.start, scenario.goal):
            col, row = end
            if not (0 <= col < cols and 0 <= row < rows) or plan.cells[rows - 1 - row, col] != FREE:
                raise PlanError(f"{path}: scenario {number}: column {col}, row {row} from the top is no free cell.")
        if not isfinite(scenario.octile) or scenario.octile < 0:
            raise PlanError(
                f"{path}: scenario {number}: a length of {scenario.octile}, expected one of a path. Omit it."
            )
        numbers = (cols, rows, *scenario.start, *scenario.goal)
        lines.append("\t".join(map(str, (scenario.bucket, map_name, *numbers, f"{scenario.octile:.8f}"))))
    write_text(path, "\n".join(lines) + "\n")
