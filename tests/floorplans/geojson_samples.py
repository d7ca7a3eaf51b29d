"""GeoJSON files made in the tests: drawn in metres around a place on earth, written in degrees."""

import json
from pathlib import Path

import numpy as np
import shapely
from pyproj import Geod
from shapely.geometry import Point, Polygon, box, mapping

DRESDEN = (13.7232, 51.0254)
WGS84 = Geod(ellps="WGS84")

# An L: turning or mirroring it gives another plan.
ELL = Polygon([(0, 0), (10, 0), (10, 4), (4, 4), (4, 8), (0, 8)])


def degrees(shape: shapely.Geometry, around: tuple[float, float] = DRESDEN) -> shapely.Geometry:
    """Shape in metres east and north of ``around``, by geodesics and not by the projection under test."""

    def there(metres: np.ndarray) -> np.ndarray:
        azimuth, distance = np.degrees(np.arctan2(*metres.T)), np.hypot(*metres.T)
        west, north, _ = WGS84.fwd(*np.full((len(metres), 2), around).T, azimuth, distance)
        return np.column_stack([west, north])

    return shapely.transform(shape, there)


def feature(shape: shapely.Geometry | None, *, around: tuple[float, float] = DRESDEN, members=None, **properties):
    geometry = None if shape is None else mapping(degrees(shape, around))
    return {"type": "Feature", "properties": properties, "geometry": geometry, **(members or {})}


def write_features(path: Path, features: list, **members) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"type": "FeatureCollection", **members, "features": features}))
    return path


def room(shape: shapely.Geometry = ELL, level: str = "0", **tags):
    return feature(shape, **({"indoor": "room", "level": level} | tags))


def door(x: float, y: float, level: str = "0", **tags):
    return feature(Point(x, y), **({"door": "hinged", "level": level} | tags))


def two_rooms(level: str = "0") -> list:
    """Rooms of 5 m x 4 m side by side with a door in the middle of the wall between them."""
    return [room(box(0, 0, 5, 4), level), room(box(5, 0, 10, 4), level), door(5, 2, level)]
