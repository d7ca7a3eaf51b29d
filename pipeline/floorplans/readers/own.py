"""Readers of anybody's: a class named by its place, beside those of ours by name."""

from collections.abc import Mapping
from typing import Any

from pipeline.errors import ConfigError
from pipeline.floorplans.readers import READERS
from pipeline.floorplans.readers.reader import Reader
from pipeline.parts import find_part, make_part, settings_of


def find_reader(use: str | None, settings: Mapping[str, Any]) -> Reader | None:
    """Return the reader ``use``, a name of ours or ``package.module:class``; None for a look into each file.

    Raises:
        ConfigError: there is no such reader, or it takes other settings; names the key.
        PartError: its module or its class fails, or what it makes is no reader.
    """
    if use is None or ":" not in use:
        if settings:
            raise ConfigError(
                f"plans.reader_settings holds {', '.join(settings)}, but plans.reader = {use} takes no settings: what "
                "files do not say stands in plans.read"
            )
        if use is not None and use not in READERS:
            raise ConfigError(
                f"plans.reader = {use}: expected null, one of {', '.join(READERS)}, or your own as package.module:class"
            )
        return None if use is None else READERS[use]
    part = find_part("plans.reader", use, {})
    reader: Reader = make_part(part, settings_of(part, settings, "plans.reader_settings"), expected=Reader)
    return reader
