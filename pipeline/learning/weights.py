"""Trained weights as safetensors: plain numbers and a JSON header, so that loading runs no code and needs no torch."""

import json
import struct
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import TableError
from pipeline.files import check_sum, replacing
from pipeline.learning.calibration import Calibration

WEIGHTS_VERSION: Final = 1
_KEY: Final = "hinterland"
_KIND: Final = "subgoal_network"

Arrays = dict[str, NDArray[np.float32]]


@dataclass(frozen=True, kw_only=True)
class NetworkHeader:
    """What one must know to use the weights: architecture, meaning of inputs and outputs, origin."""

    inputs: int
    hidden: tuple[int, ...]
    dropout: float
    input_frame: str
    """Which canonical frame the inputs are built in; see pipeline.systems.subgoals.inputs."""
    target_scaling: str
    """"standardise" or "log"; mean and spread are among the arrays."""
    calibration: Calibration = field(default_factory=Calibration)
    steps: int = 0
    """Training steps after which these weights were taken."""
    fingerprint: str = ""
    """sha256 of the data and the configuration they were trained with."""
    made_with: dict[str, Any] = field(default_factory=dict)
    """Settings of sensor, robot, resolution and harvest behind the data, by their whole names; see
    pipeline.learning.provenance. Empty where the data do not say."""


def save_weights(path: Path, header: NetworkHeader, arrays: Arrays) -> None:
    """Write header and arrays, atomically; equal content gives equal bytes."""
    from safetensors.numpy import save

    content = asdict(header) | {"kind": _KIND, "version": WEIGHTS_VERSION, "calibration": header.calibration._asdict()}
    ordered = {name: np.ascontiguousarray(arrays[name], dtype=np.float32) for name in sorted(arrays)}
    with replacing(path, summed=True) as scratch:
        scratch.write_bytes(save(ordered, metadata={_KEY: json.dumps(content, sort_keys=True)}))


def load_weights(path: Path) -> tuple[NetworkHeader, Arrays]:
    """Return header and arrays of the weights file at ``path``.

    Raises TableError naming the file when it is missing, cut short, no weights file of ours or of another version.
    """
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise TableError(f"{path} does not exist: run the train stage first.")
    check_sum(path, "Run `dvc repro -f train`: with its checkpoints whole, it writes the same weights at once.")
    try:
        with safe_open(path, framework="numpy") as file:
            marks = (file.metadata() or {}).get(_KEY)
            arrays = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - not a mapping
    except (SafetensorError, OSError, ValueError, struct.error) as error:
        raise TableError(
            f"{path} is not a complete safetensors file ({error}): delete it and run the train stage again."
        ) from error
    header = _header(path, marks)
    _check_shapes(path, header, arrays)
    return header, arrays


def _header(path: Path, marks: str | None) -> NetworkHeader:
    try:
        content: dict[str, Any] = dict(json.loads(marks or "{}"))
    except (TypeError, ValueError):
        content = {}
    kind, version = content.pop("kind", None), content.pop("version", None)
    if kind != _KIND or version != WEIGHTS_VERSION:
        found = f"a {kind} v{version}" if kind else "no hinterland network"
        raise TableError(f"{path} holds {found}, this code reads a {_KIND} v{WEIGHTS_VERSION}: run `dvc repro train`.")
    try:
        if not isinstance(content.get("made_with", {}), dict):
            raise TypeError("made_with is no table of settings")
        content |= {"hidden": tuple(content["hidden"]), "calibration": Calibration(**content["calibration"])}
        return NetworkHeader(**content)
    except (KeyError, TypeError) as error:
        raise TableError(f"{path}: the header does not describe a network ({error}): run `dvc repro train`.") from error


def _check_shapes(path: Path, header: NetworkHeader, arrays: Arrays) -> None:
    widths = (header.inputs, *header.hidden)
    expected: dict[str, tuple[int, ...]] = {f"input_{part}": (header.inputs,) for part in ("mean", "std")}
    expected |= {f"target_{part}": (2,) for part in ("mean", "std")}
    expected |= {"head.weight": (3, widths[-1]), "head.bias": (3,)}
    for index, (fan_in, fan_out) in enumerate(pairwise(widths)):
        expected |= {f"layers.{index}.0.weight": (fan_out, fan_in), f"layers.{index}.0.bias": (fan_out,)}
        parts = ("weight", "bias", "running_mean", "running_var")
        expected |= {f"layers.{index}.1.{part}": (fan_out,) for part in parts}
    found = {name: array.shape for name, array in arrays.items()}
    if found != expected:
        wrong = min(set(found.items()) ^ set(expected.items()))[0]
        raise TableError(
            f"{path}: array {wrong} has shape {found.get(wrong, 'none')}, expected {expected.get(wrong, 'none')} for "
            f"hidden widths {list(header.hidden)}: run the train stage again."
        )
    broken = [name for name, array in arrays.items() if not np.isfinite(array).all()]
    if broken:
        raise TableError(f"{path}: array {broken[0]} holds values that are not finite: run the train stage again.")
