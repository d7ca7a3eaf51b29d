"""Where plans lie: a folder, one file, or an archive, which is unpacked into a folder that lives as long as needed.

Archives are zip files and gzip files, also below a folder. Nothing of an archive is trusted: names that lead out of
it, links, passwords and sizes beyond the limits are refused before a byte is written, and what the archive says about
its sizes is checked again while unpacking. An npz is a zip file as well, but a plan of its own: it stays as it is, and
so does a document of an office program, which is one file for a person.
"""

import lzma
import re
import shutil
import stat
import struct
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from gzip import GzipFile
from pathlib import Path, PurePosixPath
from typing import IO
from unicodedata import category

from pipeline.errors import PlanError

MOST_BYTES = 2_000_000_000  # unpacked, all archives of one source together
MOST_MEMBERS = 100_000  # a HouseExpo archive has 35,126
_LARGEST_INDEX = 16_000_000  # of a zip file: 160 bytes for a member
_LONGEST_NAME = 1000
_CHUNK = 1 << 20
_BREAKS = ("Cc", "Cs", "Zl", "Zp")  # of Unicode: control characters, halves of letters, ends of lines
_ZIP, _GZIP = b"PK", b"\x1f\x8b"
_OTHERS = {b"7z\xbc\xaf": "7z", b"Rar!": "rar", b"\xfd7zXZ": "xz", b"\x28\xb5\x2f\xfd": "zstd"}
# Lists of the parts of a document: of Microsoft's programs, of OpenOffice and LibreOffice, of Java.
_PARTS = ("[Content_Types].xml", "META-INF/manifest.xml", "META-INF/MANIFEST.MF")
_DAMAGED = (
    OSError,
    EOFError,
    zipfile.BadZipFile,
    zlib.error,
    lzma.LZMAError,
    struct.error,
    NotImplementedError,
    RuntimeError,
    ValueError,
)


@dataclass(frozen=True, kw_only=True)
class SourceFile:
    """One file of a source.

    path: where it lies on disk, perhaps unpacked. name: what a person calls it, below the root of the source:
    "maps.zip/gates/map.yaml". original: the same as a full path, the archive standing for a folder. unpacked: the
    folder (or file) on disk that stands for an archive, and that archive. problem: why an archive cannot be unpacked.
    lone: the source is this file alone, so that options given for the source are meant for it.
    """

    path: Path
    name: str
    original: Path
    unpacked: tuple[Path, Path] | None = None
    problem: PlanError | None = None
    lone: bool = False

    def named_anew(self, text: str) -> str:
        """Return ``text`` with the places of unpacked files named as a person knows them."""
        return text.replace(str(self.unpacked[0]), str(self.unpacked[1])) if self.unpacked else text

    def source_of(self, source: str) -> str:
        """Return what a plan shall call its source, "maps.zip/gates/map.yaml"; what a reader adds to it stays."""
        if self.unpacked is None:
            return source
        inside, archive = self.unpacked
        member = self.path.relative_to(inside).as_posix() if self.path != inside else ""
        _, _, record = source.rpartition(self.path.name)
        return "/".join(filter(None, (archive.name, member))) + (record if record != source else "")


def lone_file(path: Path) -> SourceFile:
    """Return a file that is a source of its own."""
    return SourceFile(path=path, name=path.name, original=path)


@contextmanager
def open_source(root: Path, *, most_bytes: int = MOST_BYTES) -> Iterator[list[SourceFile]]:
    """Yield the files of a folder, a file or an archive, sorted by name; what was unpacked goes when the block ends.

    Hidden files are left out. An archive below a folder that cannot be unpacked stays in the list, with its problem.

    Raises:
        PlanError: no such folder or file, or ``root`` itself is an archive that cannot be unpacked.
    """
    if not root.exists():
        raise PlanError(f"plans.root = {root}: no such folder or file. Give the folder that holds the plans.")
    with tempfile.TemporaryDirectory(prefix="hinterland-") as scratch:
        unpacker = _Unpacker(Path(scratch), most_bytes)
        if not root.is_dir():
            files = unpacker.files(root, root.name)
            if files and files[0].path == root and files[0].problem is not None:
                raise files[0].problem
            files = [replace(file, lone=True) for file in files] if len(files) == 1 else files
        else:
            names = {path.relative_to(root).as_posix(): path for path in root.rglob("*") if path.is_file()}
            shown = sorted(name for name in names if not _hidden(name))
            files = [file for name in shown for file in unpacker.files(names[name], name)]
        yield files


