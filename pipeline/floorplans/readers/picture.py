"""Grey pictures in and out, with guards against damaged and oversized files."""

import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from pipeline.errors import PlanError

MOST_PIXELS = 36_000_000  # 6,000 x 6,000: 300 m at 5 cm per pixel
_DAMAGED = (OSError, SyntaxError, ValueError, EOFError, IndexError, MemoryError)  # what Pillow raises on bad files


class Grey(NamedTuple):
    """A picture. values: [rows, cols] float64 grey 0 to 255, row 0 is the top; transparent: [rows, cols] bool."""

    values: NDArray[np.float64]
    transparent: NDArray[np.bool_]


def read_picture(path: Path) -> Grey:
    """Read a picture as grey values; colours are averaged.

    Raises:
        PlanError: truncated, damaged, not a picture, or larger than 36 million pixels.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the size is checked right here
            with Image.open(path) as picture:
                if picture.width * picture.height > MOST_PIXELS:
                    raise PlanError(_too_large(path, f"{picture.width} x {picture.height}"))
                return _grey(picture)
    except Image.DecompressionBombError as problem:
        raise PlanError(_too_large(path, "far too many")) from problem
    except _DAMAGED as problem:
        raise PlanError(
            f"{path}: not a readable picture ({problem}); expected a whole PGM or PNG. Get it again."
        ) from problem


def write_picture(path: Path, values: NDArray[np.uint8]) -> None:
    """Write grey ``values`` [rows, cols], row 0 the top, as PGM (portable grey map)."""
    Image.fromarray(values).save(path, format="PPM")


def _grey(picture: Image.Image) -> Grey:
    if picture.mode.startswith(("I", "F")):  # 16 bits per pixel
        values = np.asarray(picture, dtype=np.float64)
        values = values * (255.0 / 65535.0) if values.max(initial=0) > 255 else values
        return Grey(values, np.zeros(values.shape, dtype=np.bool_))
    channels = np.asarray(picture.convert("RGBA"), dtype=np.uint8)
    return Grey(channels[..., :3].mean(axis=2), channels[..., 3] < 255)


def _too_large(path: Path, pixels: str) -> str:
    return f"{path}: {pixels} pixels, at most {MOST_PIXELS:,} are read. Scale it down and raise its resolution value."
