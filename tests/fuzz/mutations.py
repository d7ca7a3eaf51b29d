"""Damage done to files: to their bytes and numbers, and to what their format makes of them.

`mutated` draws one damaged input from a seed and a number; the same two give the same input on every machine.
"""

import codecs
import io
import json
import random
import re
import zipfile
from collections.abc import Callable
from typing import Any
from xml.etree import ElementTree

import numpy as np

from tests.fuzz.bombs import bombs_of
from tests.fuzz.seeds import ARCHIVE, MANIFEST, Sample, npz_bytes, samples_of, zip_bytes

__all__ = ["bombs_of", "mutated"]

Random = random.Random
Change = Callable[[bytes, Random], bytes]

NUMBERS = (
    *("0", "-0", "-0.0", "1", "-1", "2", "0.5", "1e-9", "5e-324", "1e-300", "1e308", "-1e308", "1e309", "-1e999"),
    *("NaN", "-NaN", "nan", "Infinity", "-Infinity", "inf", ".inf", ".nan", "255", "256", "65535", "65536"),
    *("2147483647", "2147483648", "-2147483649", "4294967296", "9223372036854775807", "9223372036854775808"),
    *("9" * 30, "9" * 400, "1" * 5000, "0x10", "1_000", "1,5", "1.2.3", "--1", "+7", "1e", "٣", "1e5", "1e10", "1e17"),
)
TEXTS = (
    *("", " ", "a\nb", "a\r\nb", "\x00", "\x1b[31m", "\ud800", "\u202e", "\u2028", "é" * 300, "x" * 100_000),
    *("../../etc/passwd", "/etc/passwd", "a/b\\c", "CON", "%s%n", "{0}", "${HOME}", "<a>", "null", "nan", "1e999"),
    *("😀", "\ufeff", "\u0660", "0", "yes", ".", "..", "~"),
)
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
_WORD = re.compile(rb"[A-Za-z_][A-Za-z_0-9]*")
_PIECES = (
    *(b"\x00", b"\x00" * 64, b"\xff", b"\xff\xfe", b"\n", b"\r", b" ", b"{", b"}", b"[", b"]", b'"', b"'", b"<", b">"),
    *(
        b"</",
        b"&a;",
        b"<!--",
        b"<![CDATA[",
        b"$",
        b"*",
        b"#",
        b"(",
        b")",
        b",",
        b":",
        b"- ",
        b"PK\x03\x04",
        b"\xed\xa0\x80",
    ),
    *(
        b"\\u0000",
        b"\\ud800",
        b"nan",
        b"1e999",
        b"!!python/object:os.system ",
        b"&a *a",
        b"%",
        b"\xc3",
        b"\xf4\x90\x80\x80",
    ),
)


def mutated(reader: str, seed: int, number: int) -> tuple[str, Sample]:
    """Return the name of what was done, and the damaged sample."""
    rng = Random(f"{seed}/{reader}/{number}")
    sample = rng.choice(samples_of(reader))
    name = sample.main if rng.random() < 0.75 else rng.choice(sorted(sample.files))
    content, done = sample.files[name], []
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        kinds = _changes_for(name, reader)
        change = rng.choice(rng.choice(kinds))
        content = change(content, rng)
        done.append(change.__name__.strip("_"))
    files = sample.files | {name: content}
    options = sample.options
    if rng.random() < 0.05:
        options = type(options)(
            metres_per_unit=rng.choice((None, 1e-9, 0.05, 1e9)), wall_m=rng.choice((0.0, 0.1, 50.0))
        )
    if rng.random() < 0.02:
        done.append("taken away")
        del files[rng.choice(sorted(files))]
        files = files or {"other.txt": b"hello"}
    return f"{name}: {', '.join(done)}", Sample(files, sample.main, options)


def _changes_for(name: str, reader: str) -> list[tuple[Change, ...]]:
    """Return groups of changes that make sense for a file; a group is chosen first, then one of it."""
    ending = name.rpartition(".")[2].lower()
    kinds: list[tuple[Change, ...]] = [BYTES]
    if ending in ("json", "jsonl", "geojson"):
        kinds += [TEXT, JSON, JSON]
    elif ending in ("xml", "svg"):
        kinds += [TEXT, XML, XML]
    elif ending in ("dxf", "ifc", "yaml", "map", "csv"):
        kinds += [TEXT, LINES, TOKENS]
    elif ending in ("npz", "zip") or reader == ARCHIVE:
        kinds += [ZIP, NPZ] if ending == "npz" else [ZIP]
    elif reader != MANIFEST:
        kinds += [HEADER]
    return kinds


