"""Hinterland as a library: read a plan, make a world, drive a planner, ask a network about a robot's own map.

    import hinterland as hl

    plan = hl.read_plan("floor.dxf")
    world = hl.make_world(plan, resolution_m=0.1)
    drive = hl.drive(world, "optimistic", start=(2.0, 3.0), goal=(30.0, 8.0))
    network = hl.load_network("network.safetensors")
    found = hl.estimate(network, hl.read_map("map.yaml"), pose=(4.1, 2.0, 0.0), goal=(30.0, 8.0))

Positions are metres in the frame of the plan or map: x to the right, y up; angles in radians, counter-clockwise from x.
Nothing here imports a network library, and a module is imported when the first of its names is used.
docs/python.md goes through all of it.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hinterland.drives import Drive, drive
    from hinterland.networks import estimate, load_network
    from hinterland.plans import make_world, rasterize, read_map, read_plan, read_plans, write_map
    from pipeline.errors import HinterlandError
    from pipeline.floorplans.plan import FloorPlan, GridPlan
    from pipeline.floorplans.readers import ReadOptions
    from pipeline.grids.occupancy import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, Point
    from pipeline.planning.protocols import Estimates, Estimator, Planner
    from pipeline.planning.seen import Seen
    from pipeline.settings import RobotConfig, SensorConfig
    from pipeline.simulation.world import World
    from pipeline.systems.subgoals.robot_map import MapEstimate, RankedSubgoal

_PLACES = {
    "hinterland.plans": ("make_world", "rasterize", "read_map", "read_plan", "read_plans", "write_map"),
    "hinterland.drives": ("Drive", "drive"),
    "hinterland.networks": ("estimate", "load_network"),
    "pipeline.errors": ("HinterlandError",),
    "pipeline.floorplans.plan": ("FloorPlan", "GridPlan"),
    "pipeline.floorplans.readers": ("ReadOptions",),
    "pipeline.grids.occupancy": ("FREE", "OCCUPIED", "UNKNOWN", "OccupancyGrid", "Point"),
    "pipeline.planning.protocols": ("Estimates", "Estimator", "Planner"),
    "pipeline.planning.seen": ("Seen",),
    "pipeline.settings": ("RobotConfig", "SensorConfig"),
    "pipeline.simulation.world": ("World",),
    "pipeline.systems.subgoals.robot_map": ("MapEstimate", "RankedSubgoal"),
}
_PLACE_OF = {name: place for place, names in _PLACES.items() for name in names}

__all__ = [
    "FREE",
    "OCCUPIED",
    "UNKNOWN",
    "Drive",
    "Estimates",
    "Estimator",
    "FloorPlan",
    "GridPlan",
    "HinterlandError",
    "MapEstimate",
    "OccupancyGrid",
    "Planner",
    "Point",
    "RankedSubgoal",
    "ReadOptions",
    "RobotConfig",
    "Seen",
    "SensorConfig",
    "World",
    "drive",
    "estimate",
    "load_network",
    "make_world",
    "rasterize",
    "read_map",
    "read_plan",
    "read_plans",
    "write_map",
]


def __getattr__(name: str) -> Any:
    if name not in _PLACE_OF:
        raise AttributeError(f"module 'hinterland' has no attribute {name!r}")
    found = getattr(import_module(_PLACE_OF[name]), name)
    globals()[name] = found  # asked once
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
