"""Damage to what is packed: members of archives, arrays, and the headers of pictures."""

import io
import re
import zipfile
import zlib

import numpy as np

from tests.fuzz.changes import (
    TEXTS,
    Change,
    Random,
    delete,
    duplicate,
    empty,
    flip_bits,
    insert,
    numbers,
    set_bytes,
    truncate,
)
from tests.fuzz.sample import npz_bytes, zip_bytes


def _members(content: bytes) -> dict[str, bytes] | None:
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            return {name: archive.read(name) for name in archive.namelist()}
    except Exception:  # damaged before
        return None


def _member_changed(content: bytes, rng: Random) -> bytes:
    """Damage a member and pack it again, with a check sum that fits."""
    members = _members(content)
    if not members:
        return flip_bits(content, rng)
    name = rng.choice(sorted(members))
    change: Change = rng.choice((flip_bits, set_bytes, truncate, insert, duplicate, empty, numbers, _array_header))
    return zip_bytes(members | {name: change(members[name], rng)})


def _member_renamed(content: bytes, rng: Random) -> bytes:
    members = _members(content)
    if not members:
        return insert(content, rng)
    name = rng.choice(sorted(members))
    other = rng.choice(
        ("../x", "/x", "a/../../x", "C:/x", "a" * 3000, "x/", "..", ".", "a\\..\\b", "é\u202e\n", *members)
    )
    members[other] = members.pop(name)
    try:
        return zip_bytes(members)
    except (ValueError, UnicodeEncodeError):
        return content


def _member_lost(content: bytes, rng: Random) -> bytes:
    members = _members(content)
    if not members:
        return delete(content, rng)
    del members[rng.choice(sorted(members))]
    return zip_bytes(members)


def _directory_changed(content: bytes, rng: Random) -> bytes:
    """Change bytes of the local headers and of the directory at the end, which say sizes, flags and methods."""
    places = [match.start() for match in re.finditer(rb"PK(?:\x01\x02|\x03\x04|\x05\x06)", content)]
    changed = bytearray(content)
    for _ in range(rng.choice((1, 2, 6)) if places else 0):
        place = rng.choice(places) + rng.randrange(4, 46)
        if place < len(changed):
            changed[place] = rng.choice((0, 1, 8, 9, 12, 14, 99, 0xFF, rng.randrange(256)))
    return bytes(changed)


ZIP = (_member_changed, _member_changed, _member_renamed, _member_lost, _directory_changed, _directory_changed)


def _array_header(content: bytes, rng: Random) -> bytes:
    """Change what an .npy says of its shape and type, keeping the length of its header."""
    old, new = rng.choice(
        (
            (rb"\((\d+), (\d+)\)", b"(99999, 99999)"),
            (rb"\(\d+, \d+\)", b"(-1, 8)"),
            (rb"\(\d+, \d+\)", b"(10**9,)"),
            (rb"'\|u1'", b"'|O'"),
            (rb"'\|u1'", b"'>f8'"),
            (rb"'<i4'", b"'<c8'"),
            (rb"'<U10'", b"'<U9999999'"),
            (rb"'<f8'", b"'<M8[ns]'"),
            (rb"False", b"True"),
            (rb"\{", b"[["),
            (rb"descr", b"des\x00r"),
        )
    )
    changed = re.sub(old, new, content[:128], count=1)
    return changed[:128].ljust(128) + content[128:]


def _array_changed(content: bytes, rng: Random) -> bytes:
    """Give an array another type, shape or values, and pack all of them again."""
    try:
        with np.load(io.BytesIO(content)) as stored:
            layers = {name: stored[name] for name in stored.files}
        name = rng.choice(sorted(layers))
        layers[name] = _other_array(layers[name], rng)
        return npz_bytes(layers, packed=rng.random() < 0.5)
    except Exception:  # damaged before
        return flip_bits(content, rng)


def _other_array(array: np.ndarray, rng: Random) -> np.ndarray:
    kinds = ("u1", "i1", "i8", "u8", "f2", "f4", "f8", "c16", "?", "U3", "S3", "M8[s]", "m8[s]", "O", "f16")
    with np.errstate(all="ignore"):
        options = (
            lambda: array.astype(rng.choice(kinds)),
            lambda: array.ravel(),
            lambda: array[:0],
            lambda: array[None],
            lambda: array.T,
            lambda: np.asfortranarray(array),
            lambda: np.full(array.shape, rng.choice((np.nan, np.inf, -1e300, 1e308, -1.0, 2**40))),
            lambda: np.zeros(array.shape, dtype=[("a", "u1"), ("b", "f4")]),
            lambda: np.random.default_rng(rng.randrange(1000)).integers(0, 256, array.shape).astype(array.dtype),
            lambda: np.array([rng.choice(TEXTS[:10]) for _ in range(5)]),
            lambda: np.float64(float(rng.choice(("nan", "inf", "0", "-1", "1e308", "5e-324", "0.1", "3000")))),
            lambda: np.tile(array, rng.choice((2, 10))),
        )
        return np.asarray(rng.choice(options)())


NPZ = (_array_changed, _array_changed, _member_changed)


def _header_changed(content: bytes, rng: Random) -> bytes:
    """Change bytes among the first of a picture, where its size and depth stand; a PNG's check sums are put right."""
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 3)) if len(content) > 8 else 0):
        changed[rng.randrange(min(len(changed), 64))] = rng.choice((0, 1, 2, 8, 16, 0x7F, 0xFF, rng.randrange(256)))
    return with_right_sums(bytes(changed))


def with_right_sums(content: bytes) -> bytes:
    """Return a PNG whose chunks have the check sums they should have; anything else as it is."""

    if not content.startswith(b"\x89PNG"):
        return content
    changed, place = bytearray(content), 8
    while place + 12 <= len(changed):
        end = place + 8 + int.from_bytes(changed[place : place + 4], "big")
        if end + 4 > len(changed):
            break
        changed[end : end + 4] = zlib.crc32(changed[place + 4 : end]).to_bytes(4, "big")
        place = end + 4
    return bytes(changed)


HEADER = (_header_changed, _header_changed, numbers)
