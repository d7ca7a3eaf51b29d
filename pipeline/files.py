"""Atomic writes: a file appears whole under its final name or not at all. What stages exchange carries a checksum.

A file F that a later stage or a resumed one trusts has F.sha256 beside it, as ``sha256sum -c`` reads it: one flipped
bit in a table of numbers is otherwise just another number.
"""

import hashlib
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.errors import TableError

_PARTIAL = ".partial"
_SUM = ".sha256"


@contextmanager
def replacing(path: Path, *, summed: bool = False) -> Iterator[Path]:
    """Yield a scratch path beside ``path``; on success it takes the name, on an error it is removed.

    summed: a checksum goes beside it, see :func:`take_name`. Raises OSError that names ``path`` when the disk is full.
    """
    scratch = path.with_name(f"{path.name}.{os.getpid()}{_PARTIAL}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield scratch
        if summed:
            take_name(scratch, path)
        else:
            os.replace(scratch, path)
    except OSError as error:
        raise _about(error, path) from error
    finally:
        _discard(scratch)


def _discard(scratch: Path) -> None:
    try:
        scratch.unlink(missing_ok=True)
    except OSError:
        # The folder vanished or became read-only: the error that is under way says so, and says it better.
        return


def _about(error: OSError, path: Path) -> OSError:
    """Return ``error`` with ``path`` in it: Arrow and writes to an open file do not say which file it was."""
    if error.errno is None or (error.filename and _PARTIAL not in str(error.filename)):
        return error
    return OSError(error.errno, os.strerror(error.errno), str(path))


def write_text(path: Path, text: str, *, summed: bool = False) -> None:
    """Write ``text`` as UTF-8, atomically."""
    with replacing(path, summed=summed) as scratch:
        scratch.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Any) -> None:
    """Write ``content`` as indented JSON with sorted keys, atomically, with a checksum. NaN is refused."""
    write_text(path, json.dumps(content, indent=2, sort_keys=True, allow_nan=False) + "\n", summed=True)


def write_table(path: Path, table: pa.Table) -> None:
    """Write ``table`` as zstd parquet, atomically, with a checksum."""
    with replacing(path, summed=True) as scratch:
        pq.write_table(table, scratch, compression="zstd")


def remove_partials(folder: Path) -> None:
    """Delete scratch files that a killed run left behind in ``folder``."""
    for leftover in folder.glob(f"*{_PARTIAL}"):
        leftover.unlink(missing_ok=True)


def sum_path(path: Path) -> Path:
    """Return where the checksum of ``path`` lies."""
    return path.with_name(path.name + _SUM)


def digest_file(path: Path) -> str:
    """Return the sha256 of a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_sum(path: Path) -> None:
    """Put the checksum of the file ``path``, as it is now, beside it."""
    write_text(sum_path(path), _line(path, path.name))


def take_name(scratch: Path, path: Path) -> None:
    """Give the whole file ``scratch`` the name ``path`` and put its checksum beside it.

    Killed at any moment, whichever file bears the name fits its checksum: until the new one is in place, the checksums
    of both stand there.
    """
    line, beside = _line(scratch, path.name), sum_path(path)
    before = beside.read_text(encoding="utf-8", errors="replace") if path.exists() and beside.exists() else ""
    write_text(beside, line + before)
    os.replace(scratch, path)
    if before:
        write_text(beside, line)


def _line(path: Path, name: str) -> str:
    return f"{digest_file(path)}  {name}\n"


def damage(path: Path) -> str | None:
    """Return what is wrong with the file ``path`` or any file in the folder ``path``; None where all checksums fit."""
    if path.is_dir():
        inside = [entry for entry in sorted(path.rglob("*")) if entry.is_file()]
        files = {entry if entry.suffix != _SUM else entry.with_suffix("") for entry in inside}
        found = (damage(file) for file in sorted(files))
        return next((wrong for wrong in found if wrong), None if files else f"{path} is empty")
    beside = sum_path(path)
    if not path.is_file():
        return f"{path} is missing"
    if not beside.is_file():
        return f"{path} has no checksum {beside.name} beside it"
    known = beside.read_text(encoding="utf-8", errors="replace").splitlines(keepends=True)
    if _line(path, path.name) not in known:
        return f"{path} is damaged: its bytes do not give the SHA-256 in {beside.name}"
    return None


def check_sum(path: Path, remedy: str) -> None:
    """Compare ``path`` with its checksum before it is trusted.

    Raises:
        TableError: they differ or there is none; names the file and ends with ``remedy``.
    """
    if wrong := damage(path):
        raise TableError(f"{wrong}. {remedy}")
