"""Refusal of impossible shapes, by the key of the configuration that holds the value."""

from math import isfinite

from pipeline.errors import ConfigError


def demand(key: str, value: float, holds: bool, allowed: str) -> None:
    """Raise a ConfigError that names ``key``, such as maze.columns, unless ``holds`` and ``value`` is finite."""
    if not (holds and isfinite(value)):
        raise ConfigError(f"plans.{key} = {value}: expected {allowed}. Change it in conf/plans/ or by plans.{key}=...")
