"""What a network was made with, and in what a later run differs from it."""

from collections.abc import Mapping
from typing import Any

Settings = Mapping[str, Any]
"""Plain values by their whole names, such as ``sensor.max_range_m``."""


def made_differently(made_with: Settings, present: Settings) -> list[str]:
    """Return one sentence for each setting of ``present`` that the network was not made with, by name.

    Where ``made_with`` lacks a setting, the sentence says that it is not known; where it lacks all, one says so.
    """
    if made_with.keys().isdisjoint(present):
        return ["The network's file does not say what sensor, robot and resolution it was made with: train it again."]
    return [_sentence(name, made_with, present[name]) for name in sorted(present) if _differs(name, made_with, present)]


def _differs(name: str, made_with: Settings, present: Settings) -> bool:
    return name not in made_with or made_with[name] != present[name]


def _sentence(name: str, made_with: Settings, value: Any) -> str:
    known = f"was made with {name} = {made_with[name]}" if name in made_with else f"does not say its {name}"
    return f"The network {known}; these trials are driven with {value}."
