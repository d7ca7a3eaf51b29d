"""What a person says about plans that the files do not say: as flags of ``hinterland plan``, or as a YAML file."""

import re
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from pipeline.errors import ConfigError, one_line
from pipeline.floorplans.read_ranges import RANGES

if TYPE_CHECKING:
    from pipeline.floorplans.readers import ReadOptions
    from pipeline.floorplans.survey import DataSet

Check = Callable[[Any], Any]


def number_from(low: float, high: float, unit: str = "") -> Check:
    """Return what turns text or a number into a number from ``low`` to ``high``, or raises ArgumentTypeError."""

    def check(value: Any) -> float:
        try:
            number = float("nan") if isinstance(value, bool) else float(value)
        except (TypeError, ValueError):
            number = float("nan")
        if not low <= number <= high:
            raise ArgumentTypeError(f"expected a number from {low:g} to {high:g}{unit}, got {value!r}")
        return number

    return check


def whole_number(value: Any) -> int:
    """Return a whole number of at least 1, or raise ArgumentTypeError."""
    try:
        number = int(value)
    except (TypeError, ValueError):
        number = 0
    if number < 1:
        raise ArgumentTypeError(f"expected a whole number of at least 1, got {value!r}")
    return number


def _yes_no(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ArgumentTypeError(f"expected true or false, got {value!r}")
    return value


def _names(value: Any) -> tuple[str, ...]:
    listed = value if isinstance(value, list) else [value]
    if not all(isinstance(name, str | int | float) and not isinstance(name, bool) for name in listed):
        raise ArgumentTypeError(f"expected a list of names, got {value!r}")
    return tuple(str(name) for name in listed)


# By the names of ReadOptions, which are those of conf/plans/: read.
_CHECKS: dict[str, Check] = {
    **{name: number_from(low, high) for name, (low, high) in RANGES.items()},
    "invert": _yes_no,
    "paper": _yes_no,
    "levels": _names,
    "wall_layers": _names,
    "door_layers": _names,
}
# Sentences of readers and of rasterize name keys of the configuration; here the same things have flags.
_IN_FLAGS = {
    "plans.read.metres_per_unit=": "--scale ",
    "plans.read.metres_per_unit": "--scale",
    "plans.read.paper=true": "--paper",
    "plans.read.paper": "--paper",
    "plans.read.wall_layers": "--wall-layer",
    "plans.read.door_layers = ": "--door-layer ",
    "plans.read.door_layers": "--door-layer",
    "plans.read.levels = ": "--level ",
    "plans.read.levels": "--level",
    "plans.read.invert": "--invert",
    "plans.read.free_thresh": "--free-thresh",
    "plans.read.occupied_thresh": "--occupied-thresh",
    "plans.read.door_width_m": "--door-width",
    "plans.read.wall_m": "--wall",
    "plans.root = ": "",
    "plans.reader = ": "--reader ",
    "plans.reader": "--reader",
    ", or null.": ".",
    "rasterize.resolution_m = ": "--resolution ",
    "rasterize.resolution_m": "--resolution",
    " Change it in conf/rasterize/.": "",
    " in conf/rasterize/.": ".",
}


def add_read_options(parser: ArgumentParser) -> None:
    """Add the flags that say how files are to be read; their names in the result are those of ReadOptions."""
    group = parser.add_argument_group("what the files do not say themselves")
    group.add_argument("--reader", metavar="NAME", help="format of the files; by default each is looked into")
    options: list[tuple[str, str, str, str]] = [
        ("--scale", "metres_per_unit", "M", "size of a pixel, a cell or a drawing unit [m]"),
        ("--free-thresh", "free_thresh", "D", "pictures: darkness, 0 white to 1 black, below which it is free (0.196)"),
        ("--occupied-thresh", "occupied_thresh", "D", "pictures: darkness above which it is a wall (0.65)"),
        ("--door-width", "door_width_m", "M", "width of doors that the files give without one [m] (0.9)"),
        ("--wall", "wall_m", "M", "thickness of walls drawn as lines [m] (0.1)"),
    ]
    for flag, key, word, text in options:
        group.add_argument(flag, dest=key, metavar=word, type=_CHECKS[key], help=text)
    for flag, text in (
        ("--invert", "pictures: dark is free"),
        ("--paper", "pictures, grids: free space around the house up to the border is paper, and no floor"),
    ):
        group.add_argument(flag, action="store_const", const=True, help=text)
    for flag, key, word, text in (
        ("--level", "levels", "L", "read only this floor of a file"),
        ("--wall-layer", "wall_layers", "NAME", "layer or class of a drawing that holds walls, with * and ?"),
        ("--door-layer", "door_layers", "NAME", "the same for doors"),
    ):
        group.add_argument(flag, dest=key, metavar=word, action="append", help=f"{text}; may be repeated")


def add_workers(parser: ArgumentParser) -> None:
    """Add the flags of commands that read many files."""
    parser.add_argument(
        "--workers", type=whole_number, metavar="N", help="processes (one for each core); changes no result"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress bar")


def read_options(given: Namespace) -> "ReadOptions":
    """Return the reading options of a command line.

    Raises:
        ConfigError: the thresholds are in the wrong order.
    """
    said = {key: getattr(given, key) for key in _CHECKS if getattr(given, key) is not None}
    return _options({key: tuple(value) if isinstance(value, list) else value for key, value in said.items()})


def data_sets_from(path: Path) -> dict[str, "DataSet"]:
    """Return how to read the data sets that a YAML file names: ``{houses: {metres_per_unit: 0.05, reader: svg}}``.

    Raises:
        ConfigError: no such file, not YAML, or a key or value that is not one of ReadOptions or ``reader``.
    """
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as problem:
        raise ConfigError(f"{path}: not a readable YAML file ({' '.join(str(problem).split())}).") from problem
    if not isinstance(content, dict) or not all(isinstance(said, dict) for said in content.values()):
        raise ConfigError(f"{path}: expected a mapping of folder names to options, as in homes: {{wall_m: 0.2}}.")
    return {str(name): _data_set(path, str(name), said) for name, said in content.items()}


def in_flags(text: str) -> str:
    """Return a sentence about keys of the configuration in words of the command line, on one line."""
    text = re.sub(r"plans\.read\.\w+=(\S+), or (?=--[a-z-]+ \1)", "", text)
    for key, flag in _IN_FLAGS.items():
        text = text.replace(key, flag)
    return one_line(text)


def _data_set(path: Path, name: str, said: Mapping[Any, Any]) -> "DataSet":
    from pipeline.floorplans.readers import READERS
    from pipeline.floorplans.survey import DataSet

    values: dict[str, Any] = {}
    for key, value in said.items():
        allowed = ["reader", *_CHECKS]
        if key not in allowed:
            near = get_close_matches(str(key), allowed, n=1)
            hint = f"Did you mean {near[0]}? " if near else ""
            raise ConfigError(f"{path}: unknown key {name}.{key}. {hint}Allowed are {', '.join(allowed)}.")
        try:
            values[key] = str(value) if key == "reader" else _CHECKS[key](value)
        except ArgumentTypeError as problem:
            raise ConfigError(f"{path}: {name}.{key}: {problem}.") from problem
    reader = values.pop("reader", None)
    if reader is not None and reader not in READERS:
        raise ConfigError(f"{path}: {name}.reader = {reader}: no such reader. Choose one of {', '.join(READERS)}.")
    return DataSet(reader=reader, options=_options(values))


def _options(values: Mapping[str, Any]) -> "ReadOptions":
    from pipeline.floorplans.readers import ReadOptions

    options = ReadOptions(**values)
    free, occupied = options.thresholds()
    if free > occupied:
        raise ConfigError(
            f"free_thresh = {free:g} is above occupied_thresh = {occupied:g}: expected it below or equal."
        )
    return options
