"""Drawings in DXF made for tests: walls on A-WALL, doors on A-DOOR, lengths in metres."""

from itertools import pairwise
from pathlib import Path

import ezdxf

from pipeline.floorplans.plan import FloorPlan
from pipeline.floorplans.readers.dxf import Dxf
from tests.floorplans.readers.drawing_samples import DOOR, OUTLINE, PARTITION, read_one

UNITS = {"mm": (4, 1000.0), "cm": (5, 100.0), "m": (6, 1.0), "in": (1, 1 / 0.0254), "ft": (2, 1 / 0.3048)}
LEAF = [(1.0, 4.0), (1.0, 4.9)]
WALL, OPENING = {"layer": "A-WALL"}, {"layer": "A-DOOR"}


class Sheet:
    """A drawing in ``unit`` units per metre, put at ``origin``; all lengths are given in metres."""

    def __init__(self, insunits: int = 6, unit: float = 1.0, origin: tuple[float, float] = (0.0, 0.0)) -> None:
        self.document = ezdxf.new(setup=False)
        self.document.header["$INSUNITS"] = insunits
        self.unit = unit
        self.origin = origin
        self.space = self.document.modelspace()

    def at(self, points) -> list[tuple[float, float]]:
        east, north = self.origin
        return [((east + x) * self.unit, (north + y) * self.unit) for x, y in points]

    def lines(self, points, *, closed=False, **attribs) -> "Sheet":
        corners = self.at([*points, *(points[:1] if closed else ())])
        for start, end in pairwise(corners):
            self.space.add_line(start, end, dxfattribs=attribs)
        return self

    def walls(self, partition=PARTITION) -> "Sheet":
        self.lines(OUTLINE, closed=True, **WALL)
        return self.lines(partition, **WALL) if partition else self

    def arc(self, centre, start, end, *, radius=0.9, **attribs) -> "Sheet":
        (middle,) = self.at([centre])
        self.space.add_arc(middle, radius * self.unit, start, end, dxfattribs=OPENING | attribs)
        return self

    def door(self) -> "Sheet":
        """The leaf of the door, open into the study, and its swing; hinged at the west jamb."""
        return self.lines(LEAF, **OPENING).arc(DOOR[0], 0, 90)

    def save(self, tmp_path: Path, name: str = "home.dxf", **how) -> Path:
        self.document.saveas(tmp_path / name, **how)
        return tmp_path / name


def read(path: Path, **options) -> FloorPlan:
    return read_one(Dxf(), path, **options)
