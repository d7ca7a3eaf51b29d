"""Building models of IFC, made with the interface of ifcopenshell; tests are skipped where it is not installed."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely

from tests.floorplans.readers.drawing_samples import DOOR, HALL, OUTLINE, PARTITION, STUDY

pytest.importorskip("ifcopenshell", reason="the extra `ifc` is not installed")
import ifcopenshell.api.aggregate
import ifcopenshell.api.context
import ifcopenshell.api.feature
import ifcopenshell.api.geometry
import ifcopenshell.api.owner
import ifcopenshell.api.project
import ifcopenshell.api.root
import ifcopenshell.api.spatial
import ifcopenshell.api.unit

api = ifcopenshell.api
THICK = 0.2
METRE = {"is_metric": True, "raw": "METERS"}
UNITS = {
    "mm": {"is_metric": True, "raw": "MILLIMETERS"},
    "m": METRE,
    "ft": {"is_metric": False, "raw": "FEET"},
}


class Model:
    """A building of one file in ``unit``; all lengths are given in metres, as the interface of ifcopenshell has it."""

    def __init__(self, unit: dict[str, object] = METRE, version: str = "IFC4") -> None:
        self.file = api.project.create_file(version=version)
        if version == "IFC2X3":  # which asks of everything who made it
            person, company = api.owner.add_person(self.file), api.owner.add_organisation(self.file)
            api.owner.add_person_and_organisation(self.file, person=person, organisation=company)
            api.owner.add_application(self.file, application_developer=company)
        project = self.entity("IfcProject", "Home")
        api.unit.assign_unit(self.file, length=unit)
        self.body = api.context.add_context(self.file, context_type="Model")
        self.project = project
        self.new_building("House")

    def entity(self, kind: str, name: str | None):
        return api.root.create_entity(self.file, ifc_class=kind, name=name)

    def new_building(self, name: str | None) -> "Model":
        """Begin a building; the storeys that are made next are its own."""
        self.building = self.entity("IfcBuilding", name)
        api.aggregate.assign_object(self.file, products=[self.building], relating_object=self.project)
        return self

    def storey(self, name: str | None, z: float = 0.0) -> "Model":
        """Begin a storey whose floor is at the height ``z``; what is built next stands on it."""
        self.floor, self.z = self.entity("IfcBuildingStorey", name), z
        api.aggregate.assign_object(self.file, products=[self.floor], relating_object=self.building)
        self.place(self.floor, z)
        return self

    def place(self, product, z: float) -> None:
        matrix = np.eye(4)
        matrix[2, 3] = z
        api.geometry.edit_object_placement(self.file, product=product, matrix=matrix)

    def prism(self, kind: str, corners, *, name=None, height=2.5, above=0.0):
        product = self.entity(kind, name)
        if kind == "IfcSpace":
            api.aggregate.assign_object(self.file, products=[product], relating_object=self.floor)
        elif kind != "IfcOpeningElement":
            api.spatial.assign_container(self.file, products=[product], relating_structure=self.floor)
        self.place(product, self.z + above)
        shape = api.geometry.add_slab_representation(
            self.file, context=self.body, depth=height, polyline=[*corners, corners[0]]
        )
        api.geometry.assign_representation(self.file, product=product, representation=shape)
        return product

    def wall(self, start, end, **options):
        return self.prism("IfcWall", strip(start, end, THICK), **options)

    def box(self, left, bottom, right, top, *, sides="lbrt", **options) -> "Model":
        """Walls whose middles lie on the sides of a rectangle: left, bottom, right and top, or some of them."""
        corners = {"l": (left, bottom, left, top), "b": (left, bottom, right, bottom)}
        corners |= {"r": (right, bottom, right, top), "t": (left, top, right, top)}
        for side in sides:
            x, y, to_x, to_y = corners[side]
            self.wall((x, y), (to_x, to_y), **options)
        return self

    def walls(self) -> "Model":
        """The walls of the house; the one between hall and study is ``self.partition``."""
        for start, end in pairwise((*OUTLINE, OUTLINE[0])):
            self.wall(start, end)
        self.partition = self.wall(*PARTITION)
        return self

    def opening(self, ends=DOOR, *, filling: str | None = None, thick=0.05, above=0.0, height=2.1, wall=None):
        """A hole in a wall, the partition where none is named, and what fills it: "IfcDoor", "IfcWindow", nothing."""
        hole = self.prism("IfcOpeningElement", strip(*ends, 4 * THICK), above=above, height=height)
        api.feature.add_feature(self.file, feature=hole, element=wall or self.partition)
        if filling is not None:
            leaf = self.prism(filling, strip(*ends, thick, cap="flat"), above=above, height=height)
            api.feature.add_filling(self.file, opening=hole, element=leaf)
        return self

    def spaces(self) -> "Model":
        hall = self.prism("IfcSpace", shrunk(HALL), name="101")
        hall.LongName = "Hall"
        self.prism("IfcSpace", shrunk(STUDY), name="Study")
        return self

    def house(self) -> "Model":
        return self.walls().opening(filling="IfcDoor").spaces()

    def save(self, tmp_path: Path, name: str = "home.ifc") -> Path:
        self.file.write(str(tmp_path / name))
        return tmp_path / name


def strip(start, end, thick: float, cap: str = "square") -> list[tuple[float, float]]:
    """The corners of a straight wall; "square" ends reach over the corners of the building."""
    ends = "flat" if cap == "flat" or thick > THICK else "square"
    area = shapely.buffer(shapely.LineString([start, end]), thick / 2, cap_style=ends)
    return shapely.get_coordinates(area)[:-1].tolist()


def shrunk(corners) -> list[tuple[float, float]]:
    """A room up to the faces of its walls."""
    area = shapely.buffer(shapely.Polygon(corners), -THICK / 2, join_style="mitre")
    return shapely.get_coordinates(area)[:-1].tolist()