# Bytes


def _span(content: bytes, rng: Random) -> tuple[int, int]:
    start = rng.randrange(len(content) + 1)
    return start, min(len(content), start + int(2 ** rng.uniform(0, 10)))


def _truncate(content: bytes, rng: Random) -> bytes:
    return content[: rng.randrange(len(content) + 1)]


def _behead(content: bytes, rng: Random) -> bytes:
    return content[rng.randrange(min(len(content), 200) + 1) :]


def _flip_bits(content: bytes, rng: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 4, 32)) if content else 0):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _set_bytes(content: bytes, rng: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.choice((1, 2, 8)) if content else 0):
        changed[rng.randrange(len(changed))] = rng.choice((0, 0xFF, 0x7F, 0x80, rng.randrange(256)))
    return bytes(changed)


def _insert(content: bytes, rng: Random) -> bytes:
    start = rng.randrange(len(content) + 1)
    piece = rng.choice(_PIECES) if rng.random() < 0.7 else rng.randbytes(rng.randrange(1, 64))
    return content[:start] + piece * rng.choice((1, 1, 1, 100)) + content[start:]


def _delete(content: bytes, rng: Random) -> bytes:
    start, end = _span(content, rng)
    return content[:start] + content[end:]


def _duplicate(content: bytes, rng: Random) -> bytes:
    start, end = _span(content, rng)
    return content[:end] + content[start:end] * rng.choice((1, 1, 2, 50)) + content[end:]


def _move(content: bytes, rng: Random) -> bytes:
    start, end = _span(content, rng)
    rest = content[:start] + content[end:]
    place = rng.randrange(len(rest) + 1)
    return rest[:place] + content[start:end] + rest[place:]


def _append(content: bytes, rng: Random) -> bytes:
    return content + rng.choice((b"\x00" * 5000, b" " * 5000, rng.randbytes(500), content, b"\n{}", b"]", b"\x1a"))


def _empty(content: bytes, rng: Random) -> bytes:
    return rng.choice((b"", b"\n", b"\x00", b" " * 4000, b"\xef\xbb\xbf", content[:1]))


BYTES = (_truncate, _behead, _flip_bits, _set_bytes, _insert, _delete, _duplicate, _move, _append, _empty)


# Text


def _numbers(content: bytes, rng: Random) -> bytes:
    """Replace one number, or some of them, by nasty ones."""
    share = rng.choice((0.0, 0.0, 0.05, 0.5, 1.0))
    found = list(_NUMBER.finditer(content))
    if not found:
        return content
    chosen = rng.randrange(len(found))
    with_one = rng.choice(NUMBERS) if rng.random() < 0.3 else None
    parts, last = [], 0
    for k, match in enumerate(found):
        if k == chosen or rng.random() < share:
            parts += [content[last : match.start()], (with_one or rng.choice(NUMBERS)).encode()]
            last = match.end()
    return b"".join([*parts, content[last:]])


def _wobble(content: bytes, rng: Random) -> bytes:
    """Change numbers a little, so that outlines cross, touch and collapse."""
    size = rng.choice((1e-12, 1e-6, 0.1, 3.0, 50.0))

    def other(match: re.Match[bytes]) -> bytes:
        if rng.random() < 0.3 and len(match[0]) < 20:
            return f"{float(match[0]) + rng.choice((rng.gauss(0, size), 0.0, size, -size)):.17g}".encode()
        return match[0]

    return _NUMBER.sub(other, content)


def _words(content: bytes, rng: Random) -> bytes:
    """Replace one word by another word of the file, or by a nasty text."""
    found = list(_WORD.finditer(content))
    if not found:
        return content
    match = rng.choice(found)
    other = rng.choice(found)[0] if rng.random() < 0.6 else rng.choice(TEXTS).encode(errors="surrogatepass")
    return content[: match.start()] + other + content[match.end() :]


def _encoding(content: bytes, rng: Random) -> bytes:
    text = content.decode("utf-8", errors="replace")
    mark, name = rng.choice(
        (
            (codecs.BOM_UTF8, "utf-8"),
            (codecs.BOM_UTF16_LE, "utf-16-le"),
            (codecs.BOM_UTF16_BE, "utf-16-be"),
            (b"", "utf-16-le"),
            (codecs.BOM_UTF32_LE, "utf-32-le"),
            (b"", "cp037"),
            (b"", "utf-7"),
        )
    )
    return mark + text.encode(name, errors="replace")


