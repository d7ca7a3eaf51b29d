"""What the numbers among the reading options may be: one place for the configuration and for the command line."""

RANGES: dict[str, tuple[float, float]] = {
    "metres_per_unit": (1e-6, 1000.0),  # [m]
    "free_thresh": (0.0, 1.0),
    "occupied_thresh": (0.0, 1.0),
    "door_width_m": (0.3, 10.0),
    "wall_m": (0.01, 2.0),
}
"""Least and largest value, both allowed, of fields of `pipeline.floorplans.readers.reader.ReadOptions`."""
