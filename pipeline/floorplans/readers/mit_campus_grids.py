"""MIT campus floors: ``<building>-<floor>_<seed>.npz`` with an occupancy and a semantic layer, 0.1 m per cell.

The files give no world origin and no north, and do not say whether row 0 is the top or the bottom. We read the
arrays as pictures (row 0 is the top) and turn the rows over, so that row 0 is the lowest y; origin is (0, 0). Were
the drawing the other way up, a floor would appear mirrored, which changes no distance.

Variants of a floor have the same walls and other furniture. ``background`` and ``clutter`` are the occupied cells.
"""

import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import PlanError
from pipeline.floorplans.openings import doors_from
from pipeline.floorplans.plan import CLUTTER, FREE, OCCUPIED, FloorPlan, GridPlan, Layer, Location
from pipeline.floorplans.readers.reader import ReadOptions, building_in_manifest

_MOST_BYTES = 400_000_000  # 14,000 x 14,000 cells in two layers
_LAYERS = ("occ_grid", "semantic_grid", "semantic_labels", "resolution")


@dataclass(frozen=True)
class MitCampusGrids:
    """Reader of the npz floors. Nothing is ever unpickled."""

    name: str = "mit_campus_grids"
    patterns: tuple[str, ...] = ("*.npz",)

    def sniff(self, path: Path) -> bool:
        """Return whether ``path`` is a zip archive that holds the occupancy layer."""
        try:
            with zipfile.ZipFile(path) as archive:
                return "occ_grid.npy" in archive.namelist()
        except (OSError, zipfile.BadZipFile):
            return False

    def accompanies(self, path: Path) -> bool:
        """Return False: a floor is one file."""
        return False

    def read(self, path: Path, options: ReadOptions) -> Iterator[FloorPlan | GridPlan | PlanError]:
        """Yield the one plan of the file; see `Reader.read`. The file states its scale: no option is used."""
        layers = _load(path)
        labels = [str(label) for label in layers["semantic_labels"]]
        semantic = layers["semantic_grid"]
        cells = np.where(layers["occ_grid"] == 0, FREE, OCCUPIED).astype(np.uint8)
        if "clutter" in labels:
            cells[(semantic == labels.index("clutter")) & (cells == OCCUPIED)] = CLUTTER
        marked = semantic == labels.index("door") if "door" in labels else np.zeros(cells.shape, dtype=np.bool_)
        resolution = float(layers["resolution"])
        origin = Location(0.0, 0.0)
        floor = path.stem.rpartition("_")[0] or path.stem
        yield GridPlan(
            plan_id=path.stem,
            building=building_in_manifest(path) or f"MIT-{floor.rpartition('-')[0] or floor}",
            floor=floor,
            environment="mit_floors",
            source=path.name,
            cells=np.ascontiguousarray(cells[::-1]),
            resolution=resolution,
            origin=origin,
            doors=doors_from(marked[::-1], resolution, origin),
            layers={"semantics": Layer(semantic[::-1].astype(np.uint16), dict(enumerate(labels)))},
        )


def _load(path: Path) -> dict[str, NDArray[np.generic]]:
    """Load the layers and check their shapes and kinds."""
    try:
        layers = _unpack(path)
    except ValueError as problem:
        if "Object arrays" in str(problem):
            raise PlanError(_pickled(path)) from problem
        raise PlanError(f"{path}: damaged npz ({problem}). Get the file again.") from problem
    except (OSError, EOFError, zipfile.BadZipFile, zlib.error, NotImplementedError) as problem:
        if path.is_file() and path.read_bytes()[:1] == b"\x80":  # how a pickle begins
            raise PlanError(_pickled(path)) from problem
        raise PlanError(f"{path}: not a readable npz ({problem}). Get the file again.") from problem
    _check(path, layers)
    return layers


def _unpack(path: Path) -> dict[str, NDArray[np.generic]]:
    with zipfile.ZipFile(path) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
    if size > _MOST_BYTES:
        raise PlanError(f"{path}: unpacks to {size:,} bytes, at most {_MOST_BYTES:,} are read. Cut the plan in parts.")
    with np.load(path, allow_pickle=False) as layers:
        missing = [layer for layer in _LAYERS if layer not in layers.files]
        if missing:
            found = ", ".join(layers.files) or "nothing"
            raise PlanError(f"{path}: layers {', '.join(missing)} are missing, found {found}. Export them again.")
        return {layer: layers[layer] for layer in _LAYERS}


def _pickled(path: Path) -> str:
    return (
        f"{path}: holds pickled objects, which can run code and are not loaded; expected plain number arrays. "
        "Save it again from a source you trust, with plain dtypes."
    )


def _check(path: Path, layers: dict[str, NDArray[np.generic]]) -> None:
    occupancy, semantic = layers["occ_grid"], layers["semantic_grid"]
    if occupancy.ndim != 2 or occupancy.size == 0 or semantic.shape != occupancy.shape:
        raise PlanError(
            f"{path}: occ_grid is {occupancy.shape} and semantic_grid {semantic.shape}; "
            "expected two grids of one shape [rows, cols] with at least one cell."
        )
    numbers = all(np.issubdtype(layers[name].dtype, np.number) for name in ("occ_grid", "semantic_grid", "resolution"))
    if not numbers or layers["resolution"].ndim or layers["semantic_labels"].dtype.kind != "U":
        raise PlanError(f"{path}: expected numbers in the grids, one resolution [m] and text labels. Export it again.")
    if not (np.isfinite(occupancy.astype(np.float64)).all() and np.isfinite(layers["resolution"].astype(np.float64))):
        raise PlanError(f"{path}: occ_grid or resolution holds a value that is not finite. Export it again.")
