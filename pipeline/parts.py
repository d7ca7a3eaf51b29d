"""Parts by name: one of ours, or anybody's as ``package.module:factory``, with settings typed by the part itself."""

import dataclasses
import difflib
import importlib
import inspect
import sys
import sysconfig
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_type_hints

from pipeline.checking import typed_settings
from pipeline.errors import ConfigError, HinterlandError, PartError, PlannerError

SETTINGS = "settings"
"""The parameter of a factory that takes its settings; its annotation, a frozen dataclass, is their type."""


_LIBRARIES = (sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib"))
_NOT_THEIRS = (str(Path(__file__).parent), "<", *_LIBRARIES)


@dataclass(frozen=True)
class Part:
    """A factory somebody may choose by configuration.

    key: the configuration key that names it; use: the name as given there.
    make: the factory. settings: the dataclass that types its settings, None where it takes none.
    """

    key: str
    use: str
    make: Callable[..., Any]
    settings: type[Any] | None

    def __str__(self) -> str:
        """Return the key and the name, as messages show them."""
        return f"{self.key} = {self.use}"


def find_part(key: str, use: str, known: Mapping[str, str]) -> Part:
    """Return the part that ``key`` names by ``use``: one of ``known`` (name -> place), or a place itself.

    A place is ``package.module:attribute``.

    Raises:
        ConfigError: no such name, module or attribute, or its settings are not typed by a dataclass.
        PartError: the module itself fails when it is imported.
    """
    place = known.get(use, use)
    if ":" not in place:
        near = difflib.get_close_matches(use, known, n=1)
        hint = f" Did you mean {near[0]}?" if near else ""
        raise ConfigError(
            f"{key} = {use}: no part of that name.{hint} Expected one of {', '.join(sorted(known))}, or your own as "
            "my_package.my_module:factory"
        )
    make = resolve(place, key)
    if not callable(make):
        raise ConfigError(f"{key} = {use}: {_one(type(make))}, expected a class or a function that makes the part")
    return Part(key, use, make, _settings_type(key, use, make))


def resolve(place: str, key: str = "") -> Any:
    """Return what lies at ``place``, ``package.module:attribute``. ``key`` is named in errors. Raises as find_part."""
    module_name, _, attribute = place.partition(":")
    said = f"{key} = {place}" if key else place
    try:
        module = importlib.import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name and (module_name == error.name or module_name.startswith(f"{error.name}.")):
            raise ConfigError(
                f"{said}: no module {error.name!r}. Expected package.module:attribute, its folder named by the key "
                f"parts of params.yaml (hinterland parts=FOLDER ...) or on PYTHONPATH"
            ) from error
        raise PartError(f"{said} cannot be imported: {_origin(error)}") from error
    except Exception as error:
        raise PartError(f"{said} cannot be imported: {_origin(error)}") from error
    found = module
    for name in attribute.split("."):
        if not hasattr(found, name):
            near = difflib.get_close_matches(name, [entry for entry in dir(found) if entry[0] != "_"], n=1)
            hint = f" Did you mean {near[0]}?" if near else ""
            raise ConfigError(f"{said}: module {module_name} has no {attribute!r}.{hint}")
        found = getattr(found, name)
    return found


def settings_of(part: Part, given: Mapping[str, Any], key: str) -> Any:
    """Return the settings ``given`` at ``key`` as ``part`` types them, None where it takes none.

    Raises:
        ConfigError: an unknown key, a wrong type, a value the part's record refuses, or settings that nobody reads.
    """
    if part.settings is not None:
        return typed_settings(part.settings, given, key)
    if given:
        raise ConfigError(f"{key} holds {', '.join(given)}, but {part.use} takes no settings")
    return None


def make_part(part: Part, settings: Any = None, /, *, expected: type[Any], **given: Any) -> Any:
    """Return what ``part`` makes of its ``settings`` and of those of ``given`` that it takes.

    expected: the protocol (runtime checkable) that the result must keep.

    Raises:
        PartError: the factory fails, or makes something else.
    """
    offered = given if part.settings is None else given | {SETTINGS: settings}
    taken = inspect.signature(part.make).parameters
    everything = any(entry.kind is entry.VAR_KEYWORD for entry in taken.values())
    with named(part):
        made = part.make(**{name: value for name, value in offered.items() if everything or name in taken})
    lacking = [name for name in _members(expected) if not hasattr(made, name)]
    if lacking:
        raise PartError(
            f"{part} made {_one(type(made))} without {' and '.join(lacking)}: expected {_one(expected)} "
            f"({expected.__module__}.{expected.__name__})"
        )
    return made


@contextmanager
def named(part: Part | str) -> Iterator[None]:
    """Turn an error from within somebody's part into a PartError that names it and the line; so a false answer."""
    try:
        yield
    except PlannerError as error:
        raise PartError(f"{part}: {error}") from error
    except HinterlandError:
        raise
    except Exception as error:
        raise PartError(f"{part} failed: {_origin(error)}") from error


def add_to_path(folder: Path) -> None:
    """Let parts be imported from ``folder``; workers take over the path of the process that starts them."""
    place = str(folder.resolve())
    if place not in sys.path:
        sys.path.insert(0, place)


def _settings_type(key: str, use: str, make: Callable[..., Any]) -> type[Any] | None:
    try:
        parameters = inspect.signature(make).parameters
        hints = get_type_hints(make.__init__ if inspect.isclass(make) else make)
    except (TypeError, ValueError, NameError) as error:
        raise ConfigError(f"{key} = {use}: its parameters cannot be read ({error})") from error
    if SETTINGS not in parameters:
        return None
    kind = hints.get(SETTINGS)
    if not (isinstance(kind, type) and dataclasses.is_dataclass(kind)):
        raise ConfigError(
            f"{key} = {use}: its parameter `settings` is annotated {kind!r}, expected a frozen dataclass whose fields "
            "are the settings"
        )
    return kind


def _one(kind: type[Any]) -> str:
    return f"{'an' if kind.__name__[0] in 'AEIOU' else 'a'} {kind.__name__}"


def _members(protocol: type[Any]) -> list[str]:
    """Return the names a protocol asks for."""
    found = set(getattr(protocol, "__protocol_attrs__", set()))
    if not found:
        for base in protocol.__mro__:
            if base.__module__ not in ("typing", "builtins"):
                found |= {name for name in (*vars(base), *getattr(base, "__annotations__", {})) if name[0] != "_"}
    return sorted(found)


def _origin(error: BaseException) -> str:
    """Return the kind of ``error``, what it says, and the innermost line of code that is neither ours nor a library's.

    Where there is none, the innermost of all.
    """
    frames = traceback.extract_tb(error.__traceback__)
    theirs = [frame for frame in frames if not frame.filename.startswith(_NOT_THEIRS)]
    said = " ".join(str(error).split()) or "no message"
    where = (theirs or frames)[-1:]
    place = f" ({Path(where[0].filename).name}, line {where[0].lineno})" if where else ""
    return f"{type(error).__name__}: {said}{place}"
