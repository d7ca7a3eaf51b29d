"""What the names of an element stand for: walls, doors, rooms, floors."""

from typing import NamedTuple
from xml.etree.ElementTree import Element

from pipeline.floorplans.readers.drawing import is_any_of
from pipeline.floorplans.readers.json_file import short_name, short_text
from pipeline.floorplans.readers.reader import ReadOptions
from pipeline.floorplans.readers.svg_shapes import SHAPES

WALLS = ("wall", "walls", "wall[-_]*", "*[-_]wall", "*[-_]walls")
DOORS = ("door", "doors", "door[-_]*", "*[-_]door", "*[-_]doors", "opening*")
SOLID = ("window*", "railing*")
_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"
_PARTS = frozenset(("Threshold", "Panel", "PanelArea", "Glass"))  # of a door or window, never one themselves


class Meaning(NamedTuple):
    """What is drawn. kind: "wall", "door", "room", "solid" or "". label: of a room. level: of the floor."""

    kind: str = ""
    label: str = ""
    level: str = ""
    is_floor: bool = False


def tag_of(element: Element) -> str:
    """Return the name of an element without its name space, in small letters; of a comment nothing."""
    return element.tag.rpartition("}")[2].lower() if isinstance(element.tag, str) else ""


def meaning_of(element: Element, outer: Meaning, options: ReadOptions, *, copied: bool = False) -> Meaning:
    """Return what an element in a place of the meaning ``outer`` stands for; ``copied``: put there by ``<use>``."""
    names = [element.get(key, "").split() for key in ("class", "id", _LABEL)]
    classes = [name for part in names for name in part]
    is_plan = "Floorplan" in classes
    kind, label = _kind(names, options)
    if not kind:
        own = bool(element.get("class") or _PARTS.intersection(classes)) and tag_of(element) not in SHAPES
        part = own and not copied and outer.kind in ("door", "room", "solid")
        kind, label = ("", "") if part else (outer.kind, outer.label)
    level = next((name for name in classes if name.startswith("Floor-")), element.get("id", ""))
    return Meaning(kind, label, short_name(level) if is_plan else outer.level, is_plan or "Floor" in classes)


def _kind(names: list[list[str]], options: ReadOptions) -> tuple[str, str]:
    """Return what classes, id and label of an element stand for, and the label of a room."""
    for part in names:
        if "Space" in part:
            label = " ".join(part[part.index("Space") + 1 :])
            return ("", "") if label.startswith("Outdoor") else ("room", short_text(label))
    classes = [name for part in names for name in part]
    for kind, patterns in (("door", options.door_layers or DOORS), ("wall", options.wall_layers or WALLS)):
        if any(is_any_of(name, patterns) for name in classes):
            return kind, ""
    return ("solid", "") if any(is_any_of(name, SOLID) for name in classes) else ("", "")
