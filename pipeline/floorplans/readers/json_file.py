"""JSON from strangers: read whole or line by line with bounds, and numbers and names taken out of it with checks.

Every failure is a `PlanError` that names the file: too large, truncated, not UTF-8, nested too deeply, or a value that
is not what the format says. Python's reader lets NaN and Infinity pass; `finite_number` and `finite_points` do not.
"""

import json
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import PlanError

MOST_BYTES = 100_000_000
MOST_LINE_BYTES = 4_000_000
MOST_COORDINATES = 1_000_000
LARGEST_NUMBER = 1e10  # a map in millimetres with the northing of a national grid has 1e10 of them
_MOST_LETTERS = 120
_CHUNK = 1 << 20
_LAP = 1024  # a pattern that is looked for is shorter


def load_json(path: Path, *, most_bytes: int = MOST_BYTES) -> object:
    """Return the content of a JSON file; a byte order mark is allowed.

    Raises:
        PlanError: missing, a folder, larger than ``most_bytes``, not UTF-8, not JSON, or nested too deeply.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(most_bytes + 1)
    except OSError as problem:
        raise PlanError(f"{path}: cannot be read ({problem.strerror}). Check the path and its rights.") from problem
    if len(content) > most_bytes:
        raise PlanError(f"{path}: more than {most_bytes:,} bytes, at most that many are read. Split the file.")
    return parse_json(content, str(path))


def parse_json(content: bytes, name: str) -> object:
    """Return what the JSON text ``content`` holds; ``name`` says in an error where it stood.

    Raises:
        PlanError: not UTF-8, not JSON, or nested too deeply.
    """
    try:
        return json.loads(content.decode("utf-8-sig"))
    except UnicodeDecodeError as problem:
        raise PlanError(f"{name}: byte {problem.start} is not UTF-8, expected JSON text in UTF-8.") from problem
    except RecursionError as problem:
        raise PlanError(f"{name}: nested too deeply for a floor plan. Get the file again.") from problem
    except ValueError as problem:
        raise PlanError(f"{name}: not whole JSON ({short_text(str(problem))}). Get the file again.") from problem


def read_json_lines(path: Path, *, most_line_bytes: int = MOST_LINE_BYTES) -> Iterator[tuple[str, object]]:
    """Yield the content of each line that is not blank, with a name "file, line 7"; a line that is none as PlanError.

    Only one line is held at a time. A line above ``most_line_bytes`` is passed over without being held.

    Raises:
        PlanError: the file cannot be opened or read.
    """
    try:
        with path.open("rb") as stream:
            number = 0
            while line := stream.readline(most_line_bytes + 1):
                number += 1
                name = f"{path}, line {number}"
                if len(line) > most_line_bytes:
                    while line and not line.endswith(b"\n"):
                        line = stream.readline(most_line_bytes)
                    yield name, PlanError(f"{name}: longer than {most_line_bytes:,} bytes, expected one plan per line.")
                elif line.strip():
                    yield name, _record_or_error(line, name)
    except OSError as problem:
        raise PlanError(f"{path}: cannot be read ({problem.strerror}). Check the path and its rights.") from problem


def _record_or_error(line: bytes, name: str) -> object:
    try:
        return parse_json(line, name)
    except PlanError as problem:
        return problem


def sniff_text(path: Path, size: int = 4096) -> str:
    """Return the first ``size`` bytes of a file as text; bytes that are not UTF-8 become U+FFFD. Never raises."""
    try:
        with path.open("rb") as stream:
            return stream.read(size).decode("utf-8-sig", errors="replace")
    except (OSError, ValueError):  # ValueError: a null byte in the path
        return ""


def contains_all(path: Path, patterns: Sequence[str], *, most_bytes: int = MOST_BYTES) -> bool:
    """Return whether each of ``patterns`` is found anywhere in the first ``most_bytes`` of a file. Never raises.

    What says the format may stand behind megabytes of other things: the file is looked through piece by piece.
    ``patterns``: regular expressions, each for a text of at most 1,024 bytes.
    """
    wanted = [re.compile(pattern.encode()) for pattern in patterns]
    try:
        with path.open("rb") as stream:
            before, left = b"", most_bytes
            while wanted and left > 0 and (piece := stream.read(min(_CHUNK, left))):
                left -= len(piece)
                text = before + piece
                wanted = [pattern for pattern in wanted if pattern.search(text) is None]
                before = text[-_LAP:]
    except (OSError, ValueError):  # ValueError: a null byte in the path
        return False
    return not wanted


def finite_number(value: object, name: str, *, largest: float = LARGEST_NUMBER) -> float:
    """Return ``value`` as a number; ``name`` says in an error which value it is, such as "map.json: scale".

    Raises:
        PlanError: not a number (text and true are none), NaN, infinite, or beyond ``largest``.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise PlanError(f"{name} is {short_text(value)!r}, expected a number.")
    if not -largest <= value <= largest:  # also true of NaN; compared before float(), which overflows on long integers
        came = f"{value:g}" if isinstance(value, float) else "a very large integer"
        raise PlanError(f"{name} is {came}, expected a finite number of size at most {largest:g}.")
    return float(value)


