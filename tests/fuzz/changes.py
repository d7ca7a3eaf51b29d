"""Damage to bytes, text, lines and tokens."""

import codecs
import random
import re
from collections.abc import Callable

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


def _span(content: bytes, rng: Random) -> tuple[int, int]:
    start = rng.randrange(len(content) + 1)
    return start, min(len(content), start + int(2 ** rng.uniform(0, 10)))


def truncate(content: bytes, rng: Random) -> bytes:
    return content[: rng.randrange(len(content) + 1)]


def behead(content: bytes, rng: Random) -> bytes:
    return content[rng.randrange(min(len(content), 200) + 1) :]


def flip_bits(content: bytes, rng: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 4, 32)) if content else 0):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def set_bytes(content: bytes, rng: Random) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.choice((1, 2, 8)) if content else 0):
        changed[rng.randrange(len(changed))] = rng.choice((0, 0xFF, 0x7F, 0x80, rng.randrange(256)))
    return bytes(changed)


def insert(content: bytes, rng: Random) -> bytes:
    start = rng.randrange(len(content) + 1)
    piece = rng.choice(_PIECES) if rng.random() < 0.7 else rng.randbytes(rng.randrange(1, 64))
    return content[:start] + piece * rng.choice((1, 1, 1, 100)) + content[start:]


def delete(content: bytes, rng: Random) -> bytes:
    start, end = _span(content, rng)
    return content[:start] + content[end:]


def duplicate(content: bytes, rng: Random) -> bytes:
    start, end = _span(content, rng)
    return content[:end] + content[start:end] * rng.choice((1, 1, 2, 50)) + content[end:]


def move(content: bytes, rng: Random) -> bytes:
    start, end = _span(content, rng)
    rest = content[:start] + content[end:]
    place = rng.randrange(len(rest) + 1)
    return rest[:place] + content[start:end] + rest[place:]


def append(content: bytes, rng: Random) -> bytes:
    return content + rng.choice((b"\x00" * 5000, b" " * 5000, rng.randbytes(500), content, b"\n{}", b"]", b"\x1a"))


def empty(content: bytes, rng: Random) -> bytes:
    return rng.choice((b"", b"\n", b"\x00", b" " * 4000, b"\xef\xbb\xbf", content[:1]))


BYTES = (truncate, behead, flip_bits, set_bytes, insert, delete, duplicate, move, append, empty)


def numbers(content: bytes, rng: Random) -> bytes:
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


def wobble(content: bytes, rng: Random) -> bytes:
    """Change numbers a little, so that outlines cross, touch and collapse."""
    size = rng.choice((1e-12, 1e-6, 0.1, 3.0, 50.0))

    def other(match: re.Match[bytes]) -> bytes:
        if rng.random() < 0.3 and len(match[0]) < 20:
            return f"{float(match[0]) + rng.choice((rng.gauss(0, size), 0.0, size, -size)):.17g}".encode()
        return match[0]

    return _NUMBER.sub(other, content)


def words(content: bytes, rng: Random) -> bytes:
    """Replace one word by another word of the file, or by a nasty text."""
    found = list(_WORD.finditer(content))
    if not found:
        return content
    match = rng.choice(found)
    other = rng.choice(found)[0] if rng.random() < 0.6 else rng.choice(TEXTS).encode(errors="surrogatepass")
    return content[: match.start()] + other + content[match.end() :]


def encoding(content: bytes, rng: Random) -> bytes:
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


TEXT = (numbers, numbers, wobble, wobble, words, encoding)


def line_copied(content: bytes, rng: Random) -> bytes:
    lines = content.splitlines(keepends=True) or [b""]
    start = rng.randrange(len(lines))
    block = lines[start : start + rng.choice((1, 2, 8))]
    return b"".join(lines[:start] + block * rng.choice((2, 2, 3, 200)) + lines[start:])


def line_lost(content: bytes, rng: Random) -> bytes:
    lines = content.splitlines(keepends=True) or [b""]
    start = rng.randrange(len(lines))
    return b"".join(lines[:start] + lines[start + rng.choice((1, 1, 2, 20)) :])


def line_swapped(content: bytes, rng: Random) -> bytes:
    lines = content.splitlines(keepends=True) or [b""]
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    lines[a], lines[b] = lines[b], lines[a]
    return b"".join(lines)


def line_replaced(content: bytes, rng: Random) -> bytes:
    lines = content.splitlines(keepends=True) or [b""]
    lines[rng.randrange(len(lines))] = rng.choice((*NUMBERS, *TEXTS)).encode(errors="surrogatepass") + b"\n"
    return b"".join(lines)


LINES = (line_copied, line_lost, line_swapped, line_replaced)

_TOKEN = re.compile(rb"#\d+|'[^']*'|\.[A-Z]+\.|\$|[\w.+-]+")


def token_replaced(content: bytes, rng: Random) -> bytes:
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


def reference_replaced(content: bytes, rng: Random) -> bytes:
    found = list(re.finditer(rb"(?<!\n)#\d+", content))
    if not found:
        return token_replaced(content, rng)
    match, other = rng.choice(found), rng.choice(found)
    return content[: match.start()] + other[0] + content[match.end() :]


TOKENS = (token_replaced, token_replaced, reference_replaced)