TEXT = (_numbers, _numbers, _wobble, _wobble, _words, _encoding)


def _line_copied(content: bytes, rng: Random) -> bytes:
    lines = content.splitlines(keepends=True) or [b""]
    start = rng.randrange(len(lines))
    block = lines[start : start + rng.choice((1, 2, 8))]
    return b"".join(lines[:start] + block * rng.choice((2, 2, 3, 200)) + lines[start:])


def _line_lost(content: bytes, rng: Random) -> bytes:
    lines = content.splitlines(keepends=True) or [b""]
    start = rng.randrange(len(lines))
    return b"".join(lines[:start] + lines[start + rng.choice((1, 1, 2, 20)) :])


def _line_swapped(content: bytes, rng: Random) -> bytes:
    lines = content.splitlines(keepends=True) or [b""]
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return b"".join(lines)


def _line_replaced(content: bytes, rng: Random) -> bytes:
    lines = content.splitlines(keepends=True) or [b""]
    lines[rng.randrange(len(lines))] = rng.choice((*NUMBERS, *TEXTS)).encode(errors="surrogatepass") + b"\n"
    return b"".join(lines)


LINES = (_line_copied, _line_lost, _line_swapped, _line_replaced)
_TOKEN = re.compile(rb"#\d+|'[^']*'|\.[A-Z]+\.|\$|[\w.+-]+")


def _token_replaced(content: bytes, rng: Random) -> bytes:
    """Replace a token by another of the file, as a reference of IFC by one that makes a circle."""
    found = list(_TOKEN.finditer(content))
    if not found:
        return content
    match, other = rng.choice(found), rng.choice(found)[0]
    if rng.random() < 0.3:
        other = rng.choice(
            (b"$", b"*", b"()", b"''", b"#0", b"#99999999", b".T.", b"0", b"-1.", b"1.E400", b"'\\X2\\D800\\X0\\'")
        )
    return content[: match.start()] + other + content[match.end() :]


def _reference_replaced(content: bytes, rng: Random) -> bytes:
    found = list(re.finditer(rb"(?<!\n)#\d+", content))
    if not found:
        return _token_replaced(content, rng)
    match, other = rng.choice(found), rng.choice(found)
    return content[: match.start()] + other[0] + content[match.end() :]


TOKENS = (_token_replaced, _token_replaced, _reference_replaced)


# JSON


def _nasty(rng: Random) -> Any:
    values = (
        *(None, True, False, [], {}, "", 0, -1, 0.0, 1e308, -1e308, 1e-320, float("nan"), float("inf"), 10**400, 2**63),
        *([[]], [None], [[0]], [0, 0], {"x": 0}, [[0, 0]] * 3, [[0, 0], [1, 1], [0, 1], [1, 0]], [1e10, -1e10], "0"),
    )
    return rng.choice(TEXTS) if rng.random() < 0.3 else rng.choice(values)


def _places(value: Any, limit: int = 3000) -> list[tuple[Any, Any]]:
    """Return (container, key) of every value below ``value``, outer ones first."""
    places: list[tuple[Any, Any]] = []
    queue = [value]
    for inner in queue:
        keys = list(inner) if isinstance(inner, dict) else range(len(inner)) if isinstance(inner, list) else ()
        for key in keys:
            places.append((inner, key))
            queue.append(inner[key])
        if len(places) > limit:
            break
    return places


