"""Grow obstacles by the robot's radius, so that the robot can be treated as a point."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt


def disk_offsets(radius_cells: float) -> NDArray[np.int32]:
    """Return the (row, col) offsets within ``radius_cells`` of a cell, itself included: [k, 2] int32."""
    reach = int(np.floor(radius_cells + 1e-9))
    span = np.arange(-reach, reach + 1)
    rows, cols = np.meshgrid(span, span, indexing="ij")
    inside = rows**2 + cols**2 <= (radius_cells + 1e-9) ** 2
    return np.stack([rows[inside], cols[inside]], axis=1).astype(np.int32)


def inflate(blocked: NDArray[np.bool_], radius_cells: float) -> NDArray[np.bool_]:
    """Return the cells whose centre lies within ``radius_cells`` of a blocked cell's centre: [rows, cols] bool."""
    if radius_cells <= 0 or not blocked.any():
        return blocked.copy()
    clearance: NDArray[np.float64] = distance_transform_edt(~blocked)
    return clearance <= radius_cells + 1e-9
