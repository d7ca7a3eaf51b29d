"""Grey pictures in and out, with guards against damaged and oversized files."""

import struct
import warnings
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps
from PIL.PngImagePlugin import PngInfo

from pipeline.errors import PlanError

MOST_PIXELS = 36_000_000  # 6,000 x 6,000: 300 m at 5 cm per pixel
MOST_BYTES = 200_000_000
# Named one by one: Pillow would also try formats that start another program, such as EPS.
FORMATS = ("PNG", "PPM", "JPEG", "BMP", "GIF", "TIFF")
_READ = "PNG, PGM, JPEG, BMP, GIF or TIFF"
# What Pillow raises on bad files.
_DAMAGED = (
    *(OSError, SyntaxError, ValueError, EOFError, LookupError, MemoryError, TypeError, AttributeError),
    *(ArithmeticError, RuntimeError, AssertionError, struct.error, zlib.error),
)


class Grey(NamedTuple):
    """A picture. values: [rows, cols] float64 grey 0 to 255, row 0 is the top; transparent: [rows, cols] bool.

    notes: what its program wrote into the file as text (PNG), by key; empty in the other formats.
    """

    values: NDArray[np.float64]
    transparent: NDArray[np.bool_]
    notes: Mapping[str, str] = {}


def read_picture(path: Path) -> Grey:
    """Read a picture as grey values; colours are averaged.

    Raises:
        PlanError: truncated, damaged, not a picture, or larger than 36 million pixels or 200 MB.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of bombs: the size is checked right here; of odd metadata: not used
            if path.stat().st_size > MOST_BYTES:
                raise PlanError(f"{path}: more than {MOST_BYTES:,} bytes, at most that many are read. Scale it down.")
            with Image.open(path, formats=FORMATS) as picture:
                if picture.width * picture.height > MOST_PIXELS:
                    raise PlanError(_too_large(path, f"{picture.width} x {picture.height}"))
                return _grey(picture)
    except Image.DecompressionBombError as problem:
        raise PlanError(_too_large(path, "far too many")) from problem
    except _DAMAGED as problem:
        raise PlanError(
            f"{path}: not a readable picture ({problem}); expected a whole {_READ}. Get it again."
        ) from problem


def looks_like_a_picture(path: Path) -> bool:
    """Return whether the file begins as one of the `FORMATS`, however large it says it is. Never raises."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(path, formats=FORMATS):
                return True
    except Image.DecompressionBombError:
        return True
    except _DAMAGED:
        return False


def write_picture(path: Path, values: NDArray[np.uint8], notes: Mapping[str, str] | None = None) -> None:
    """Write grey ``values`` [rows, cols], row 0 the top: as PGM (portable grey map), or as PNG with ``notes``."""
    if notes is None:
        Image.fromarray(values).save(path, format="PPM")
        return
    texts = PngInfo()
    for key, text in notes.items():
        texts.add_text(key, text)
    Image.fromarray(values).save(path, format="PNG", pnginfo=texts)


def _grey(picture: Image.Image) -> Grey:
    if picture.format in ("JPEG", "MPO"):  # cameras store the picture as they were held, and how to turn or mirror it
        picture = ImageOps.exif_transpose(picture)
    if picture.mode.startswith("F"):
        raise ValueError("its pixels are not whole numbers")
    if picture.mode.startswith("I"):  # 16 bits per pixel
        values = np.asarray(picture, dtype=np.float64) * (255.0 / 65535.0)
        return Grey(values, np.zeros(values.shape, dtype=np.bool_), _notes(picture))
    if picture.mode in ("1", "L") and "transparency" not in picture.info:
        values = np.asarray(picture.convert("L"), dtype=np.float64)
        return Grey(values, np.zeros(values.shape, dtype=np.bool_), _notes(picture))
    channels = np.asarray(picture.convert("RGBA"), dtype=np.uint8)
    return Grey(channels[..., :3].mean(axis=2), channels[..., 3] < 255, _notes(picture))


def _notes(picture: Image.Image) -> dict[str, str]:
    """Return the texts in a picture whose pixels have been read: some stand behind the pixels."""
    return {key: value for key, value in picture.info.items() if isinstance(key, str) and isinstance(value, str)}


def _too_large(path: Path, pixels: str) -> str:
    return f"{path}: {pixels} pixels, at most {MOST_PIXELS:,} are read. Scale it down and raise its resolution value."