def _json_change(
    content: bytes, rng: Random, change: Callable[[Any, Any, list[tuple[Any, Any]], Random], None]
) -> bytes:
    """Change one place of a JSON document, or of one line of a file of lines."""
    lines = [content]
    which = 0
    try:
        value = json.loads(content)
    except (ValueError, RecursionError):
        lines = content.split(b"\n")
        which = rng.randrange(len(lines))
        try:
            value = json.loads(lines[which])
        except (ValueError, RecursionError):
            return _numbers(content, rng)
    holder = [value]
    places = _places(holder)
    container, key = rng.choice(places) if rng.random() < 0.5 else rng.choice(places[: 1 + len(places) // 4])
    change(container, key, places, rng)
    lines[which] = json.dumps(holder[0] if holder else None).encode()
    return b"\n".join(lines)


def _set(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    container[key] = _nasty(rng)


def _drop(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    del container[key]


def _repeat(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    if isinstance(container, list):
        container[key:key] = [container[key]] * rng.choice((1, 2, 300))
    else:
        container[f"{key}2"] = container[key]


def _wrap(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    for _ in range(rng.choice((1, 1, 2, 50))):
        container[key] = [container[key]] if rng.random() < 0.5 else {str(key): container[key]}


def _swap(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    other, its = rng.choice(places)
    container[key], other[its] = json.loads(json.dumps(other[its])), json.loads(json.dumps(container[key]))


def _rename(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    if isinstance(container, dict):
        container[rng.choice((*TEXTS, "type", "id"))] = container.pop(key)


def _retype(container: Any, key: Any, places: list[tuple[Any, Any]], rng: Random) -> None:
    value = container[key]
    options: list[Any] = [str(value), [value], {"0": value}, not value]
    if isinstance(value, int | float) and not isinstance(value, bool):
        options += [value * 1e6, -value, value + 1e-9, value * 10**20]
    if isinstance(value, list):
        options += [value[::-1], value[:1], value[1:], dict(enumerate(value)), value * 2]
    container[key] = rng.choice(options)


def _node(kind: Callable[[Any, Any, list[tuple[Any, Any]], Random], None]) -> Change:
    def change(content: bytes, rng: Random) -> bytes:
        try:
            return _json_change(content, rng, kind)
        except (ValueError, RecursionError, OverflowError, KeyError, IndexError):  # of a document damaged before
            return _numbers(content, rng)

    change.__name__ = f"json{kind.__name__}"
    return change


JSON = tuple(_node(kind) for kind in (_set, _set, _drop, _repeat, _wrap, _swap, _rename, _retype))


# XML


def _xml(content: bytes, rng: Random) -> bytes:
    """Change one element: its text, an attribute, its place, or how often it stands."""
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, LookupError):
        return _numbers(content, rng)
    parents = [(parent, child) for parent in root.iter() for child in parent]
    if not parents:
        return _words(content, rng)
    parent, child = rng.choice(parents)
    kind = rng.randrange(6)
    if kind == 0:
        parent.remove(child)
    elif kind == 1:
        for _ in range(rng.choice((1, 2, 100))):
            parent.append(child)
    elif kind == 2 and child.attrib:
        value = rng.choice(NUMBERS) if rng.random() < 0.5 else rng.choice(TEXTS)
        child.set(rng.choice(sorted(child.attrib)), value)
    elif kind == 3:
        child.text = rng.choice((*NUMBERS, *TEXTS))
    elif kind == 4:
        child.tag = rng.choice(parents)[1].tag
    else:
        other = rng.choice(parents)[1]
        child.attrib.update(other.attrib)
        child.set("transform", rng.choice(_TRANSFORMS))
    try:
        return ElementTree.tostring(root, encoding="utf-8")
    except (UnicodeEncodeError, RecursionError):
        return content


_TRANSFORMS = (
    *("scale(0)", "scale(1e308)", "rotate(nan)", "matrix(1 0 0 0 0 0)", "translate(1e400)", "skewX(90)", "foo(", ""),
    *("matrix(1e200 0 0 1e200 0 0)", "rotate(45)", "scale(-1,1)", "translate(5", "scale(1e-300)", "rotate(1e30)" * 50),
)
XML = (_xml,)


# Archives of arrays and other archives


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
        return _flip_bits(content, rng)
    name = rng.choice(sorted(members))
    change: Change = rng.choice(
        (_flip_bits, _set_bytes, _truncate, _insert, _duplicate, _empty, _numbers, _array_header)
    )
    return zip_bytes(members | {name: change(members[name], rng)})


def _member_renamed(content: bytes, rng: Random) -> bytes:
    members = _members(content)
    if not members:
        return _insert(content, rng)
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
        return _delete(content, rng)
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
        return _flip_bits(content, rng)


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


# Pictures


def _header_changed(content: bytes, rng: Random) -> bytes:
    """Change bytes among the first of a picture, where its size and depth stand; a PNG's check sums are put right."""
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 3)) if len(content) > 8 else 0):
        changed[rng.randrange(min(len(changed), 64))] = rng.choice((0, 1, 2, 8, 16, 0x7F, 0xFF, rng.randrange(256)))
    return with_right_sums(bytes(changed))


def with_right_sums(content: bytes) -> bytes:
    """Return a PNG whose chunks have the check sums they should have; anything else as it is."""
    import zlib

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


HEADER = (_header_changed, _header_changed, _numbers)
