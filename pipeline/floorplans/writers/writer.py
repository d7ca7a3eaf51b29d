"""What a writer of floor plans is."""

from pathlib import Path
from typing import Protocol

from pipeline.floorplans.plan import FloorPlan, GridPlan


class Writer(Protocol):
    """One format. A plan that is written and read back has the same grid."""

    @property
    def name(self) -> str:
        """Name in the registry; the reader of the same name reads what it writes."""
        ...

    @property
    def ending(self) -> str:
        """Ending of the file names, such as ``.yaml``."""
        ...

    @property
    def needs_cells(self) -> bool:
        """Whether it writes grids alone; geometry has to be rasterised first."""
        ...

    def write(self, plan: FloorPlan | GridPlan, path: Path) -> list[Path]:
        """Write ``plan`` to ``path`` and what belongs to it beside it, each atomically; returns the files.

        Raises:
            PlanError: the format cannot hold this plan.
        """
        ...
