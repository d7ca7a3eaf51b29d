"""What a reader of floor plans is."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FloorPlan, GridPlan

FREE_THRESH, OCCUPIED_THRESH = 0.196, 0.65
"""The thresholds of ROS: grey 205, which map savers write for what was not seen, has 0.19608 and is unknown."""


@dataclass(frozen=True, kw_only=True)
class ReadOptions:
    """What a person may say about files that do not say it themselves (conf/plans/: ``read``).

    metres_per_unit: size of a pixel or drawing unit [m]; needed where the format has no scale, refused by readers
    whose format states it. invert: dark pixels are free. free_thresh, occupied_thresh: a pixel whose darkness (0
    white to 1 black, after ``invert``) is below the first is free, above the second occupied, between them unknown;
    None takes what the file states, else the thresholds of ROS, where grey 205 is unknown: see `thresholds`. paper: in
    grids, free space around the house that reaches the border is paper, and no floor: see `pipeline.floorplans.paper`.
    door_width_m: width cut for doors that the file gives without one [m]. wall_m: thickness of walls drawn as lines
    [m]. levels: read only these floors of a file; empty reads all. wall_layers, door_layers: names, with * and ?, of
    the layers or classes of a drawing that hold walls and doors; empty takes the reader's own list.
    """

    metres_per_unit: float | None = None
    invert: bool = False
    free_thresh: float | None = None
    occupied_thresh: float | None = None
    paper: bool = False
    door_width_m: float = 0.9
    wall_m: float = 0.1
    levels: tuple[str, ...] = ()
    wall_layers: tuple[str, ...] = ()
    door_layers: tuple[str, ...] = ()

    def thresholds(self, free: float = FREE_THRESH, occupied: float = OCCUPIED_THRESH) -> tuple[float, float]:
        """Return the two thresholds: those given, else ``free`` and ``occupied``, which a file may state."""
        given = (self.free_thresh, self.occupied_thresh)
        return free if given[0] is None else given[0], occupied if given[1] is None else given[1]


class Reader(Protocol):
    """One format. ``patterns`` are the file names it looks for in a folder, such as ``*.npz``."""

    @property
    def name(self) -> str:
        """Name in the registry and in the configuration."""
        ...

    @property
    def patterns(self) -> Sequence[str]:
        """File names that may hold a plan of this format."""
        ...

    @property
    def uses(self) -> Sequence[str]:
        """Names of the fields of `ReadOptions` that change what is read; `read_plans` speaks of the others."""
        ...

    def sniff(self, path: Path) -> bool:
        """Return whether the content of ``path`` looks like this format. Never raises on a foreign file."""
        ...

    def accompanies(self, path: Path) -> bool:
        """Return whether ``path`` belongs to a plan without holding one itself: a scenario, a mask, an index."""
        ...

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield each plan in ``path``, or the error that says why one record of it is none.

        The building is the best guess from the file itself; a manifest's wins over it later (`read_plans`).

        Raises:
            PlanError: the file as a whole is missing, damaged or lacks something; names it and what was expected.
        """
        ...
