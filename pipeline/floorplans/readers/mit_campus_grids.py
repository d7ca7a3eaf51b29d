"""MIT campus floors: ``<building>-<floor>_<seed>.npz`` with an occupancy and a semantic layer, 0.1 m per cell.

The files give no world origin and no north, and do not say whether row 0 is the top or the bottom. We read the
arrays as pictures (row 0 is the top) and turn the rows over, so that row 0 is the lowest y; origin is (0, 0). Were
the drawing the other way up, a floor would appear mirrored, which changes no distance.

Variants of a floor have the same walls and other furniture. ``background`` and ``clutter`` are the occupied cells.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import PlanError
from pipeline.floorplans.openings import doors_from
from pipeline.floorplans.plan import CLUTTER, FREE, OCCUPIED, FloorPlan, GridPlan, Layer, Location
from pipeline.floorplans.readers.json_file import short_text
from pipeline.floorplans.readers.npz import holds_layer, load_layers
from pipeline.floorplans.readers.reader import ReadOptions

_LAST_LETTER = 0x10FFFF
_MOST_LABELS = 1000  # the files have six
_LAYERS = ("occ_grid", "semantic_grid", "semantic_labels", "resolution")


@dataclass(frozen=True)
class MitCampusGrids:
    """Reader of the npz floors. Nothing is ever unpickled."""

    name: str = "mit_campus_grids"
    patterns: tuple[str, ...] = ("*.npz",)
    uses: tuple[str, ...] = ("paper",)

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a zip archive that holds the occupancy layer."""
        return holds_layer(path, "occ_grid")

    def accompanies(self, path: Path) -> bool:
        """Return False: a floor is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the file; see `Reader.read`. The file states its scale: no option is used."""
        layers = _load(path)
        labels = [short_text(str(label)) for label in layers["semantic_labels"]]
        semantic = layers["semantic_grid"]
        cells = np.where(layers["occ_grid"] == 0, FREE, OCCUPIED).astype(np.uint8)
        if "clutter" in labels:
            cells[(semantic == labels.index("clutter")) & (cells == OCCUPIED)] = CLUTTER
        marked = semantic == labels.index("door") if "door" in labels else np.zeros(cells.shape, dtype=np.bool_)
        resolution = float(layers["resolution"])
        origin = Location(0.0, 0.0)
        floor = path.stem.rpartition("_")[0] or path.stem
        try:
            doors = doors_from(marked[::-1], resolution, origin)
        except PlanError as problem:
            raise PlanError(f"{path}: {problem}") from problem
        yield GridPlan(
            plan_id=path.stem,
            building=f"MIT-{floor.rpartition('-')[0] or floor}",
            floor=floor,
            environment="mit_floors",
            source=path.name,
            cells=np.ascontiguousarray(cells[::-1]),
            resolution=resolution,
            origin=origin,
            doors=doors,
            layers={"semantics": Layer(semantic[::-1].astype(np.uint16), dict(enumerate(labels)))},
        )


def _load(path: Path) -> dict[str, NDArray[np.generic]]:
    """Load the layers and check their shapes and kinds."""
    layers = load_layers(path, _LAYERS)
    _check(path, layers)
    return layers


def _check(path: Path, layers: dict[str, NDArray[np.generic]]) -> None:
    occupancy, semantic = layers["occ_grid"], layers["semantic_grid"]
    if occupancy.ndim != 2 or occupancy.size == 0 or semantic.shape != occupancy.shape:
        raise PlanError(
            f"{path}: occ_grid is {occupancy.shape} and semantic_grid {semantic.shape}; "
            "expected two grids of one shape [rows, cols] with at least one cell."
        )
    labels, resolution = layers["semantic_labels"], layers["resolution"]
    numbers = occupancy.dtype.kind in "buif" and semantic.dtype.kind in "ui" and resolution.dtype.kind in "uif"
    if not numbers or resolution.ndim or labels.ndim != 1 or labels.dtype.kind != "U":
        raise PlanError(f"{path}: expected numbers in the grids, one resolution [m] and text labels. Export it again.")
    if not _is_text(labels):
        raise PlanError(f"{path}: semantic_labels holds bytes that are no text. Export it again.")
    if any(layer.dtype.kind == "f" and not np.isfinite(layer).all() for layer in (occupancy, resolution)):
        raise PlanError(f"{path}: occ_grid or resolution holds a value that is not finite. Export it again.")
    if len(labels) > _MOST_LABELS or not 0 <= int(semantic.min()) <= int(semantic.max()) < len(labels):
        raise PlanError(
            f"{path}: semantic_grid holds {semantic.min()} to {semantic.max()} and there are {len(labels)} labels; "
            f"expected the number of a label in each cell, at most {_MOST_LABELS} labels. Export it again."
        )


def _is_text(labels: NDArray[np.generic]) -> bool:
    """Return whether every letter is one: numpy stores any number, and Python fails on those beyond Unicode."""
    letters = np.frombuffer(labels.tobytes(), dtype=np.dtype(np.uint32).newbyteorder(labels.dtype.byteorder))
    return bool((letters <= _LAST_LETTER).all())