def is_archive(path: Path) -> bool:
    """Return whether ``path`` is packed: by its ending, or by its content unless that is an npz or a document.

    A zip file whose members are all arrays is an npz under another name; one with a list of its parts, a document.
    """
    ending = path.suffix.lower()
    if ending in (".npz", ".npy"):
        return False
    start = _start(path)
    if start.startswith(_ZIP) or ending == ".zip":
        return (ending == ".zip" or zipfile.is_zipfile(path)) and not _is_one_file(path)
    return ending == ".gz" or start.startswith(_GZIP) or _unread_kind(start) is not None


class _Unpacker:
    """Unpacks archives into numbered folders of ``scratch``, until ``most_bytes`` have been written."""

    def __init__(self, scratch: Path, most_bytes: int) -> None:
        self._scratch = scratch
        self._limit = self._left = most_bytes
        self._count = 0

    def files(self, path: Path, name: str) -> list[SourceFile]:
        """Return ``path`` itself, or the files of the archive that it is."""
        if not is_archive(path):
            return [SourceFile(path=path, name=name, original=path)]
        self._count += 1
        folder = self._scratch / str(self._count)
        start = _start(path)
        try:
            if (kind := _unread_kind(start)) is not None:
                raise PlanError(f"{path}: a {kind} archive, which is not read. Unpack it and give the folder.")
            return list(self._gzip(path, name, folder) if start.startswith(_GZIP) else self._zip(path, name, folder))
        except PlanError as problem:
            return [SourceFile(path=path, name=name, original=path, problem=problem)]
        except _DAMAGED as problem:
            # The whole text of an error of the system names a file that nobody knows.
            why = getattr(problem, "strerror", None) or problem or type(problem).__name__
            text = f"{path}: not a readable archive ({str(why)[:200]}). Get the file again."
            return [SourceFile(path=path, name=name, original=path, problem=PlanError(text))]

    def _zip(self, path: Path, name: str, folder: Path) -> Iterator[SourceFile]:
        inside = folder / path.stem  # readers name a building after the folder of a file
        _check_index(path)
        with zipfile.ZipFile(path) as archive:
            entries = [entry for entry in archive.infolist() if not entry.filename.endswith("/")]
            _check_entries(path, entries)
            self._check_size(path, sum(entry.file_size for entry in entries))
            for entry in sorted(entries, key=lambda entry: entry.filename):
                if _hidden(entry.filename):
                    continue
                target = inside / PurePosixPath(entry.filename)
                target.parent.mkdir(parents=True, exist_ok=True)
                with archive.open(entry) as stream:
                    self._copy(path, stream, target, entry.file_size)
                yield SourceFile(
                    path=target,
                    name=f"{name}/{entry.filename}",
                    original=path / entry.filename,
                    unpacked=(inside, path),
                    problem=_nested(path / entry.filename, target),
                )

    def _gzip(self, path: Path, name: str, folder: Path) -> Iterator[SourceFile]:
        bare = {".gz": path.stem, ".svgz": f"{path.stem}.svg"}.get(path.suffix.lower(), path.name)
        target = folder / path.absolute().parent.name / bare
        target.parent.mkdir(parents=True)
        with path.open("rb") as stream, GzipFile(fileobj=stream) as content:
            self._copy(path, content, target, self._left)
        yield SourceFile(
            path=target,
            name=name,
            original=path.with_name(bare),
            unpacked=(target, path),
            problem=_nested(path, target),
        )

    def _check_size(self, path: Path, size: int) -> None:
        if size > self._left:
            raise PlanError(
                f"{path}: unpacks to {size:,} bytes; at most {self._limit:,} are unpacked in all. "
                "Unpack it yourself and give a part of it."
            )
        if size > shutil.disk_usage(self._scratch).free:
            raise PlanError(f"{path}: unpacks to {size:,} bytes, more than the disk for temporary files has left.")

    def _copy(self, path: Path, stream: IO[bytes] | GzipFile, target: Path, size: int) -> None:
        """Write ``stream`` to ``target``, no byte more than the ``size`` that was promised or allowed."""
        with target.open("xb") as out:
            while chunk := stream.read(min(_CHUNK, size + 1)):
                size -= len(chunk)
                if size < 0:
                    raise PlanError(
                        f"{path}: unpacks to more bytes than it says, or than the {self._limit:,} that are unpacked "
                        "in all. Unpack it yourself if you trust it."
                    )
                self._left -= len(chunk)
                out.write(chunk)


