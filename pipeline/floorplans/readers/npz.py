"""Arrays out of npz files from strangers: nothing is unpickled, and sizes are checked before memory is taken."""

import lzma
import struct
import zipfile
import zlib
from collections.abc import Sequence
from math import prod
from pathlib import Path
from tokenize import TokenError
from typing import IO

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import PlanError
from pipeline.floorplans.readers.json_file import short_text

MOST_BYTES = 400_000_000  # 14,000 x 14,000 cells in two layers
# What zipfile and numpy raise on bad files, beside ValueError.
_DAMAGED = (
    *(OSError, EOFError, LookupError, TypeError, AttributeError, MemoryError, ArithmeticError, SyntaxError),
    *(RuntimeError, zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, TokenError),
)


def holds_layer(path: Path, layer: str) -> bool:
    """Return whether ``path`` is a zip archive with the array ``layer``. Never raises."""
    try:
        with zipfile.ZipFile(path) as archive:
            return f"{layer}.npy" in archive.namelist()
    except (*_DAMAGED, ValueError):
        return False


def load_layers(path: Path, wanted: Sequence[str]) -> dict[str, NDArray[np.generic]]:
    """Return the arrays ``wanted`` of an npz file, by name.

    Raises:
        PlanError: damaged, too large, an array is missing, or one holds pickled objects.
    """
    try:
        return _unpack(path, wanted)
    except ValueError as problem:
        if "Object arrays" in str(problem):
            raise PlanError(_pickled(path)) from problem
        raise PlanError(f"{path}: damaged npz ({short_text(str(problem))}). Get the file again.") from problem
    except _DAMAGED as problem:
        if path.is_file() and _first_byte(path) == b"\x80":  # how a pickle begins
            raise PlanError(_pickled(path)) from problem
        raise PlanError(f"{path}: not a readable npz ({short_text(str(problem))}). Get the file again.") from problem


def _unpack(path: Path, wanted: Sequence[str]) -> dict[str, NDArray[np.generic]]:
    with zipfile.ZipFile(path) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
        if size > MOST_BYTES:
            raise PlanError(
                f"{path}: unpacks to {size:,} bytes, at most {MOST_BYTES:,} are read. Cut the plan in parts."
            )
        found = [name.removesuffix(".npy") for name in archive.namelist()]
        missing = [layer for layer in wanted if layer not in found]
        if missing:
            raise PlanError(
                f"{path}: layers {', '.join(missing)} are missing, found {short_text(', '.join(found)) or 'nothing'}. "
                "Export them again."
            )
        for layer in wanted:
            with archive.open(f"{layer}.npy") as stream:
                _check_size(stream, layer, archive.getinfo(f"{layer}.npy").file_size)
    with np.load(path, allow_pickle=False) as layers:
        return {layer: layers[layer] for layer in wanted}


def _check_size(stream: IO[bytes], layer: str, stored_bytes: int) -> None:
    """Refuse a header that announces more than the archive stores: numpy takes that memory before it reads."""
    version = np.lib.format.read_magic(stream)
    if version == (1, 0):
        shape, _, dtype = np.lib.format.read_array_header_1_0(stream)
    elif version == (2, 0):
        shape, _, dtype = np.lib.format.read_array_header_2_0(stream)
    else:
        raise ValueError(f"{layer} has npy version {version}, expected plain numbers or text")
    if not dtype.hasobject and (min(shape, default=1) < 0 or prod(shape) * dtype.itemsize > stored_bytes):
        raise ValueError(f"{layer} announces {shape} values of {dtype.itemsize} bytes and stores {stored_bytes:,}")


def _first_byte(path: Path) -> bytes:
    with path.open("rb") as stream:
        return stream.read(1)


def _pickled(path: Path) -> str:
    return (
        f"{path}: holds pickled objects, which can run code and are not loaded; expected plain number arrays. "
        "Save it again from a source you trust, with plain dtypes."
    )
