"""Whether and how wide a shape is painted: fill, stroke, visibility, from the values of CSS that it has."""

from collections.abc import Mapping
from functools import lru_cache
from typing import NamedTuple

from pipeline.floorplans.readers.svg_units import Viewport, diagonal, length, numbers

_CAPS = {"round": "round", "square": "square"}
_JOINS = {"round": "round", "bevel": "bevel"}
_MITRE_LIMIT = 4.0  # of SVG


class Pen(NamedTuple):
    """How a line is drawn. width: in user units of the shape, None where the drawing does not say."""

    width: float | None = None
    cap: str = "flat"
    join: str = "mitre"
    mitre_limit: float = _MITRE_LIMIT


class Paint(NamedTuple):
    """Fill and stroke: True or False where the drawing says so, None where it says nothing."""

    fill: bool | None
    stroke: bool | None
    pen: Pen


def paint_of(style: Mapping[str, str], viewport: Viewport) -> Paint:
    """Return how a shape is painted; ``style`` holds the values of `svg_style.inherited`."""
    try:
        width = length(style["stroke-width"], diagonal(viewport)) if "stroke-width" in style else None
    except ValueError:
        width = None
    stroke = _painted(style, "stroke")
    if width is not None and width <= 0:
        width, stroke = None, False
    pen = Pen(
        width,
        _CAPS.get(style.get("stroke-linecap", ""), "flat"),
        _JOINS.get(style.get("stroke-linejoin", ""), "mitre"),
        max(1.0, _number(style.get("stroke-miterlimit", ""), _MITRE_LIMIT)),
    )
    return Paint(_painted(style, "fill"), stroke, pen)


def is_visible(style: Mapping[str, str]) -> bool:
    """Return whether ``visibility`` shows a shape."""
    return style.get("visibility", "visible").lower() not in ("hidden", "collapse")


def is_switched_off(said: Mapping[str, str]) -> bool:
    """Return whether an element says that it and what is in it are not drawn at all."""
    return said.get("display", "").lower() == "none" or ("opacity" in said and _number(said["opacity"], 1.0) <= 0)


def _painted(style: Mapping[str, str], key: str) -> bool | None:
    if key not in style:
        return False if _number(style.get(f"{key}-opacity", ""), 1.0) <= 0 else None
    value = style[key].lower()
    if value == "currentcolor":
        value = style.get("color", "black").lower()
    return _is_seen(value) and _number(style.get(f"{key}-opacity", ""), 1.0) > 0


@lru_cache(maxsize=4096)
def _is_seen(colour: str) -> bool:
    from tinycss2.color4 import parse_color

    if colour == "none" or (colour.startswith("url(") and colour.endswith((" none", ")none"))):
        return False
    try:
        parsed = parse_color(colour)
    except (ValueError, RecursionError, ArithmeticError):
        return True  # no colour is black
    return parsed is None or parsed == "currentcolor" or parsed.alpha > 0


def _number(text: str, otherwise: float) -> float:
    try:
        ((value, _),) = numbers(text)
    except ValueError:
        return otherwise
    return value