def _check_index(path: Path) -> None:
    """Refuse a zip file whose index, of which each entry takes memory, is too long.

    Any end of an archive in its last bytes may be the one that counts; a size beyond the file itself counts for none.
    """
    whole = path.stat().st_size
    with path.open("rb") as stream:
        stream.seek(max(0, whole - 66_000))
        tail = stream.read()
    sizes = [tail[end.start() + 12 : end.start() + 16] for end in re.finditer(b"PK\5\6", tail)]
    sizes += [tail[end.start() + 40 : end.start() + 48] for end in re.finditer(b"PK\6\6", tail)]
    if any(_LARGEST_INDEX < int.from_bytes(size, "little") <= whole for size in sizes):
        raise PlanError(f"{path}: lists far too many files, at most {MOST_MEMBERS:,} are read. Give it in parts.")


def _check_entries(path: Path, entries: list[zipfile.ZipInfo]) -> None:
    if len(entries) > MOST_MEMBERS:
        raise PlanError(f"{path}: holds {len(entries):,} files, at most {MOST_MEMBERS:,} are read. Give it in parts.")
    seen = set()
    for entry in entries:
        if any(category(letter) in _BREAKS for letter in entry.filename):
            raise PlanError(f"{path}: holds {entry.filename[:80]!a}, a name that is not one line. Pack it anew.")
        name, kind = entry.filename, stat.S_IFMT(entry.external_attr >> 16)
        parts = PurePosixPath(name.replace("\\", "/")).parts
        if not parts or name.startswith(("/", "\\")) or ".." in parts or ":" in parts[0] or len(name) > _LONGEST_NAME:
            raise PlanError(f"{path}: holds {name[:80]!r}, a name that leads out of the archive. It is not unpacked.")
        if kind not in (0, stat.S_IFREG):
            raise PlanError(f"{path}: {name} is a link or a device, not a file. Pack the archive without links.")
        if entry.flag_bits & 1:
            raise PlanError(f"{path}: {name} is encrypted. Unpack it with its password and give the folder.")
        if PurePosixPath(name) in seen:
            raise PlanError(f"{path}: holds two files named {name}. Pack it again.")
        seen.add(PurePosixPath(name))


def _nested(shown: Path, target: Path) -> PlanError | None:
    if not is_archive(target):
        return None
    return PlanError(f"{shown}: holds an archive within an archive, which is not read. Unpack the outer one first.")


def _hidden(name: str) -> bool:
    return any(part.startswith(".") or part == "__MACOSX" for part in PurePosixPath(name).parts)


def _is_one_file(path: Path) -> bool:
    try:
        _check_index(path)
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (*_DAMAGED, PlanError):
        return False
    return bool(names) and (all(name.endswith(".npy") for name in names) or any(name in _PARTS for name in names))


def _unread_kind(start: bytes) -> str | None:
    if start[257:262] == b"ustar":
        return "tar"
    if start.startswith(b"BZh") and start[4:10] == b"1AY&SY":
        return "bzip2"
    return next((kind for magic, kind in _OTHERS.items() if start.startswith(magic)), None)


def _start(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            return stream.read(263)
    except OSError:
        return b""
