"""A PNG in three greys with its scale inside: white free, grey unknown, black occupied.

Cells, resolution and origin come back exactly: they stand in a text entry of the PNG, which `raster_picture` reads and
which most programs keep. The resolution is not written as pHYs, pixels per metre of paper: it has whole pixels only,
and of scanned drawings it tells the size of the sheet. Furniture is written as occupied; doors, rooms, layers and names
are not written.
"""

from dataclasses import dataclass
from pathlib import Path

from pipeline.files import replacing
from pipeline.floorplans.plan import CLUTTER, FREE, OCCUPIED, UNKNOWN, FloorPlan, GridPlan
from pipeline.floorplans.readers.picture import write_picture
from pipeline.floorplans.readers.raster_picture import NOTE, note_of
from pipeline.floorplans.writers.cells import as_grid, coded

_GREY_OF = {FREE: 255, OCCUPIED: 0, UNKNOWN: 128, CLUTTER: 0}


@dataclass(frozen=True)
class RasterPicture:
    """Writer of PNG pictures."""

    name: str = "raster_picture"
    ending: str = ".png"
    needs_cells: bool = True

    def write(self, plan: FloorPlan | GridPlan, path: Path) -> list[Path]:
        """Write ``plan`` to ``path``; see `Writer.write`."""
        grid = as_grid(plan, self.name)
        with replacing(path) as scratch:
            write_picture(scratch, coded(grid, _GREY_OF), notes={NOTE: note_of(grid)})
        return [path]
