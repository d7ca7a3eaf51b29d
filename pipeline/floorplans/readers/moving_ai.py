"""Moving AI benchmark maps: ``.map`` text grids and their ``.scen`` lists of start-goal pairs.

Format (N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", 2012): ``type octile``, ``height H``, ``width W``,
``map``, then H lines of W letters, the top row first. ``.`` and ``G`` are passable and ``S`` (swamp) is passable from
them; ``@`` and ``O`` are out of bounds, ``T`` trees and ``W`` water, all of them obstacles here. A scenario gives x
and y as column and row from the top. Cells have no metric size: ``metres_per_unit`` must be given.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, FloorPlan, GridPlan, Layer, Location
from pipeline.floorplans.readers.json_file import sniff_text
from pipeline.floorplans.readers.reader import ReadOptions

TERRAIN = {
    ".": "ground",
    "G": "ground",
    "S": "swamp",
    "@": "out of bounds",
    "O": "out of bounds",
    "T": "trees",
    "W": "water",
}
PASSABLE = ".GS"
_MOST_CELLS = 36_000_000
_MOST_SCENARIOS = 1_000_000
_HEAD = re.compile(r"\s*type\s+\w+\s+height\s+(\d{1,6})\s+width\s+(\d{1,6})\s+map[ \t]*\r?\n", re.IGNORECASE)


class Scenario(NamedTuple):
    """A start and a goal. start, goal: (column, row from the top). octile: length of the shortest path [cells]."""

    bucket: int
    start: tuple[int, int]
    goal: tuple[int, int]
    octile: float


@dataclass(frozen=True)
class MovingAi:
    """Reader of ``.map`` grids; ``.scen`` files accompany them."""

    name: str = "moving_ai"
    patterns: tuple[str, ...] = ("*.map",)
    uses: tuple[str, ...] = ("metres_per_unit", "paper")

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` begins with type, height, width and map."""
        return _HEAD.match(sniff_text(path, 256)) is not None

    def accompanies(self, path: Path) -> bool:
        """Return whether ``path`` is a list of scenarios."""
        return path.suffix.lower() == ".scen" and sniff_text(path, 64).lstrip().lower().startswith("version")

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the map; see `Reader.read`."""
        if options.metres_per_unit is None:
            raise PlanError(
                f"{path}: cells of such a map have no size, expected metres per cell. Give it: "
                "plans.read.metres_per_unit=0.5, or --scale 0.5"
            )
        letters = _letters(path)
        names = np.array(["", *sorted(set(TERRAIN.values()))])
        number = {letter: int(np.flatnonzero(names == name)[0]) for letter, name in TERRAIN.items()}
        code = np.zeros(256, dtype=np.uint16)
        for letter, value in number.items():
            code[ord(letter)] = value
        passable = np.isin(letters, [ord(letter) for letter in PASSABLE])
        folder = path.absolute().parent.name
        yield GridPlan(
            plan_id=path.stem,
            building=path.stem,
            floor=path.stem,
            environment=f"moving_ai_{folder}" if folder else "moving_ai",
            source=f"{folder}/{path.name}",
            cells=np.ascontiguousarray(np.where(passable, FREE, OCCUPIED).astype(np.uint8)[::-1]),
            resolution=options.metres_per_unit,
            origin=Location(0.0, 0.0),
            layers={"terrain": Layer(np.ascontiguousarray(code[letters][::-1]), dict(enumerate(names.tolist())))},
        )


def read_scenarios(path: Path) -> list[Scenario]:
    """Return the scenarios of a ``.scen`` file.

    Raises:
        PlanError: missing, not text, or a line is no scenario.
    """
    lines = _text(path).splitlines()
    if not lines or not lines[0].lower().startswith("version"):
        raise PlanError(f"{path}: begins with {lines[0][:40] if lines else ''!r}, expected 'version 1'. Is it a .scen?")
    if len(lines) > _MOST_SCENARIOS:
        raise PlanError(f"{path}: {len(lines):,} lines, at most {_MOST_SCENARIOS:,} are read. Split the file.")
    return [_scenario(path, number, line) for number, line in enumerate(lines[1:], start=2) if line.strip()]


def _scenario(path: Path, number: int, line: str) -> Scenario:
    parts = line.split("\t") if "\t" in line else line.split()
    try:
        bucket, (x0, y0, x1, y1), octile = int(parts[0]), map(int, parts[4:8]), float(parts[8])
    except (ValueError, IndexError) as problem:
        raise PlanError(
            f"{path}, line {number}: expected bucket, map, width, height, start x y, goal x y, length. Repair the line."
        ) from problem
    if not isfinite(octile) or min(x0, y0, x1, y1, octile) < 0:
        raise PlanError(f"{path}, line {number}: a place or length below 0 or not finite. Repair the line.")
    return Scenario(bucket, (x0, y0), (x1, y1), octile)


def _letters(path: Path) -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
    text = _text(path)
    head = _HEAD.match(text)
    if head is None:
        raise PlanError(f"{path}: expected the lines type, height, width and map at its head. Is it such a map?")
    height, width = int(head[1]), int(head[2])
    if not 0 < height * width <= _MOST_CELLS:
        raise PlanError(f"{path}: {height} x {width} cells, expected 1 to {_MOST_CELLS:,}. Correct its head.")
    lines = text[head.end() :].rstrip().splitlines()
    wrong = next((k for k, line in enumerate(lines) if len(line.rstrip(" ")) != width), None)
    if wrong is not None or len(lines) != height:
        came = f"row {wrong + 1} has {len(lines[wrong])} letters" if wrong is not None else f"{len(lines)} rows"
        raise PlanError(f"{path}: {came}, expected {height} rows of {width}. Get the file again.")
    joined = "".join(line[:width] for line in lines)
    foreign = sorted(set(joined) - set(TERRAIN))
    if foreign:
        raise PlanError(f"{path}: the letter {foreign[0]!r} is no terrain, expected one of {''.join(TERRAIN)}.")
    return np.frombuffer(joined.encode("ascii"), dtype=np.uint8).reshape(height, width)


def _text(path: Path) -> str:
    try:
        with path.open("rb") as stream:
            content = stream.read(_MOST_CELLS + 1_000_000)
            if stream.read(1):
                raise PlanError(f"{path}: larger than any map that is read ({_MOST_CELLS:,} cells). Cut it in parts.")
    except (OSError, ValueError) as problem:
        raise PlanError(f"{path}: cannot be read ({problem}). Check the path and its rights.") from problem
    try:
        return content.decode("ascii")
    except UnicodeDecodeError as problem:
        raise PlanError(f"{path}: byte {problem.start} is no letter of such a file. Get it again.") from problem
