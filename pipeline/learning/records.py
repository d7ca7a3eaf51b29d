"""Typed records as plain values and back, for JSON headers: what comes from a file must fit the type it is read as."""

import types
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

Record = TypeVar("Record")


def as_plain(value: Any) -> Any:
    """Return ``value`` with records and named tuples as mappings by field, and tuples as lists."""
    if is_dataclass(value) and not isinstance(value, type):
        return {each.name: as_plain(getattr(value, each.name)) for each in fields(value)}
    if hasattr(value, "_asdict"):
        return {name: as_plain(part) for name, part in value._asdict().items()}
    if isinstance(value, Mapping):
        return {name: as_plain(part) for name, part in value.items()}
    return [as_plain(part) for part in value] if isinstance(value, list | tuple) else value


def from_plain(kind: type[Record], content: Any) -> Record:
    """Return the ``kind``, a dataclass or a named tuple, whose fields ``content`` holds.

    Raises:
        TypeError: a field is missing, unknown or of another type, by name.
    """
    if not isinstance(content, Mapping):
        raise TypeError(f"{content!r} is no mapping of the fields of a {kind.__name__}")
    hints, needed = get_type_hints(kind), _needed(kind)
    for name in sorted(content.keys() - hints.keys()) + sorted(needed - content.keys()):
        raise TypeError(f"{name} is {'missing' if name in needed else 'no field'} of a {kind.__name__}")
    return kind(**{name: _value(hints[name], value, name) for name, value in content.items()})


def _needed(kind: type[Any]) -> set[str]:
    if is_dataclass(kind):
        return {each.name for each in fields(kind) if not _has_default(each)}
    return set(kind._fields) - set(kind._field_defaults)


def _has_default(each: Field[Any]) -> bool:
    return each.default is not MISSING or each.default_factory is not MISSING


def _value(kind: Any, value: Any, name: str) -> Any:
    origin, parts = get_origin(kind), get_args(kind)
    if kind is Any:
        return value
    if origin in (Union, types.UnionType):
        return _first_that_fits(parts, value, name)
    if is_dataclass(kind) or hasattr(kind, "_fields"):
        return from_plain(kind, value)
    if origin in (tuple, list):
        if not isinstance(value, list) or (origin is tuple and parts[-1] is not ... and len(parts) != len(value)):
            raise TypeError(f"{name} is {value!r}, no {kind}")
        kinds = parts if origin is tuple and parts[-1] is not ... else [parts[0]] * len(value)
        return origin(_value(each, part, name) for each, part in zip(kinds, value, strict=True))
    if origin is dict or kind is dict:
        if not isinstance(value, dict):
            raise TypeError(f"{name} is no table of settings")
        return value
    if kind is float and type(value) is int:
        return float(value)
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
        raise TypeError(f"{name} is {value!r}, no {kind.__name__}")
    return value


def _first_that_fits(kinds: tuple[Any, ...], value: Any, name: str) -> Any:
    for kind in kinds:
        try:
            return _value(kind, value, name)
        except TypeError as error:
            last = error
    raise last
