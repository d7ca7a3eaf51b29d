"""Malls of the Indoor Location Competition 2.0: one folder for each floor with ``geojson_map.json`` in degrees.

The first feature is the outline of the floor, all others are shops, services and voids, closed and without doors: the
navigable floor is the outline less all of them and the slivers between. ``floor_info.json`` gives width and height of
the outline in metres, ``floor_image.png`` a picture of it; both accompany the map.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import shapely

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Bounds, FloorPlan, GridPlan, Room
from pipeline.floorplans.projection import frame_around
from pipeline.floorplans.readers.geojson_features import (
    load_features,
    mentions,
    metres_of,
    outline_of,
    say_left_out,
    say_repaired,
)
from pipeline.floorplans.readers.json_file import finite_number, load_json, short_name, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.walls import without_cavities

_INFO = "floor_info.json"
_MAP = "geojson_map.json"
_TOLERANCE = 0.02


@dataclass(frozen=True)
class MallsGeoJson:
    """Reader of mall floors in folders <site>/<floor>/."""

    name: str = "malls_geojson"
    patterns: tuple[str, ...] = (_MAP,)
    uses: tuple[str, ...] = ()

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a GeoJSON collection that begins with the outline of a floor."""
        return mentions(path, "two_class", "floor") or (path.name == _MAP and mentions(path, "category"))

    def accompanies(self, path: Path) -> bool:
        """Return whether ``path`` gives the size of a mall floor."""
        return path.name == _INFO and '"map_info"' in sniff_text(path, 256)

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one floor of the folder; see `Reader.read`. No option is used."""
        found = load_features(path)
        try:
            frame = frame_around(each.shape for each in found.features if each.shape is not None)
            areas = [(outline_of(metres_of(each, frame)), each) for each in found.features]
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem
        if not areas or areas[0][0] is None or areas[0][1].members is not found.members["features"][0]:
            raise PlanError(
                f"{path}: the first feature has no outline, expected that of the floor. Get the file again."
            )
        (floor, *units) = [(outline[0], each) for outline, each in areas if outline is not None]
        try:
            free = without_cavities(shapely.difference(floor[0], shapely.union_all([shape for shape, _ in units])))
        except shapely.errors.GEOSException as problem:
            raise PlanError(f"{path}: the outlines are too tangled ({problem}). Repair the drawing.") from problem
        whole = path.absolute()
        site, level = short_name(whole.parent.parent.name) or "mall", short_name(whole.parent.name) or "floor"
        closed = "shop or void" if len(units) == 1 else "shops and voids"
        said = [f"{len(units)} {closed} closed: only the corridors are floor"]
        said += say_left_out([each.shape for outline, each in areas if outline is None], "feature", "an outline")
        said += say_repaired(sum(outline[1] for outline, _ in areas if outline is not None))
        bounds = Bounds(*floor[0].bounds)
        yield FloorPlan(
            plan_id=f"{site}.{level}",
            building=site,
            floor=f"{site}.{level}",
            environment="malls",
            source=f"{site}/{level}/{path.name}",
            free=free,
            bounds=bounds,
            rooms=tuple(Room(shape, each.text("name")) for shape, each in units),
            remarks=(*found.remarks(), *said, *_size_remarks(path, bounds)),
        )


def _size_remarks(path: Path, bounds: Bounds) -> tuple[str, ...]:
    """Say where the stated size of the floor and its coordinates disagree by more than 2 %."""
    info = path.with_name(_INFO)
    if not info.is_file():
        return ()
    content = load_json(info)
    stated = content.get("map_info") if isinstance(content, dict) else None
    if not isinstance(stated, dict):
        return ()
    for side, size in (("width", bounds.max_x - bounds.min_x), ("height", bounds.max_y - bounds.min_y)):
        said = finite_number(stated.get(side), f"{info}: map_info.{side}")
        if abs(said - size) > _TOLERANCE * size:
            return (f"{_INFO} states a {side} of {said:.1f} m, the coordinates give {size:.1f} m, which are kept",)
    return ()