def finite_points(value: object, name: str, *, most: int = MOST_COORDINATES) -> NDArray[np.float64]:
    """Return a list of [x, y, ...] as an array [points, 2]; further numbers per point, such as a height, are dropped.

    Raises:
        PlanError: not a list of points, more than ``most`` of them, or a coordinate is not a finite number.
    """
    if not isinstance(value, list):
        raise PlanError(f"{name} is {short_text(value)!r}, expected a list of points [x, y].")
    if len(value) > most:
        raise PlanError(f"{name} has {len(value):,} points, at most {most:,} are read. Simplify the drawing.")
    if not value:
        return np.empty((0, 2))
    if not all(isinstance(point, list) and 2 <= len(point) <= 4 for point in value):
        raise PlanError(f"{name}: a point is not a list [x, y] of two numbers.")
    pairs = [(point[0], point[1]) for point in value]
    if not all(type(x) in (int, float) and type(y) in (int, float) for x, y in pairs):
        raise PlanError(f"{name}: a coordinate is not a number.")
    try:
        points = np.asarray(pairs, dtype=np.float64)
    except OverflowError:
        points = np.full((1, 2), np.inf)
    if not (np.abs(points) <= LARGEST_NUMBER).all():
        raise PlanError(f"{name}: a coordinate is not finite or beyond {LARGEST_NUMBER:g}, expected metres.")
    return points


def short_text(value: object) -> str:
    """Return ``value`` as clean text of one short line, for names, labels and messages.

    Half a surrogate pair, which JSON can spell but no file can store, becomes a question mark.
    """
    if isinstance(value, int) and not isinstance(value, bool) and not _is_short(value):
        return "a very large integer"
    text = value if isinstance(value, str) else _kind(value)
    text = text[: 4 * _MOST_LETTERS].encode("utf-8", errors="replace").decode("utf-8")
    text = " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())
    return text if len(text) <= _MOST_LETTERS else text[: _MOST_LETTERS - 3] + "..."


def short_name(value: object) -> str:
    """Return ``value`` as `short_text` that can stand in the name of a plan or a file: without slashes."""
    return short_text(value).replace("/", "_").replace("\\", "_").lstrip(".")


def _is_short(value: int) -> bool:
    """Return whether an integer is small enough to be written out as a number."""
    return -LARGEST_NUMBER <= value <= LARGEST_NUMBER


def _kind(value: object) -> str:
    """Name a value that is no text: a number as it is, a list or mapping by its kind alone, as it may be large."""
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, dict):
        return f"a mapping of {len(value)}"
    return f"{value:g}" if isinstance(value, float) else str(value)
