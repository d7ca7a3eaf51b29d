"""What a network was made with, and in what a later run differs from it."""

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from pipeline.errors import TableError

HEADER: Final = "hinterland"
"""Where a safetensors file of ours keeps its header, a JSON object."""

Settings = Mapping[str, Any]
"""Plain values by their whole names, such as ``sensor.max_range_m``."""


def made_with_of(path: Path) -> Settings:
    """Return the settings that the network at ``path``, of whatever kind, says it was made with; empty if it says none.

    Raises:
        TableError: the file is missing or holds no network of ours.
    """
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise TableError(
            f"{path} does not exist: expected the weights of a network, network.safetensors of a training."
        )
    try:
        with safe_open(path, framework="numpy") as file:
            content = json.loads((file.metadata() or {}).get(HEADER, "{}"))
    except (SafetensorError, OSError, ValueError, struct.error) as error:
        raise TableError(f"{path} is not a complete safetensors file ({error}): get it again.") from error
    if not isinstance(content, dict) or not isinstance(content.get("kind"), str):
        raise TableError(f"{path} holds no hinterland network: expected network.safetensors of a training.")
    made_with = content.get("made_with", {})
    if not isinstance(made_with, dict):
        raise TableError(f"{path}: made_with in its header is a {type(made_with).__name__}, expected settings by name.")
    return made_with


def made_differently(made_with: Settings, present: Settings) -> list[str]:
    """Return one sentence for each setting of ``present`` that the network was not made with, by name.

    One more sentence names the settings that ``made_with`` lacks, as that of an older version may; where it lacks all,
    that one says so.
    """
    if made_with.keys().isdisjoint(present):
        return ["The network's file does not say what sensor, robot and resolution it was made with: train it again."]
    sentences = [
        f"The network was made with {name} = {made_with[name]}; these trials are driven with {present[name]}."
        for name in sorted(present)
        if name in made_with and made_with[name] != present[name]
    ]
    unsaid = [f"{name} = {present[name]}" for name in sorted(present) if name not in made_with]
    return [*sentences, *([f"{_UNSAID}: these trials are driven with {', '.join(unsaid)}."] if unsaid else [])]


_UNSAID: Final = "The network does not say what it was made with of some settings"
