"""WRLD indoor maps: one GeoJSON for each floor, with walls, doors and windows as polygons in degrees.

Walls have their thickness and doors are polygons cut out of them, so the floor is the building's outline less walls,
windows and spaces that cannot be entered, and less the slivers between them. Doors become openings. ``main.json`` lists
the floors and a ``*-paths`` file beside a floor holds routes through it: both accompany the floors.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import shapely

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, FloorPlan, GridPlan, Room
from pipeline.floorplans.projection import frame_around
from pipeline.floorplans.readers.geojson_features import (
    lines_of,
    load_features,
    mentions,
    metres_of,
    outline_of,
    polygons_of,
    say_left_out,
    say_repaired,
)
from pipeline.floorplans.readers.json_file import short_name, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.walls import as_area, door_of, free_from_walls

_SOLID = ("wall", "window", "inaccessible_space", "elevator")
_LINES_TOO = ("wall", "window", "door")  # drawn as lines they are ``wall_m`` thick, and as wide as long
_NOT_ROOMS = (*_SOLID, "door", "building_outline", "no_geometry")


@dataclass(frozen=True)
class Wrld:
    """Reader of the floors of a WRLD building; the building is the folder of its floors."""

    name: str = "wrld"
    patterns: tuple[str, ...] = ("*.geojson",)
    uses: tuple[str, ...] = ("wall_m",)

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a GeoJSON collection with a building_outline."""
        return mentions(path, "building_outline", "type")

    def accompanies(self, path: Path) -> bool:
        """Return whether ``path`` lists the floors or holds routes through one."""
        head = sniff_text(path, 4096)
        lists_floors = path.name == "main.json" and '"levels"' in head and '"z_order"' in head
        holds_routes = path.stem.endswith("-paths") and path.with_stem(path.stem.removesuffix("-paths")).is_file()
        return lists_floors or (holds_routes and '"FeatureCollection"' in head)

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one floor of the file; see `Reader.read`. Walls and doors have sizes: no option is used."""
        found = load_features(path)
        try:
            frame = frame_around(each.shape for each in found.features if each.shape is not None)
            shapes: dict[str, list[shapely.Geometry]] = {}
            repaired = 0
            shapeless: list[shapely.Geometry | None] = []
            for feature in found.features:
                kind, shape = feature.text("type"), metres_of(feature, frame)
                lines = lines_of(shape) if kind in _LINES_TOO else []
                outline = None if lines and not polygons_of(shape) else outline_of(shape)
                if outline is not None:
                    repaired += outline[1]
                elif not lines:
                    shapeless.append(shape)
                areas = [] if outline is None else shapely.get_parts(outline[0]) if kind == "door" else [outline[0]]
                shapes.setdefault(kind, []).extend([*areas, *lines])
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem
        if not shapes.get("building_outline"):
            raise PlanError(f"{path}: no building_outline with a shape, expected the outline of the floor.")
        walls = [shape for kind in _SOLID for shape in shapes.get(kind, [])]
        doors = shapes.get("door", [])
        inside = as_area(shapely.union_all(shapes["building_outline"]))
        stem = short_name(path.stem)
        yield FloorPlan(
            plan_id=stem,
            building=short_name(stem.partition("-floor")[0]),
            floor=stem,
            environment="wrld_floors",
            source=path.name,
            free=free_from_walls(walls, inside, doors, wall_m=options.wall_m, name=str(path)),
            bounds=Bounds(*shapely.total_bounds(shapes["building_outline"]).tolist()),
            rooms=tuple(
                Room(area, kind) for kind, listed in shapes.items() if kind not in _NOT_ROOMS for area in listed
            ),
            doors=tuple(door_of(shape) for shape in doors),
            remarks=(
                *found.remarks(),
                *say_left_out(shapeless, "feature", "an outline"),
                *say_repaired(repaired),
            ),
        )
