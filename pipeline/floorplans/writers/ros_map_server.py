"""ROS map_server maps: a YAML file beside a PGM picture, as https://wiki.ros.org/map_server describes them.

The format holds cells, resolution and origin exactly. It has no furniture, which is written as occupied, and no doors,
rooms, layers or names.
"""

from dataclasses import dataclass
from pathlib import Path

import yaml

from pipeline.files import replacing, write_text
from pipeline.floorplans.plan import CLUTTER, FREE, OCCUPIED, UNKNOWN, FloorPlan, GridPlan
from pipeline.floorplans.readers.picture import write_picture
from pipeline.floorplans.readers.reader import FREE_THRESH, OCCUPIED_THRESH
from pipeline.floorplans.writers.cells import as_grid, coded

_GREY_OF = {FREE: 254, OCCUPIED: 0, UNKNOWN: 205, CLUTTER: 0}


@dataclass(frozen=True)
class RosMapServer:
    """Writer of YAML + PGM maps."""

    name: str = "ros_map_server"
    ending: str = ".yaml"
    needs_cells: bool = True

    def write(self, plan: FloorPlan | GridPlan, path: Path) -> list[Path]:
        """Write ``plan`` as ``path`` (YAML) and a PGM picture of the same name beside it; see `Writer.write`."""
        grid = as_grid(plan, self.name)
        picture = path.with_suffix(".pgm")
        with replacing(picture) as scratch:
            write_picture(scratch, coded(grid, _GREY_OF))
        header = {
            "image": picture.name,
            "mode": "trinary",
            "resolution": float(grid.resolution),
            "origin": [float(grid.origin.x), float(grid.origin.y), 0.0],
            "negate": 0,
            "occupied_thresh": OCCUPIED_THRESH,
            "free_thresh": FREE_THRESH,
        }
        write_text(path, yaml.safe_dump(header, sort_keys=False))
        return [path, picture]
