"""ValetudoMap JSON: what vacuum robots know of a home, with its rooms as segments.

Layers hold pixels of ``pixelSize`` cm, as pairs (x, y) in ``pixels`` or, from version 2 on, as runs (x, y, length) in
``compressedPixels``; y points down. ``floor`` and ``segment`` layers are free, ``wall`` layers occupied, all else is
unknown. Segments become the layer "rooms" with their names. Entities (the robot, its path, zones) are not part of the
plan.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, OCCUPIED, UNKNOWN, FloorPlan, GridPlan, Layer, Location
from pipeline.floorplans.readers.json_file import finite_number, load_json, short_text, sniff_text
from pipeline.floorplans.readers.reader import ReadOptions

_MOST_CELLS = 36_000_000
_MOST_LAYERS = 1000
_LARGEST_COORDINATE = 100_000
_KINDS = ("floor", "segment", "wall")

Runs = NDArray[np.int64]  # [k, 3] x, y, length


@dataclass(frozen=True)
class Valetudo:
    """Reader of map files as the firmware replacement Valetudo exports them."""

    name: str = "valetudo"
    patterns: tuple[str, ...] = ("*.json",)
    uses: tuple[str, ...] = ("paper",)

    def sniff(self, path: Path) -> bool:
        """Return whether the class ValetudoMap stands near the beginning."""
        head = sniff_text(path)
        return head.lstrip().startswith("{") and '"ValetudoMap"' in head

    def accompanies(self, path: Path) -> bool:
        """Return False: a map is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the map; see `Reader.read`. The file states its scale: no option is used."""
        content = load_json(path)
        if not isinstance(content, dict) or content.get("__class") != "ValetudoMap":
            raise PlanError(f"{path}: no object of the class ValetudoMap. Is it a map exported by Valetudo?")
        pixel = finite_number(content.get("pixelSize"), f"{path}: pixelSize") / 100.0
        if pixel <= 0:
            raise PlanError(f"{path}: pixelSize is {100 * pixel:g}, expected centimetres per pixel above 0.")
        layers = _layers(path, content.get("layers"))
        runs = np.concatenate([found for _, _, found in layers])
        low, high = runs[:, :2].min(axis=0), (runs[:, :2] + np.c_[runs[:, 2], np.ones_like(runs[:, 2])]).max(axis=0)
        cols, rows = (high - low).tolist()
        if rows * cols > _MOST_CELLS:
            raise PlanError(f"{path}: {cols} x {rows} cells, at most {_MOST_CELLS:,} are read. Is the map damaged?")
        cells = np.full((rows, cols), UNKNOWN, dtype=np.uint8)
        rooms = np.zeros((rows, cols), dtype=np.uint16)
        labels: dict[int, str] = {}
        for kind in _KINDS:  # walls last: they win where layers overlap
            for layer_kind, label, found in layers:
                if layer_kind != kind:
                    continue
                at = _spread(found, low, cols)
                cells.ravel()[at] = OCCUPIED if kind == "wall" else FREE
                if kind == "segment":
                    labels[len(labels) + 1] = label
                    rooms.ravel()[at] = len(labels)
        yield GridPlan(
            plan_id=path.stem,
            building=path.stem,
            floor=path.stem,
            environment="valetudo_homes",
            source=path.name,
            cells=np.ascontiguousarray(cells[::-1]),
            resolution=pixel,
            origin=Location(0.0, 0.0),
            layers={"rooms": Layer(np.ascontiguousarray(rooms[::-1]), labels)},
            remarks=() if labels else ("the map has no rooms yet",),
        )


def _layers(path: Path, listed: object) -> list[tuple[str, str, Runs]]:
    """Return kind, label and runs of each layer that holds pixels."""
    if not isinstance(listed, list) or len(listed) > _MOST_LAYERS:
        raise PlanError(f"{path}: layers is {short_text(listed)}, expected a list of at most {_MOST_LAYERS}.")
    found = []
    for number, layer in enumerate(listed):
        if not isinstance(layer, dict) or layer.get("type") not in _KINDS:
            continue
        runs = _runs(layer, f"{path}: layer {number}")
        data = layer.get("metaData")
        given: dict[str, Any] = data if isinstance(data, dict) else {}
        label = short_text(given.get("name") or f"room {short_text(given.get('segmentId', number))}")
        if len(runs):
            found.append((str(layer["type"]), label, runs))
    if sum(int(runs[:, 2].sum()) for _, _, runs in found) > _MOST_CELLS:
        raise PlanError(f"{path}: its layers have more than {_MOST_CELLS:,} cells. Is the map damaged?")
    if not any(kind != "wall" for kind, _, _ in found):
        raise PlanError(f"{path}: no layer of floor or segments holds a pixel. Let the robot map the home first.")
    return found


def _runs(layer: dict[str, Any], name: str) -> Runs:
    packed = layer.get("compressedPixels") or []
    plain = layer.get("pixels") or []
    width = 3 if packed else 2
    listed = packed or plain
    if not isinstance(listed, list) or len(listed) % width or len(listed) > 3 * _MOST_CELLS:
        raise PlanError(f"{name}: expected numbers in groups of {width}. Get the file again.")
    if not all(type(value) is int and 0 <= value <= _LARGEST_COORDINATE for value in listed):
        raise PlanError(f"{name}: a pixel is no whole number from 0 to {_LARGEST_COORDINATE:,}. Get the file again.")
    numbers = np.array(listed, dtype=np.int64).reshape(-1, width)
    if width == 2:
        numbers = np.c_[numbers, np.ones(len(numbers), dtype=np.int64)]
    if numbers[:, 2].sum() > _MOST_CELLS:
        raise PlanError(f"{name}: more than {_MOST_CELLS:,} cells, at most that many are read. Get the file again.")
    return numbers[numbers[:, 2] > 0]


def _spread(runs: Runs, low: NDArray[np.int64], cols: int) -> NDArray[np.int64]:
    """Return the flat cells of ``runs`` in a grid whose first cell is ``low``."""
    starts = (runs[:, 1] - low[1]) * cols + runs[:, 0] - low[0]
    ends = np.cumsum(runs[:, 2])
    cells: NDArray[np.int64] = np.arange(ends[-1]) + np.repeat(starts - (ends - runs[:, 2]), runs[:, 2])
    return cells
