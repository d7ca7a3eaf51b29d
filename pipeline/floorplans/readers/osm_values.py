"""Values of OpenStreetMap's tags as people write them: levels, lengths, and tags that other tools have packed as text.

The tables of OpenStreetMap want "0;1", "0-2", "-1" and metres with a point; maps have commas, typographic signs, feet
and inches too. What can be read is, what cannot is handed back for a remark, and a guess says that it is one.
"""

import json
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

_HIGHEST = 200
_LONGEST_TEXT = 20_000
_NARROWEST_M, _WIDEST_M = 0.5, 20.0  # of a door
_DASHES = str.maketrans(dict.fromkeys("\u2010\u2011\u2012\u2013\u2014\u2212\ufe63\uff0d", "-"))
_NUMBER = r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)"
_RANGE = re.compile(rf"({_NUMBER})(?:-({_NUMBER}))?")
_DECIMAL_COMMA = re.compile(r"(?<![0-9,.])(-?[0-9]+),([0-9]+)(?![0-9]*[,.])")
_THOUSANDS = re.compile(r"([0-9]),([0-9]{3})(?=\s*mm)")
_METRES_IN = {
    **dict.fromkeys(("", "m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters"), 0.01),
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 0.001),
    **dict.fromkeys(("'", "ft", "foot", "feet"), 0.3048),
    **dict.fromkeys(('"', "in", "inch", "inches"), 0.0254),
}
_FEET_MARKS = dict.fromkeys("\u2032\u2019\u2018\u00b4", "'")
_MARKS = str.maketrans(_FEET_MARKS | dict.fromkeys("\u2033\u201d\u201c", '"'))
_LENGTH = re.compile(r"([0-9]*\.?[0-9]+)\s*([a-z]+|['\"]|'')?\.?")
_FEET_INCHES = re.compile(r"([0-9]+)\s*(?:'|ft|foot|feet)\s*-?\s*([0-9]*\.?[0-9]+)\s*(?:\"|''|in|inch|inches)?\.?")
_PACKED_TAG = re.compile(r'"((?:[^"\\]|\\.){1,255})"\s*=>\s*"((?:[^"\\]|\\.){0,1000})"')


class Levels(NamedTuple):
    """What a level text says. found: "0", "-1", "0.5", each once; unread: parts that say no level.

    with_comma: parts such as "0,5" that were taken as a number and might have been a list.
    """

    found: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()
    with_comma: tuple[str, ...] = ()


def levels_in(text: str) -> Levels:
    """Return the levels of a text such as "0", "0;1", "-1-3", "2-0", "+1" or "0,5".

    A range stands for its whole steps. A comma parts a list where blanks stand around it, where there are several, or
    where the numbers beside it follow each other ("0,1", "-1,0"); otherwise it is a decimal one ("0,5" is 0.5).
    """
    found: list[str] = []
    unread: list[str] = []
    with_comma: list[str] = []
    for part in _parts(text.translate(_DASHES), with_comma):
        span = _RANGE.fullmatch(re.sub(r"\s*([+-])\s*", r"\1", part))
        ends = sorted((float(span[1]), float(span[2] or span[1]))) if span is not None else [math.inf, math.inf]
        if -_HIGHEST <= ends[0] <= ends[1] <= _HIGHEST:
            steps = range(int(ends[1] - ends[0]) + 1)
            found += [f"{ends[0] + step + 0.0:g}" for step in steps]  # + 0.0: "-0" is "0"
        else:
            unread.append(part)
    return Levels(tuple(dict.fromkeys(found)), tuple(unread), tuple(with_comma))


def metres_in(text: str) -> float | None:
    """Return the width of a door [m]: "0.9", "1,2", "90 cm", "36 in", "3' 6" or "3 ft"; None where it is none.

    A number without a unit is metres. Widths below 0.5 m and above 20 m are those of no door.
    """
    plain = _THOUSANDS.sub(r"\1\2", text.translate(_MARKS).lower().strip())
    plain = re.sub(r"([0-9]),([0-9])", r"\1.\2", plain)
    both = _FEET_INCHES.fullmatch(plain)
    single = _LENGTH.fullmatch(plain)
    if both is not None:
        width = int(both[1]) * 0.3048 + float(both[2]) * 0.0254
    elif single is not None:
        unit = (single[2] or "").replace("''", '"')
        width = float(single[1]) * _METRES_IN.get(unit, math.nan)
    else:
        return None
    return width if _NARROWEST_M <= width <= _WIDEST_M else None


def tags_in(value: object) -> Mapping[str, Any]:
    """Return tags that stand together in one property; empty where they cannot be read.

    They are an object (`properties.tags` of osmtogeojson), its JSON as text, or text such as `"indoor"=>"room"`
    (`other_tags` of GDAL).
    """
    if isinstance(value, dict):
        return value
    if not isinstance(value, str) or len(value) > _LONGEST_TEXT:
        return {}
    if value.lstrip().startswith("{"):
        try:
            listed = json.loads(value)
        except (ValueError, RecursionError):
            return {}
        return listed if isinstance(listed, dict) else {}
    return {_unescaped(key): _unescaped(tag) for key, tag in _PACKED_TAG.findall(value)}


def _parts(text: str, with_comma: list[str]) -> Iterator[str]:
    """Yield the parts of a list of levels, commas resolved; those taken as decimal ones are added to ``with_comma``."""
    for listed in text.split(";"):
        commas = _DECIMAL_COMMA.findall(listed)
        follow = any(int(after) - int(before) == 1 for before, after in commas)
        if commas and listed.count(",") == len(commas) and not follow:
            with_comma.append(listed.strip())
            yield _DECIMAL_COMMA.sub(r"\1.\2", listed).strip()
        else:
            yield from (part.strip() for part in listed.split(",") if part.strip())


def _unescaped(text: str) -> str:
    return re.sub(r"\\(.)", r"\1", text)
