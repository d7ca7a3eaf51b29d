"""Writers of floor plans, one per format, found by name or by the ending of the file."""

from pipeline.floorplans.writers.geojson import GeoJson
from pipeline.floorplans.writers.moving_ai import MovingAi
from pipeline.floorplans.writers.picture import RasterPicture
from pipeline.floorplans.writers.ros_map_server import RosMapServer
from pipeline.floorplans.writers.writer import Writer

__all__ = ["WRITERS", "Writer"]

_ALL: tuple[Writer, ...] = (RosMapServer(), MovingAi(), RasterPicture(), GeoJson())
WRITERS: dict[str, Writer] = {writer.name: writer for writer in _ALL}
