"""A plan's true map, and what is made of it once however many drive on it."""

from functools import cached_property

from pipeline.grids.store import GridRecord
from pipeline.simulation.world import World, make_world


class Ground:
    """Where trials take place."""

    def __init__(self, record: GridRecord) -> None:
        """Take the map of ``record``, for a robot of its radius."""
        self.record = record

    @cached_property
    def world(self) -> World:
        """The building as the simulation needs it."""
        record = self.record
        return make_world(record.plan_id, record.grid, record.robot_radius_m, record.layers)
