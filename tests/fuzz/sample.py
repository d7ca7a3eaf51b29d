"""Files to be read, and what they are put together from."""

import io
import json
import zipfile
from pathlib import PurePosixPath
from typing import NamedTuple

import numpy as np
from PIL import Image

from pipeline.floorplans.readers import ReadOptions

ARCHIVE, MANIFEST = "archive", "manifest"  # fuzzed as the readers are

METRES = ReadOptions(metres_per_unit=1.0)

CENTIMETRES = ReadOptions(metres_per_unit=0.01)

TENTHS = ReadOptions(metres_per_unit=0.1)


class Sample(NamedTuple):
    """Files by name, which of them is read, and what is said about it."""

    files: dict[str, bytes]
    main: str
    options: ReadOptions = ReadOptions()

    @property
    def ending(self) -> str:
        return PurePosixPath(self.main).suffix


def picture_bytes(grey: np.ndarray, kind: str = "PNG", **changes: object) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(grey).save(stream, format=kind, **changes)
    return stream.getvalue()


def npz_bytes(layers: dict[str, np.ndarray], *, packed: bool = True) -> bytes:
    return zip_bytes({f"{name}.npy": _npy_bytes(layer) for name, layer in layers.items()}, packed=packed)


def _npy_bytes(layer: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.asanyarray(layer))
    return stream.getvalue()


def zip_bytes(members: dict[str, bytes], *, packed: bool = True) -> bytes:
    """Return an archive with the same bytes at any time of day."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, content in members.items():
            kind = zipfile.ZIP_DEFLATED if packed else zipfile.ZIP_STORED
            archive.writestr(zipfile.ZipInfo(name), content, kind)
    return stream.getvalue()


def box(x: float, y: float, wide: float, high: float) -> list[list[float]]:
    """Corners of a closed ring."""
    return [[x, y], [x + wide, y], [x + wide, y + high], [x, y + high], [x, y]]


def wkt(corners: list[list[float]]) -> str:
    return f"POLYGON (({', '.join(f'{x} {y}' for x, y in corners)}))"


def degrees(corners: list[list[float]]) -> list[list[float]]:
    """Metres to degrees near (8, 48)."""
    return [[8 + x * 1.34e-5, 48 + y * 9e-6] for x, y in corners]


def feature(kind: str, corners: list[list[float]], **properties: object) -> dict[str, object]:
    return {"type": "Feature", "properties": properties, "geometry": geometry(kind, corners)}


def geometry(kind: str, corners: list[list[float]]) -> dict[str, object]:
    """A shape of one part near (8, 48); the kinds of several parts have one or, for points, all corners."""
    listed = degrees(corners)
    coordinates = {
        "Polygon": [listed],
        "MultiPolygon": [[listed]],
        "LineString": listed,
        "MultiLineString": [listed],
        "Point": listed[0],
        "MultiPoint": listed,
    }[kind]
    return {"type": kind, "coordinates": coordinates}


def gathered(*geometries: dict[str, object], **properties: object) -> dict[str, object]:
    """A feature whose shape is a collection."""
    shape = {"type": "GeometryCollection", "geometries": list(geometries)}
    return {"type": "Feature", "properties": properties, "geometry": shape}


def collection(features: list[dict[str, object]], **members: object) -> bytes:
    return json.dumps({"type": "FeatureCollection", **members, "features": features}).encode()
