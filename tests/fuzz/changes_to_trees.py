"""Damage to documents: JSON and XML that stay readable, and say something else."""

import json
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

from tests.fuzz.changes import NUMBERS, TEXTS, Change, Random, numbers, words


def _nasty(rng: Random) -> Any:
    values = (
        *(None, True, False, [], {}, "", 0, -1, 0.0, 1e308, -1e308, 1e-320, float("nan"), float("inf"), 10**400, 2**63),
        *([[]], [None], [[0]], [0, 0], {"x": 0}, [[0, 0]] * 3, [[0, 0], [1, 1], [0, 1], [1, 0]], [1e10, -1e10], "0"),
    )
    return rng.choice(TEXTS) if rng.random() < 0.3 else rng.choice(values)


def _places(value: Any, limit: int = 3000) -> list[tuple[Any, Any]]:
    """Return (container, key) of every value below ``value``, outer ones first."""
    places: list[tuple[Any, Any]] = []
    queue = [value]
    for inner in queue:
        keys = list(inner) if isinstance(inner, dict) else range(len(inner)) if isinstance(inner, list) else ()
        for key in keys:
            places.append((inner, key))
            queue.append(inner[key])
        if len(places) > limit:
            break
    return places


def _json_change(
    content: bytes, rng: Random, change: Callable[[Any, Any, list[tuple[Any, Any]], Random], None]
) -> bytes:
    """Change one place of a JSON document, or of one line of a file of lines."""
    lines = [content]
    which = 0
    try:
        value = json.loads(content)
    except (ValueError, RecursionError):
        lines = content.split(b"\n")
        which = rng.randrange(len(lines))
        try:
            value = json.loads(lines[which])
        except (ValueError, RecursionError):
            return numbers(content, rng)
    holder = [value]
    places = _places(holder)
    container, key = rng.choice(places) if rng.random() < 0.5 else rng.choice(places[: 1 + len(places) // 4])
    change(container, key, places, rng)
    lines[which] = json.dumps(holder[0] if holder else None).encode()
    return b"\n".join(lines)


def _set(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    container[key] = _nasty(rng)


def _drop(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    del container[key]


def _repeat(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    if isinstance(container, list):
        container[key:key] = [container[key]] * rng.choice((1, 2, 300))
    else:
        container[f"{key}2"] = container[key]


def _wrap(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    for _ in range(rng.choice((1, 1, 2, 50))):
        container[key] = [container[key]] if rng.random() < 0.5 else {str(key): container[key]}


def _swap(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    other, its = rng.choice(places)
    container[key], other[its] = json.loads(json.dumps(other[its])), json.loads(json.dumps(container[key]))


def _rename(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    if isinstance(container, dict):
        container[rng.choice((*TEXTS, "type", "id"))] = container.pop(key)


def _retype(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    value = container[key]
    options: list[Any] = [str(value), [value], {"0": value}, not value]
    if isinstance(value, int | float) and not isinstance(value, bool):
        options += [value * 1e6, -value, value + 1e-9, value * 10**20]
    if isinstance(value, list):
        options += [value[::-1], value[:1], value[1:], dict(enumerate(value)), value * 2]
    container[key] = rng.choice(options)


def _node(kind: Callable[[Any, Any, list[tuple[Any, Any]], Random], None]) -> Change:
    def change(content: bytes, rng: Random) -> bytes:
        try:
            return _json_change(content, rng, kind)
        except (ValueError, RecursionError, OverflowError, KeyError, IndexError):  # of a document damaged before
            return numbers(content, rng)

    change.__name__ = f"json{kind.__name__}"
    return change


JSON = tuple(_node(kind) for kind in (_set, _set, _drop, _repeat, _wrap, _swap, _rename, _retype))


def _xml(content: bytes, rng: Random) -> bytes:
    """Change one element: its text, an attribute, its place, or how often it stands."""
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, LookupError):
        return numbers(content, rng)
    parents = [(parent, child) for parent in root.iter() for child in parent]
    if not parents:
        return words(content, rng)
    parent, child = rng.choice(parents)
    kind = rng.randrange(6)
    if kind == 0:
        parent.remove(child)
    elif kind == 1:
        for _ in range(rng.choice((1, 2, 100))):
            parent.append(child)
    elif kind == 2 and child.attrib:
        value = rng.choice(NUMBERS) if rng.random() < 0.5 else rng.choice(TEXTS)
        child.set(rng.choice(sorted(child.attrib)), value)
    elif kind == 3:
        child.text = rng.choice((*NUMBERS, *TEXTS))
    elif kind == 4:
        child.tag = rng.choice(parents)[1].tag
    else:
        other = rng.choice(parents)[1]
        child.attrib.update(other.attrib)
        child.set("transform", rng.choice(_TRANSFORMS))
    try:
        return ElementTree.tostring(root, encoding="utf-8")
    except (UnicodeEncodeError, RecursionError):
        return content


_TRANSFORMS = (
    *("scale(0)", "scale(1e308)", "rotate(nan)", "matrix(1 0 0 0 0 0)", "translate(1e400)", "skewX(90)", "foo(", ""),
    *("matrix(1e200 0 0 1e200 0 0)", "rotate(45)", "scale(-1,1)", "translate(5", "scale(1e-300)", "rotate(1e30)" * 50),
)

XML = (_xml,)
