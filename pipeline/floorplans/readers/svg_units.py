"""Numbers of SVG: lengths with units, transforms as attribute or CSS property, and the fitting of a view box."""

import math
import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

_UNITS = {"": 1.0, "px": 1.0, "in": 96.0, "cm": 96 / 2.54, "mm": 9.6 / 2.54, "q": 2.4 / 2.54, "pt": 4 / 3, "pc": 16.0}
_UNITS |= {"em": 16.0, "rem": 16.0, "ex": 8.0}  # of the usual font: plans do not depend on it
_TURNS = {"": 1 / 360, "deg": 1 / 360, "rad": 0.5 / math.pi, "grad": 1 / 400, "turn": 1.0}
# Each pattern is matched at one place and has one way to match: no text makes it slow.
_NUMBER = re.compile(r"[\s,]*([+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?+)([a-zA-Z%]*+)")
_CALL = re.compile(r"[\s,]*([a-zA-Z]++[xyzXYZ]?3?[dD]?)\s*+\(([^()]*+)\)")
_BLANK = re.compile(r"[\s,]*+\Z")

Viewport = tuple[float | None, float | None]


class Matrix(NamedTuple):
    """An affine map as SVG writes it: x' = a x + c y + e, y' = b x + d y + f."""

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    def __matmul__(self, inner: "Matrix") -> "Matrix":
        """Return the map that first does ``inner``."""
        a, b, c, d, e, f = self
        return Matrix(
            a * inner.a + c * inner.b,
            b * inner.a + d * inner.b,
            a * inner.c + c * inner.d,
            b * inner.c + d * inner.d,
            a * inner.e + c * inner.f + e,
            b * inner.e + d * inner.f + f,
        )

    def apply(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return ``points`` [points, xy] mapped."""
        with np.errstate(all="ignore"):
            turned: NDArray[np.float64] = points @ np.array([[self.a, self.b], [self.c, self.d]]) + (self.e, self.f)
        return turned

    @property
    def stretch(self) -> float:
        """How many times longer a line becomes, in the mean of all directions of an area."""
        return math.sqrt(abs(self.a * self.d - self.b * self.c))


def moved(x: float, y: float) -> Matrix:
    """Return the map that moves by (``x``, ``y``)."""
    return Matrix(e=x, f=y)


def numbers(text: str) -> list[tuple[float, str]]:
    """Return numbers and their units, parted by blanks, commas or nothing ("10-5").

    Raises:
        ValueError: something else stands among them, or a number is not finite.
    """
    found, position = [], 0
    while (match := _NUMBER.match(text, position)) is not None:
        value = float(match[1])
        if not math.isfinite(value):
            raise ValueError("a number that is not finite")
        found.append((value, match[2].lower()))
        position = match.end()
    if _BLANK.match(text, position) is None:
        raise ValueError("no numbers")
    return found


def plain_numbers(text: str) -> list[float]:
    """Return numbers without units; see `numbers`.

    Raises:
        ValueError: a unit, or as in `numbers`.
    """
    found = numbers(text)
    if any(unit for _, unit in found):
        raise ValueError("numbers with units")
    return [value for value, _ in found]


def length(text: str, whole: float | None) -> float:
    """Return a length in user units; ``whole`` is what 100 % are, None where the drawing does not say.

    Raises:
        ValueError: no length, or a share of what is not known.
    """
    ((value, unit),) = numbers(text)
    if unit == "%":
        if whole is None:
            raise ValueError("a share of an unknown size")
        return value / 100 * whole
    if unit not in _UNITS:
        raise ValueError("an unknown unit")
    return value * _UNITS[unit]


def diagonal(viewport: Viewport) -> float | None:
    """Return what shares of lengths that are neither wide nor high, as radii, are taken of."""
    width, height = viewport
    return None if width is None or height is None else math.hypot(width, height) / math.sqrt(2)


def transform_of(text: str, viewport: Viewport) -> Matrix:
    """Return the map of a ``transform``, of the attribute or of CSS.

    Raises:
        ValueError: it is none, or is not in the plane.
    """
    matrix, position = Matrix(), 0
    if text.strip().lower() in ("", "none"):
        return matrix
    while (match := _CALL.match(text, position)) is not None:
        matrix = matrix @ _function(match[1].lower(), numbers(match[2]), viewport)
        position = match.end()
    if _BLANK.match(text, position) is None or not all(map(math.isfinite, matrix)):
        raise ValueError("no transform")
    return matrix


def _function(name: str, given: Sequence[tuple[float, str]], viewport: Viewport) -> Matrix:
    if name not in _FUNCTIONS or len(given) not in _FUNCTIONS[name][0]:
        raise ValueError(f"a transform {name} of {len(given)} numbers")
    return _FUNCTIONS[name][1](given, viewport)


def _length(given: tuple[float, str], whole: float | None) -> float:
    return length(f"{given[0]!r}{given[1]}", whole)


def _radians(given: tuple[float, str]) -> float:
    if given[1] not in _TURNS:
        raise ValueError("an unknown unit of angles")
    return given[0] * _TURNS[given[1]] * 2 * math.pi


def _factor(given: tuple[float, str]) -> float:
    if given[1] not in ("", "%"):
        raise ValueError("a factor with a unit")
    return given[0] / 100 if given[1] else given[0]


def _translate(given: Sequence[tuple[float, str]], viewport: Viewport) -> Matrix:
    return moved(_length(given[0], viewport[0]), _length(given[1], viewport[1]) if len(given) > 1 else 0.0)


def _scale(given: Sequence[tuple[float, str]], viewport: Viewport) -> Matrix:
    return Matrix(a=_factor(given[0]), d=_factor(given[min(1, len(given) - 1)]))


def _rotate(given: Sequence[tuple[float, str]], viewport: Viewport) -> Matrix:
    angle = _radians(given[0])
    turned = Matrix(math.cos(angle), math.sin(angle), -math.sin(angle), math.cos(angle))
    x, y = (_length(part, None) for part in given[1:] or ((0.0, ""), (0.0, "")))
    return moved(x, y) @ turned @ moved(-x, -y)


def _skew(given: Sequence[tuple[float, str]], viewport: Viewport) -> Matrix:
    return Matrix(b=math.tan(_radians(given[1])) if len(given) > 1 else 0.0, c=math.tan(_radians(given[0])))


def _matrix(given: Sequence[tuple[float, str]], viewport: Viewport) -> Matrix:
    return Matrix(*(_factor(part) for part in given[:4]), *(_length(part, None) for part in given[4:]))


_Maker = Callable[[Sequence[tuple[float, str]], Viewport], Matrix]
_FUNCTIONS: dict[str, tuple[tuple[int, ...], _Maker]] = {
    "translate": ((1, 2), _translate),
    "translatex": ((1,), _translate),
    "translatey": ((1,), lambda given, viewport: moved(0.0, _length(given[0], viewport[1]))),
    "translate3d": ((3,), _translate),
    "scale": ((1, 2), _scale),
    "scalex": ((1,), lambda given, viewport: Matrix(a=_factor(given[0]))),
    "scaley": ((1,), lambda given, viewport: Matrix(d=_factor(given[0]))),
    "scale3d": ((3,), _scale),
    "rotate": ((1, 3), _rotate),
    "rotatez": ((1,), _rotate),
    "skew": ((1, 2), _skew),
    "skewx": ((1,), _skew),
    "skewy": ((1,), lambda given, viewport: Matrix(b=math.tan(_radians(given[0])))),
    "matrix": ((6,), _matrix),
}


def origin_of(text: str, viewport: Viewport) -> tuple[float, float]:
    """Return the point that a ``transform-origin`` in the view box names.

    Raises:
        ValueError: it is none, or a share of what is not known.
    """
    words = text.lower().split()
    if words and (words[0] in ("top", "bottom") or (len(words) > 1 and words[1] in ("left", "right"))):
        words[:2] = words[1::-1] if len(words) > 1 else ["center", words[0]]
    shares = {"left": "0%", "top": "0%", "center": "50%", "right": "100%", "bottom": "100%"}
    x, y = (shares.get(word, word) for word in [*words, "center"][:2])
    return length(x, viewport[0]), length(y, viewport[1])


def view_box(text: str) -> tuple[float, float, float, float] | None:
    """Return the left, top, width and height of a ``viewBox``; None where it is damaged or empty."""
    try:
        left, top, width, height = plain_numbers(text)
    except ValueError:
        return None
    return (left, top, width, height) if width > 0 and height > 0 else None


def fitted(box: tuple[float, float, float, float], width: float, height: float, aspect: str) -> Matrix:
    """Return the map of a view box into a viewport at the origin, by its ``preserveAspectRatio``."""
    left, top, box_width, box_height = box
    wide, high = width / box_width, height / box_height
    words = [word for word in aspect.split() if word != "defer"] or ["xMidYMid"]
    if words[0] == "none":
        return Matrix(a=wide, d=high) @ moved(-left, -top)
    factor = max(wide, high) if "slice" in words else min(wide, high)
    share = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
    across, down = share.get(words[0][1:4], 0.5), share.get(words[0][5:8], 0.5)
    spare = moved((width - factor * box_width) * across, (height - factor * box_height) * down)
    return spare @ Matrix(a=factor, d=factor) @ moved(-left, -top)
