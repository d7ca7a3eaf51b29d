"""Sections of the configuration become frozen records here: keys, types and values are checked."""

import dataclasses
import difflib
import sys
import types
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from pipeline.errors import ConfigError

T = TypeVar("T")

_taken_out: set[str] = set()

_WORDS: dict[Any, str] = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "text",
    list: "a list",
    tuple: "a list",
    dict: "a mapping",
}


def typed(schema: type[T], raw: DictConfig, key: str) -> T:
    """Return section ``key`` of ``raw`` as the frozen dataclass ``schema``.

    Fields may be bool, int, float, str, Enum, list[...], dict[str, ...], nested dataclasses, and ``X | None`` of these.

    Raises:
        ConfigError: an unknown or missing key, a wrong type, or a value the record refuses; named by its full key.

    """
    try:
        content = OmegaConf.to_container(raw, resolve=True)
    except OmegaConfBaseException as error:
        raise ConfigError(f"{error.full_key or key} cannot be resolved: {_first_line(error)}") from error
    assert isinstance(content, dict)
    if not isinstance(content.get(key), dict):
        raise ConfigError(f"section {key} is missing: expected the keys {_listed(_fields(schema))} in conf/{key}/")
    return typed_settings(schema, content[key], key)


def typed_settings(schema: type[T], given: Mapping[str, Any], key: str) -> T:
    """Return the plain mapping ``given``, which the configuration holds at ``key``, as the frozen dataclass ``schema``.

    Fields and errors as for `typed`.
    """
    _check_keys(schema, given, key, group=key.partition(".")[0])
    records = {name: _records(kind, given[name], f"{key}.{name}") for name, kind in _mappings(schema) if name in given}
    plain = {name: value for name, value in given.items() if name not in records}
    try:
        blank = OmegaConf.structured(schema)
        _thaw(blank)
        merged = OmegaConf.merge(blank, plain)
        assert isinstance(merged, DictConfig)
        values = {str(name): _plain(merged[name]) for name in merged if not OmegaConf.is_missing(merged, name)}
    except OmegaConfBaseException as error:
        raise ConfigError(_wrong_type(schema, given, key, error)) from error
    try:
        record = schema(**values | records)
    except (TypeError, ValueError) as error:  # what records of other people refuse; ours raise a ConfigError
        raise ConfigError(f"{key}: {error}") from error
    _tell_taken_out(record, key)
    return record


def _plain(value: Any) -> Any:
    return OmegaConf.to_object(value) if OmegaConf.is_config(value) else value


def _mappings(schema: Any) -> list[tuple[str, Any]]:
    """Return the fields of ``schema`` that map names to records, each with the type of its records.

    OmegaConf makes the entries of such a field read-only before they are filled, so they are typed one by one.
    """
    kinds = ((name, _without_none(kind)) for name, kind in get_type_hints(schema).items())
    return [
        (name, get_args(kind)[1])
        for name, kind in kinds
        if get_origin(kind) is dict and dataclasses.is_dataclass(get_args(kind)[1])
    ]


def _records(schema: Any, given: Any, key: str) -> dict[str, Any]:
    """Return the records of a mapping; a null in the place of one takes it out."""
    keys = f"the keys {_listed(_fields(schema))}"
    if not isinstance(given, Mapping):
        raise ConfigError(f"{key} = {given!r}: expected a mapping of names to mappings with {keys}")
    present = {str(name): entry for name, entry in given.items() if entry is not None}
    for name, entry in present.items():
        if not isinstance(entry, Mapping):
            raise ConfigError(f"{key}.{name} = {entry!r}: expected a mapping with {keys}, or null for none")
    return {name: typed_settings(schema, entry, f"{key}.{name}") for name, entry in present.items()}


def note_taken_out(overrides: Sequence[str]) -> None:
    """Remember the keys that ``~key`` takes out of the configuration: `typed` says what each falls back to."""
    _taken_out.update(entry[1:].partition("=")[0] for entry in overrides if entry.startswith("~"))


