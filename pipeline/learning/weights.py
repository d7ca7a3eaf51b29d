"""Trained weights as safetensors: plain numbers and a JSON header, so that loading runs no code and needs no torch."""

import json
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import TableError
from pipeline.files import check_sum, replacing
from pipeline.learning.provenance import HEADER
from pipeline.learning.records import as_plain, from_plain

Arrays = dict[str, NDArray[Any]]
Shapes = Mapping[str, tuple[int, ...]]


@dataclass(frozen=True, kw_only=True)
class WeightsHeader:
    """What the header of any network tells; a network's own adds its architecture and the meaning of its numbers.

    Its fields are plain values, tuples and lists of them, mappings, other such records and named tuples.
    """

    steps: int = 0
    """Training steps after which these weights were taken."""
    fingerprint: str = ""
    """sha256 of the data and the configuration they were trained with."""
    made_with: dict[str, Any] = field(default_factory=dict)
    """Settings of sensor, robot, resolution and harvest behind the data, by their whole names; see
    pipeline.learning.provenance. Empty where the data do not say."""


Header = TypeVar("Header", bound=WeightsHeader)


@dataclass(frozen=True, kw_only=True)
class WeightsKind(Generic[Header]):
    """One kind of weights file.

    name, version: stand in the file; another version is refused. header: the type of its header.
    shapes: of the arrays that a header promises, by name.
    """

    name: str
    version: int
    header: type[Header]
    shapes: Callable[[Header], Shapes]


def save_weights(path: Path, kind: WeightsKind[Header], header: Header, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write header and arrays, atomically; equal content gives equal bytes.

    Raises:
        TableError: the arrays are not those that the header promises.
    """
    from safetensors.numpy import save

    ordered = {name: np.asarray(arrays[name], order="C") for name in sorted(arrays)}
    _check_arrays(path, kind.shapes(header), ordered)
    content = as_plain(header) | {"kind": kind.name, "version": kind.version}
    with replacing(path, summed=True) as scratch:
        scratch.write_bytes(save(ordered, metadata={HEADER: json.dumps(content, sort_keys=True)}))


def load_weights(path: Path, kind: WeightsKind[Header]) -> tuple[Header, Arrays]:
    """Return header and arrays of the weights file at ``path``.

    Raises:
        TableError: naming the file: it is missing, cut short, no weights file of this kind and version, or its arrays
            are not those that its header promises.
    """
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise TableError(f"{path} does not exist: run the train stage first.")
    check_sum(path, "Run `dvc repro -f train`: with its checkpoints whole, it writes the same weights at once.")
    try:
        with safe_open(path, framework="numpy") as file:
            marks = (file.metadata() or {}).get(HEADER)
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - not a mapping
    except (SafetensorError, OSError, ValueError, struct.error) as error:
        raise TableError(
            f"{path} is not a complete safetensors file ({error}): delete it and run the train stage again."
        ) from error
    header = _header(path, kind, marks)
    _check_arrays(path, kind.shapes(header), arrays)
    return header, arrays


def _header(path: Path, kind: WeightsKind[Header], marks: str | None) -> Header:
    try:
        content: dict[str, Any] = dict(json.loads(marks or "{}"))
    except (TypeError, ValueError):
        content = {}
    name, version = content.pop("kind", None), content.pop("version", None)
    if name != kind.name or version != kind.version:
        found = f"a {name} v{version}" if name else "no hinterland network"
        expected = f"a {kind.name} v{kind.version}"
        raise TableError(f"{path} holds {found}, this code reads {expected}: run `dvc repro train`.")
    try:
        return from_plain(kind.header, content)
    except TypeError as error:
        raise TableError(f"{path}: the header does not describe a network ({error}): run `dvc repro train`.") from error


def _check_arrays(path: Path, expected: Shapes, arrays: Arrays) -> None:
    found = {name: array.shape for name, array in arrays.items()}
    if found != expected:
        wrong = min(set(found.items()) ^ set(expected.items()))[0]
        raise TableError(
            f"{path}: array {wrong} has shape {found.get(wrong, 'none')}, expected {expected.get(wrong, 'none')} by "
            "its header: run the train stage again."
        )
    numbers = {name: array for name, array in arrays.items() if np.issubdtype(array.dtype, np.floating)}
    broken = [name for name, array in numbers.items() if not np.isfinite(array).all()]
    if broken:
        raise TableError(f"{path}: array {broken[0]} holds values that are not finite: run the train stage again.")
