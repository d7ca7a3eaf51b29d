"""The outlines of the shapes of SVG, in user units of the shape itself, curves as short lines."""

import math
import re
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.floorplans.readers.json_file import short_text
from pipeline.floorplans.readers.svg_units import Viewport, diagonal, length, plain_numbers

_UNLIKELY = re.compile(r"[\d.]{60}")
_CURVE_STEPS = 12  # of a Bezier curve, and of a quarter turn
_QUARTER = np.stack([np.cos(turns := np.linspace(0, math.pi / 2, _CURVE_STEPS + 1)), np.sin(turns)], axis=1)


class Outline(NamedTuple):
    """A line of corners [corners, xy]; one that is closed does not repeat its first corner."""

    corners: NDArray[np.float64]
    closed: bool


def outlines_of(tag: str, attributes: Mapping[str, str], said: Mapping[str, str], viewport: Viewport) -> list[Outline]:
    """Return the outlines of a shape.

    attributes: of the element. said: as of `svg_style.Styles`: sizes and places are properties of CSS too.

    Raises:
        ValueError: its numbers cannot be read; or what svgelements raises, see `drawing.PARSER_ERRORS`.
    """
    with np.errstate(all="ignore"):  # what becomes infinite is refused below
        outlines = _MAKERS[tag](attributes, said, viewport)
    kept = [Outline(_without_repeats(corners, closed=closed), closed) for corners, closed in outlines]
    if not all(np.isfinite(corners).all() for corners, _ in kept):
        raise ValueError("a coordinate that is not finite")
    return kept


def _size(said: Mapping[str, str], key: str, whole: float | None) -> float | None:
    value = said.get(key, "auto").lower()
    return None if value == "auto" else length(value, whole)


def _rect(attributes: Mapping[str, str], said: Mapping[str, str], viewport: Viewport) -> list[Outline]:
    x, y = _size(said, "x", viewport[0]) or 0.0, _size(said, "y", viewport[1]) or 0.0
    width, height = _size(said, "width", viewport[0]) or 0.0, _size(said, "height", viewport[1]) or 0.0
    rx, ry = _size(said, "rx", viewport[0]), _size(said, "ry", viewport[1])
    if width <= 0 or height <= 0:
        return []
    rx, ry = (ry if rx is None else rx) or 0.0, (rx if ry is None else ry) or 0.0
    rx, ry = min(max(rx, 0.0), width / 2), min(max(ry, 0.0), height / 2)
    rx, ry = (rx, ry) if rx > 0 and ry > 0 else (0.0, 0.0)
    quarter = _QUARTER * (rx, ry) if rx > 0 else np.zeros((1, 2))
    around = [quarter, (quarter * (-1, 1))[::-1], -quarter, (quarter * (1, -1))[::-1]]
    middles = ((width - rx, height - ry), (rx, height - ry), (rx, ry), (width - rx, ry))
    corners = np.concatenate([part + middle for part, middle in zip(around, middles, strict=True)])
    return [Outline(np.add(corners, (x, y)), closed=True)]


def _line(attributes: Mapping[str, str], said: Mapping[str, str], viewport: Viewport) -> list[Outline]:
    ends = [[length(attributes.get(axis + end, "0"), whole) for axis, whole in zip("xy", viewport, strict=True)]
            for end in "12"]  # fmt: skip
    return [Outline(np.array(ends), closed=False)]


def _circle(attributes: Mapping[str, str], said: Mapping[str, str], viewport: Viewport) -> list[Outline]:
    radius = _size(said, "r", diagonal(viewport)) or 0.0
    return _oval(said, viewport, radius, radius)


def _ellipse(attributes: Mapping[str, str], said: Mapping[str, str], viewport: Viewport) -> list[Outline]:
    rx, ry = _size(said, "rx", viewport[0]), _size(said, "ry", viewport[1])
    return _oval(said, viewport, (ry if rx is None else rx) or 0.0, (rx if ry is None else ry) or 0.0)


def _oval(said: Mapping[str, str], viewport: Viewport, rx: float, ry: float) -> list[Outline]:
    middle = (_size(said, "cx", viewport[0]) or 0.0, _size(said, "cy", viewport[1]) or 0.0)
    if rx <= 0 or ry <= 0:
        return []
    quarters = [_QUARTER[:-1] @ np.array(turn) for turn in ([[1, 0], [0, 1]], [[0, 1], [-1, 0]])]
    half = np.concatenate(quarters)
    return [Outline(np.concatenate([half, -half]) * (rx, ry) + middle, closed=True)]


def _polyline(attributes: Mapping[str, str], said: Mapping[str, str], viewport: Viewport) -> list[Outline]:
    values = plain_numbers(attributes.get("points", ""))
    return [Outline(np.array(values[: len(values) // 2 * 2], dtype=np.float64).reshape(-1, 2), closed=False)]


def _polygon(attributes: Mapping[str, str], said: Mapping[str, str], viewport: Viewport) -> list[Outline]:
    return [Outline(corners, closed=True) for corners, _ in _polyline(attributes, said, viewport)]


def _path(attributes: Mapping[str, str], said: Mapping[str, str], viewport: Viewport) -> list[Outline]:
    from svgelements import Close, Path

    text = attributes.get("d", "")
    if _UNLIKELY.search(text):  # svgelements tries every way to part a long row of digits in two
        raise ValueError(f"a number of more digits than any drawing has: {short_text(text)}")
    return [
        Outline(_corners(part), any(isinstance(segment, Close) for segment in part))
        for part in Path(text).as_subpaths()
    ]


def _corners(part: Iterable[Any]) -> NDArray[np.float64]:
    from svgelements import Arc, Close, Line, Move

    corners: list[tuple[float, float]] = []
    for segment in part:
        count = 1 if isinstance(segment, Move | Line | Close) else _CURVE_STEPS
        if isinstance(segment, Arc):
            count = max(1, math.ceil(_CURVE_STEPS * min(4.0, abs(float(segment.sweep)) / (math.pi / 2))))
        for step in range(1, count + 1):
            point = segment.end if step == count else segment.point(step / count)
            if point is not None:
                corners.append((float(point.x), float(point.y)))
    return np.array(corners, dtype=np.float64).reshape(-1, 2)


def _without_repeats(corners: NDArray[np.float64], *, closed: bool) -> NDArray[np.float64]:
    if len(corners) < 2:
        return corners
    kept: NDArray[np.float64] = corners[np.append(True, (corners[1:] != corners[:-1]).any(axis=1))]
    return kept[:-1] if closed and len(kept) > 1 and (kept[0] == kept[-1]).all() else kept


_MAKERS: dict[str, Callable[[Mapping[str, str], Mapping[str, str], Viewport], list[Outline]]] = {
    "rect": _rect,
    "line": _line,
    "circle": _circle,
    "ellipse": _ellipse,
    "polyline": _polyline,
    "polygon": _polygon,
    "path": _path,
}
SHAPES = tuple(_MAKERS)
