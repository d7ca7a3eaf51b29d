"""Degrees of longitude and latitude to metres around a building, and back.

A transverse Mercator projection whose origin is at the building: x points east, y north, and lengths are true to 1 in
10 million within 2 km of the origin, where floors end. Buildings keep their angle against north.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from pipeline.errors import PlanError

_FARTHEST_DEG = 0.05  # 5 km: no building is larger
_NORTHERNMOST = 85.0  # beyond, a degree of longitude is too short to trust


@dataclass(frozen=True)
class LocalFrame:
    """Metres around the point ``longitude``, ``latitude`` [degrees, WGS84], which becomes (0, 0)."""

    longitude: float
    latitude: float

    def to_metres(self, shape: shapely.Geometry) -> shapely.Geometry:
        """Return ``shape``, in degrees (longitude, latitude), in metres (east, north).

        Raises:
            PlanError: a coordinate lies more than 0.05 degrees from the origin, or is no degree at all.
        """

        def project(degrees: NDArray[np.float64]) -> NDArray[np.float64]:
            degrees = np.column_stack([_beside(self.longitude, degrees[:, 0]), degrees[:, 1]])
            offset = np.abs(degrees - [self.longitude, self.latitude]) * [np.cos(np.radians(self.latitude)), 1.0]
            if not (offset <= _FARTHEST_DEG).all():
                raise PlanError(
                    f"a coordinate lies more than {_FARTHEST_DEG:g} degrees from ({self.longitude:g}, "
                    f"{self.latitude:g}), expected one building in degrees of WGS84. Remove what is elsewhere."
                )
            return np.column_stack(_projection(self.longitude, self.latitude)(*degrees.T))

        return shapely.transform(shape, project)

    def to_degrees(self, shape: shapely.Geometry) -> shapely.Geometry:
        """Return ``shape``, in metres (east, north), in degrees (longitude, latitude)."""

        def back(metres: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.column_stack(_projection(self.longitude, self.latitude)(*metres.T, inverse=True))

        return shapely.transform(shape, back)


def frame_around(shapes: Iterable[shapely.Geometry]) -> LocalFrame:
    """Return the frame with its origin in the middle of ``shapes``, which are in degrees (longitude, latitude).

    Shapes on both sides of the 180th meridian lie beside each other, whether longitudes jump there or run on beyond it.

    Raises:
        PlanError: nothing to project, or coordinates that cannot be degrees, such as metres of a national grid.
    """
    listed = list(shapes)
    west, south, east, north = shapely.total_bounds(listed).tolist() if listed else [np.nan] * 4
    if np.isnan(west):
        raise PlanError("there is nothing with coordinates. Check what the file holds.")
    if not (-360 <= west <= east <= 360 and -_NORTHERNMOST <= south <= north <= _NORTHERNMOST):
        raise PlanError(
            f"coordinates reach from ({west:g}, {south:g}) to ({east:g}, {north:g}), expected degrees of longitude and "
            "latitude (WGS84). Project the file to WGS84."
        )
    if east - west > 180:
        longitudes = shapely.get_coordinates(listed)[:, 0] % 360
        west, east = float(longitudes.min()), float(longitudes.max())
    middle = np.array([(west + east) / 2])
    return LocalFrame(float(_beside(0.0, middle)[0]), (south + north) / 2)


def _beside(longitude: float, others: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return longitudes [degrees], those more than half a turn away from ``longitude`` a whole turn nearer to it."""
    away = others - longitude
    return np.where(away > 180, others - 360, np.where(away < -180, others + 360, others))


@lru_cache(maxsize=16)
def _projection(longitude: float, latitude: float) -> Any:
    from pyproj import Proj  # takes a fifth of a second to import, and most formats are in metres

    return Proj(proj="tmerc", lon_0=longitude, lat_0=latitude, k=1, ellps="WGS84")
