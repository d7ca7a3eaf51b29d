"""Arrays as large as the disk: in scratch files without a name, which vanish with the process however it ends."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import TableError

_ROWS_AT_ONCE: Final = 65536


def row_blocks(count: int, size: int = _ROWS_AT_ONCE) -> Iterator[slice]:
    """Yield slices of ``size`` rows, the last one shorter, that cover ``count`` rows in order."""
    for first in range(0, count, size):
        yield slice(first, min(first + size, count))


class Spool:
    """Rows appended block by block to a scratch file in ``folder``, then mapped into memory as one array.

    The file is unlinked at birth: neither an error nor a kill leaves anything to clean. Its pages are the system's to
    write out and drop, so that an array of any size costs the process no memory of its own.
    """

    def __init__(self, folder: Path) -> None:
        """Write nothing yet: the first block decides about the type and the width of the rows."""
        self.folder = folder
        self.count = 0
        self._file: IO[bytes] | None = None
        self._like: NDArray[Any] = np.empty(0)

    def append(self, block: NDArray[Any]) -> None:
        """Add the rows of ``block`` [n, ...]. Raises TableError when they cannot be written, as on a full disk."""
        try:
            if self._file is None:
                self.folder.mkdir(parents=True, exist_ok=True)
                # Not in /tmp, which may lie in memory.
                self._file = tempfile.TemporaryFile(dir=self.folder, suffix=".partial")  # noqa: SIM115 - lives on
                self._like = block[:0].copy()
            assert block.shape[1:] == self._like.shape[1:], f"rows of {block.shape[1:]} after {self._like.shape[1:]}"
            self._file.write(np.ascontiguousarray(block, dtype=self._like.dtype).data)
            self._file.flush()  # all of it is on the disk before it is mapped: a mapped page without room is a signal
        except OSError as error:
            raise TableError(
                f"{self.folder}: a scratch file could not be written ({error}). Training needs about 1.1 kB of disk "
                "for each datum while it runs: make room and run train again."
            ) from error
        self.count += len(block)

    def mapped(self) -> NDArray[Any]:
        """Return all rows [N, ...]; what is written to the array goes to the file."""
        if self._file is None or not self.count:
            return self._like
        shape = (self.count, *self._like.shape[1:])
        # A plain array, since numpy and torch take short cuts that they deny to a subclass.
        return np.asarray(np.memmap(self._file, self._like.dtype, "r+", shape=shape))