def _tell_taken_out(record: Any, section: str) -> None:
    for key in sorted(name for name in _taken_out if name.startswith(f"{section}.")):
        value = record
        for name in key.removeprefix(f"{section}.").split("."):
            if isinstance(value, Mapping):  # its entries have no default: one taken out is gone
                break
            value = getattr(value, name, None)
        else:
            group = section.partition(".")[0]
            said = f"falls back to {value!r}, the default of the code, not that of conf/{group}/"
            print(f"~{key}: {said}", file=sys.stderr)
        _taken_out.discard(key)


def _thaw(section: DictConfig) -> None:
    """Let values be merged into ``section`` and the sections within: frozen dataclasses make read-only ones."""
    OmegaConf.set_readonly(section, False)
    for name in section:
        if not OmegaConf.is_missing(section, name) and OmegaConf.is_dict(section[name]):
            _thaw(section[name])


def unknown_key(full_key: str, allowed: Sequence[str], where: str) -> str:
    """Return the message for a key nobody reads: the nearest allowed one, or all of them, and where they live."""
    return f"unknown key {full_key}.{near_miss(full_key, allowed)} Allowed are {_listed(allowed)} ({where})"


def near_miss(word: str, allowed: Sequence[str]) -> str:
    """Return " Did you mean ...?" with the closest of ``allowed``, or nothing when none is close."""
    near = difflib.get_close_matches(word, allowed, n=1)
    return f" Did you mean {near[0]}?" if near else ""


def _check_keys(schema: Any, given: Mapping[Any, Any], key: str, group: str) -> None:
    hints, allowed = get_type_hints(schema), _fields(schema)
    for name in given:
        if name not in allowed:
            raise ConfigError(unknown_key(f"{key}.{name}", [f"{key}.{known}" for known in allowed], f"conf/{group}/"))
    for entry in dataclasses.fields(schema):
        required = entry.default is dataclasses.MISSING and entry.default_factory is dataclasses.MISSING
        if given.get(entry.name, "???" if required else None) == "???":
            wanted = _word(hints[entry.name])
            raise ConfigError(f"{key}.{entry.name} is missing: expected {wanted}. Set it in conf/{group}/ or by "
                              f"{key}.{entry.name}=... on the command line")  # fmt: skip
        kind, value = _without_none(hints[entry.name]), given.get(entry.name)
        if dataclasses.is_dataclass(kind) and isinstance(value, Mapping):
            _check_keys(kind, value, f"{key}.{entry.name}", group)


def _wrong_type(schema: Any, given: Any, key: str, error: OmegaConfBaseException) -> str:
    path = (error.full_key or "").replace("[", ".").replace("]", "")
    kind: Any = schema
    value = given
    for name in filter(None, path.split(".")):
        kind = _step_into(_without_none(kind), name)
        value = value[int(name)] if isinstance(value, list) else value.get(name)
    full_key, group = f"{key}.{error.full_key}" if path else key, key.partition(".")[0]
    if not path or kind is Any:
        return f"{full_key}: {_first_line(error)} (conf/{group}/)"
    return f"{full_key} = {value!r}: expected {_word(kind)}. Change it in conf/{group}/ or on the command line"


def _step_into(kind: Any, name: str) -> Any:
    if dataclasses.is_dataclass(kind):
        return get_type_hints(kind).get(name, Any)
    return get_args(kind)[-1] if get_origin(kind) in (list, dict) else Any


def _without_none(kind: Any) -> Any:
    if get_origin(kind) in (Union, types.UnionType):
        rest = [part for part in get_args(kind) if part is not type(None)]
        return rest[0] if len(rest) == 1 else kind
    return kind


def _word(kind: Any) -> str:
    bare = _without_none(kind)
    if isinstance(bare, type) and hasattr(bare, "__members__"):
        word = "one of " + ", ".join(bare.__members__)
    elif dataclasses.is_dataclass(bare):
        word = f"a mapping with the keys {_listed(_fields(bare))}"
    elif get_origin(bare) is list:
        word = f"a list of: {_word(get_args(bare)[0])}"
    else:
        word = _WORDS.get(get_origin(bare) or bare, str(bare))
    return word if bare is kind else f"{word} or null"


def _fields(schema: Any) -> list[str]:
    return [entry.name for entry in dataclasses.fields(schema)]


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names)


def _first_line(error: Exception) -> str:
    return str(error).strip().splitlines()[0]
