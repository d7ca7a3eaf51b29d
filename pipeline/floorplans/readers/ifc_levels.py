"""The levels (storeys) of an IFC model, the buildings they are in, and the level that each body belongs to."""

from collections.abc import Iterator
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from pipeline.errors import PlanError
from pipeline.floorplans.readers.json_file import short_text

_MOST_STOREYS = 500
_DEEPEST = 50  # parts of parts, and rooms of storeys of buildings; a model that refers to itself ends here
_PARENTS = (
    ("VoidsElements", "RelatingBuildingElement"),
    ("FillsVoids", "RelatingOpeningElement"),
    ("ContainedInStructure", "RelatingStructure"),
    ("Decomposes", "RelatingObject"),
    ("Nests", "RelatingObject"),
)


class Level(NamedTuple):
    """A storey of a model. elevation: height of its floor in the world [m]. building: its number, -1 for none."""

    name: str
    elevation: float
    building: int


class Home(NamedTuple):
    """Where a body belongs: the numbers of its level and building, -1 for none.

    shared: further levels that a model refers to it from, as it does for what passes through several.
    """

    level: int
    building: int
    shared: frozenset[int] = frozenset()


class Levels:
    """The levels of a model in the order of buildings and heights, and who belongs to them."""

    def __init__(self, model: Any, scale: float) -> None:
        storeys = entities(model, "IfcBuildingStorey")
        if not storeys:
            raise PlanError("no IfcBuildingStorey, expected one for each floor. Export it with storeys.")
        if len(storeys) > _MOST_STOREYS:
            raise PlanError(f"{len(storeys):,} storeys, at most {_MOST_STOREYS} are read. Split the model.")
        built = entities(model, "IfcBuilding")
        self.buildings = _told_apart([short_text(each.Name or each.LongName or "building") for each in built])
        self._buildings = {each.id(): number for number, each in enumerate(built)}
        self._levels: dict[int, int] = {}
        floors = [height * scale for height in _heights(storeys)]
        within = [self.home(storey).building for storey in storeys]
        upward = sorted(range(len(storeys)), key=lambda k: (within[k], floors[k], storeys[k].Name or ""))
        names = [short_text(storeys[k].Name or f"{floors[k]:g}") for k in upward]
        places = [(within[k], name) for k, name in zip(upward, names, strict=True)]
        named = [
            f"{name} {floors[k]:g}" if places.count(place) > 1 else name
            for k, name, place in zip(upward, names, places, strict=True)
        ]
        self.levels = [
            Level(name, floors[k], within[k])
            for k, name in zip(upward, _told_apart(named, [within[k] for k in upward]), strict=True)
        ]
        self._levels = {storeys[k].id(): number for number, k in enumerate(upward)}

    def home(self, product: Any) -> Home:
        """Return where a product belongs: through what it is a part of, fills or voids, and what that stands in."""
        shared = frozenset(
            self._levels[structure.id()]
            for relation in _related(product, "ReferencedInStructures")
            if (structure := getattr(relation, "RelatingStructure", None)) is not None
            and structure.id() in self._levels
        )
        for place in _upward(product):
            if place.id() in self._levels:
                level = self._levels[place.id()]
                return Home(level, self.levels[level].building, shared)
            if place.id() in self._buildings:
                return Home(-1, self._buildings[place.id()], shared)
        return Home(-1, -1, shared)


def entities(model: Any, kind: str) -> list[Any]:
    """Return the entities of a kind; none where the schema of the model has no such kind."""
    try:
        return list(model.by_type(kind))
    except RuntimeError:
        return []


def _upward(product: Any) -> Iterator[Any]:
    for _ in range(_DEEPEST):
        if product is None:
            return
        yield product
        product = next(
            (
                parent
                for relation, end in _PARENTS
                for each in _related(product, relation)
                if (parent := getattr(each, end, None)) is not None
            ),
            None,
        )


def _related(product: Any, relation: str) -> Any:
    return getattr(product, relation, None) or ()


def _told_apart(names: list[str], groups: list[int] | None = None) -> list[str]:
    """Return names with numbers behind those that came before in their group."""
    seen: dict[tuple[int, str], int] = {}
    told = []
    for name, group in zip(names, groups or [0] * len(names), strict=True):
        seen[group, name] = seen.get((group, name), 0) + 1
        told.append(name if seen[group, name] == 1 else f"{name} ({seen[group, name]})")
    return told


def _heights(storeys: list[Any]) -> list[float]:
    """Return the heights of the floors in the world, where bodies are placed, in units of the model.

    Elevation is above the building's own zero, and its site may lie 100 m above the sea; but it is all there is where
    the storeys are all placed at one height.
    """
    from ifcopenshell.util.placement import get_local_placement

    elevations = [_elevation(storey) for storey in storeys]
    placements = [storey.ObjectPlacement for storey in storeys]
    if not all(placements):
        return elevations
    placed = [float(get_local_placement(placement)[2][3]) for placement in placements]
    if not np.isfinite(placed).all() or (len({*placed}) == 1 and len({*elevations}) > 1):
        return elevations
    return placed


def _elevation(storey: Any) -> float:
    value = storey.Elevation
    if value is None:
        return 0.0
    if not isinstance(value, int | float) or not isfinite(value):
        raise PlanError(
            f"the elevation of a storey is {short_text(str(value))!r}, expected a number. Repair the model."
        )
    return float(value)
