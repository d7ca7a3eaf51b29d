"""What a text that no reader takes looks like: by its root element, its keys or its first line."""

import re
from collections import Counter
from collections.abc import Iterable
from itertools import islice
from pathlib import Path
from typing import Any

import yaml

from pipeline.errors import PlanError
from pipeline.floorplans.readers.json_file import load_json, short_text

_MOST_BYTES = 20_000_000  # of JSON that is parsed to see its keys
_SHOWN = 8  # keys
_FEATURES = 1000  # looked at for their properties

ANY = (
    "Save the plan as DXF, SVG, IFC, GeoJSON or PNG, or name its format in plans.reader; `hinterland plan formats` "
    "lists all that are read"
)
_TAGS = (
    "Rooms are read by their tags indoor=room and level=0 (OpenStreetMap's Simple Indoor Tagging), or as IMDF; add "
    "those tags, or choose another export"
)
_OSM = "Turn it into GeoJSON with all tags: `osmium export floor.osm -o floor.geojson`, or osmtogeojson"
_GIS = "Export it as GeoJSON: ogr2ogr -f GeoJSON floor.geojson FILE, with indoor and level tags on its rooms"
_SOLID = "Cut it about 1 m above the floor and save the cut as DXF or SVG, or as a picture with its scale"
_PAGE = "It is a page about the file, not the file: download the file itself"

# Root elements of XML, in small letters and without a prefix.
_ROOTS = {
    "osm": ("raw OpenStreetMap data (XML)", _OSM),
    "osmchange": ("a change of OpenStreetMap data (XML)", _OSM),
    "html": ("a web page (HTML)", _PAGE),
    "kml": ("a KML file", _GIS),
    "gpx": ("a track (GPX)", _GIS),
    "featurecollection": ("a GML file", _GIS),
    "indoorfeatures": ("an IndoorGML file", "Export its cells as GeoJSON with indoor and level tags"),
    "citymodel": ("a city model (CityGML)", "Save the building as IFC, or its floor as DXF"),
    "ifcxml": ("an IFC model in XML", "Save it as IFC in STEP form (.ifc)"),
    "iso_10303_28": ("an IFC model in XML", "Save it as IFC in STEP form (.ifc)"),
    "gbxml": ("a building model (gbXML)", "Save the model as IFC"),
    "landxml": ("a LandXML file", "Save the plan as DXF"),
    "collada": ("a 3D scene (COLLADA)", _SOLID),
    "sdf": ("a world of the simulator Gazebo (SDF)", _SOLID),
    "world": ("a world of a simulator", _SOLID),
    "robot": ("a robot model (URDF)", "Give the map of the building instead"),
    "mxfile": ("a drawing of draw.io", "Export it as SVG, its walls and doors on layers or classes of those names"),
    "svg": ("an SVG drawing that cannot be read as one", "Save it anew, as plain SVG"),
}
_ELEMENT = re.compile(r"<(?:[\w.-]+:)?([A-Za-z_][\w.-]*)")
_NO_ELEMENT = re.compile(r"<\?.*?\?>|<!--.*?-->|<!(?!--)[^>]*>", re.DOTALL)


def look_of_text(path: Path, head: str) -> tuple[str, str]:
    """Return what a file whose text begins with ``head`` is, and what to do with it; never raises."""
    text = head.lstrip()
    if text.startswith("version https://git-lfs.github.com/spec"):
        return "a pointer of Git LFS, not the file itself", "Fetch it: git lfs pull"
    if re.match(r"<!doctype html|<html", text, re.IGNORECASE):
        return _ROOTS["html"]
    if text.startswith("<"):
        return _look_of_xml(text)
    if text.startswith(("{", "[")):
        return _look_of_json(path)
    if path.suffix.lower() in (".yaml", ".yml"):
        return _look_of_yaml(text)
    if path.suffix.lower() in (".obj", ".stl") or text.startswith("solid "):
        return "a 3D mesh", _SOLID
    first = short_text(text.partition("\n")[0])
    if path.suffix.lower() in (".csv", ".tsv"):
        return f"a table whose first line is '{first}'", ANY
    return f"text that begins with '{first}'", ANY


def _look_of_xml(text: str) -> tuple[str, str]:
    root = _ELEMENT.search(_NO_ELEMENT.sub("", text))
    if root is None:
        return "XML without an element", "Get the file again"
    return _ROOTS.get(root[1].lower(), (f"XML of the kind <{short_text(root[1])}>", ANY))


def _look_of_json(path: Path) -> tuple[str, str]:
    try:
        content = load_json(path, most_bytes=_MOST_BYTES)
    except PlanError as problem:
        why = str(problem).removeprefix(f"{path}: ").rpartition(". ")[0]
        return f"JSON that is not understood: {why}", "Repair it, or get the file again"
    if isinstance(content, list):
        inner = (
            f"the first with the keys {_listed(content[0])}" if content and isinstance(content[0], dict) else "no plans"
        )
        return f"JSON, a list of {len(content):,} entries, {inner}", ANY
    if not isinstance(content, dict):
        return f"JSON that holds just {short_text(content)}", ANY
    if content.get("type") in ("FeatureCollection", "Feature"):
        return _look_of_geojson(content)
    if "elements" in content and ("osm3s" in content or "generator" in content):
        return "an answer of Overpass, raw OpenStreetMap data (JSON)", "Turn it into GeoJSON with osmtogeojson"
    kinds = {"Topology": "a TopoJSON file", "CityJSON": "a city model (CityJSON)"}
    if (kind := kinds.get(str(content.get("type")))) is not None:
        return kind, _GIS
    if "nbformat" in content:
        return "a Jupyter notebook", ANY
    if not content:
        return "JSON without a key", "Get the file again"
    return f"JSON with the keys {_listed(content)}, those of no known format", ANY


def _look_of_geojson(content: dict[str, Any]) -> tuple[str, str]:
    """Return what a collection of features, or a single one, lacks."""
    if content["type"] == "Feature":
        return "GeoJSON of a single feature", f"Put it into a FeatureCollection. {_TAGS}"
    features = content.get("features")
    if not isinstance(features, list) or not features:
        return "GeoJSON without a feature", "Export it again with its features"
    known = [feature for feature in features[:_FEATURES] if isinstance(feature, dict)]
    shown = [each for feature in known if isinstance(each := feature.get("properties"), dict)]
    keys = Counter(key for properties in shown for key in properties)
    told = f"whose properties are {_listed(key for key, _ in keys.most_common())}" if keys else "without properties"
    return f"GeoJSON with {len(features):,} feature{'s' if len(features) > 1 else ''} {told}", _TAGS


def _look_of_yaml(text: str) -> tuple[str, str]:
    wanted = "A map of map_server has the keys image, resolution and origin; give that file"
    try:
        content = yaml.safe_load(text)
    except yaml.YAMLError as problem:
        mark = getattr(problem, "problem_mark", None)
        place = f"line {mark.line + 1}: " if mark is not None else ""
        why = getattr(problem, "problem", None) or type(problem).__name__
        return f"YAML that is not understood ({place}{short_text(why)})", "Repair it"
    except (ValueError, RecursionError, ArithmeticError, LookupError, TypeError, AttributeError):
        return "YAML that is not understood", "Repair it"
    if isinstance(content, dict) and content:
        return f"YAML with the keys {_listed(content)}, not those of a map", wanted
    return "YAML without keys", wanted


def _listed(keys: Iterable[Any]) -> str:
    found = [short_text(str(key)[:200]) for key in islice(keys, _SHOWN + 1)]
    return ", ".join(found[:_SHOWN]) + (", ..." if len(found) > _SHOWN else "")
