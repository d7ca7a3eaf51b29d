"""Bombs for grids: arrays, pictures, YAML, letters and runs of pixels."""

import io
import json
import struct
import zipfile
import zlib

import numpy as np

from tests.fuzz.bombs_common import DEEP, Bombs, replace_main
from tests.fuzz.sample import (
    Sample,
    npz_bytes,
    picture_bytes,
    zip_bytes,
)


def _npy(header: str, body: bytes, version: tuple[int, int] = (1, 0)) -> bytes:
    size = struct.pack("<H" if version == (1, 0) else "<I", len(header))
    return b"\x93NUMPY" + bytes(version) + size + header.encode("latin-1") + body


def npz_bombs(sample: Sample) -> Bombs:
    with np.load(io.BytesIO(sample.files[sample.main])) as stored:
        layers = {name: stored[name] for name in stored.files}
    plain = {f"{name}.npy": npy for name, npy in _unzipped(sample.files[sample.main]).items()}
    first = next(iter(layers))
    headers = {
        "huge shape": "{'descr':'|u1','fortran_order':False,'shape':(999999,999999),}",
        "overflowing shape": "{'descr':'|u1','fortran_order':False,'shape':(4294967296,4294967297),}",
        "negative shape": "{'descr':'|u1','fortran_order':False,'shape':(-1,-8),}",
        "zero wide": "{'descr':'|V0','fortran_order':False,'shape':(999999,999999),}",
        "empty text": "{'descr':'<U0','fortran_order':False,'shape':(99999999,),}",
        "many dimensions": "{'descr':'|u1','fortran_order':False,'shape':(" + "1," * 100 + "),}",
        "deep header": "(" * 2000 + ")" * 2000,
        "code as header": "__import__('os').system('false')",
        "nested type": "{'descr':[('a','|O')],'fortran_order':False,'shape':(2,),}",
        "sub-array": "{'descr':('|u1',(99999,99999)),'fortran_order':False,'shape':(2,),}",
    }
    for name, header in headers.items():
        for version in ((1, 0), (2, 0), (3, 0), (9, 9)):
            bomb = plain | {f"{first}.npy": _npy(header, b"\x00" * 100, version)}
            yield f"{name} v{version[0]}", replace_main(sample, zip_bytes(bomb))
    yield "pickled layer", replace_main(sample, npz_bytes(layers | {first: np.array([{}, 1], dtype=object)}))
    for layer, array in layers.items():
        yield (
            f"{layer} of 300 MB",
            replace_main(sample, npz_bytes(layers | {layer: np.zeros((17_000, 17_000), np.uint8)})),
        )
        yield f"{layer} all NaN", replace_main(sample, npz_bytes(layers | {layer: np.full(array.shape, np.nan)}))
    grid = (6000, 6000)
    wide = {name: np.ones(grid, layer.dtype) if layer.ndim == 2 else layer for name, layer in layers.items()}
    yield "36 million cells", replace_main(sample, npz_bytes(wide))
    checks = {
        name: np.indices((1500, 1500)).sum(0).astype(layer.dtype) % 2 * 2 if layer.ndim == 2 else layer
        for name, layer in layers.items()
    }
    yield "a chessboard", replace_main(sample, npz_bytes(checks))
    numbers = {
        name: np.arange(1_000_000).reshape(1000, 1000) % 65_000 if layer.ndim == 2 else layer
        for name, layer in layers.items()
    }
    yield "all other numbers", replace_main(sample, npz_bytes(numbers))
    if "semantic_labels" in layers:
        raw = np.frombuffer(struct.pack("<6I", 0x110000, 0xD800, 10, 0, 0x1B, 0x202E), dtype="<U1")
        yield "impossible letters", replace_main(sample, zip_bytes(plain | {"semantic_labels.npy": _as_npy(raw)}))
        long = np.array(["x" * 100_000, "door"])
        yield "long labels", replace_main(sample, npz_bytes(layers | {"semantic_labels": long}))
        many = np.array([f"l{k}" for k in range(200_000)])
        yield "many labels", replace_main(sample, npz_bytes(layers | {"semantic_labels": many}))


def _as_npy(array: np.ndarray) -> bytes:
    return _npy(f"{{'descr':'{array.dtype.str}','fortran_order':False,'shape':{array.shape},}}", array.tobytes())


def _unzipped(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name.removesuffix(".npy"): archive.read(name) for name in archive.namelist()}


def ros_bombs(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()
    laughs = "a0: &a0 [lol]\n" + "".join(f"a{k}: &a{k} [{','.join([f'*a{k - 1}'] * 10)}]\n" for k in range(1, 10))
    for key in ("image", "resolution", "origin", "negate", "mode", "free_thresh"):
        lines = [line for line in text.splitlines() if not line.startswith(key)]
        for value in (
            *(
                "*a9",
                "&r [*r]",
                "[[" * 2000 + "]]" * 2000,
                "9" * 5000,
                "2024-13-45",
                "1e999",
                ".nan",
                "-.inf",
                "0x",
                "0o9",
            ),
            *(
                "1:60:3",
                "!!binary abc",
                "!!timestamp x",
                "!!python/object/apply:os.system ['false']",
                "!!python/none",
                "? [a]",
            ),
            *(
                '"\\0"',
                '"\\ud800"',
                "a" * 5000,
                "../../etc/passwd",
                "/dev/zero",
                "{}",
                "true",
                "~",
                "!!set {a}",
                '"a\\nb"',
            ),
        ):
            bomb = f"{laughs}{key}: {value}\n" + "\n".join(lines) + "\n"
            yield f"{key}: {value[:20]} x {len(value)}", replace_main(sample, bomb.encode())
    yield "deep flow", replace_main(sample, b"[" * DEEP)
    yield "deep mapping", replace_main(sample, b"{a: " * DEEP)
    yield "deep dashes", replace_main(sample, b"- " * DEEP + b"a")
    yield "many keys", replace_main(sample, b"".join(b"k%d: 1\n" % k for k in range(200_000)) + text.encode())
    yield (
        "merge bomb",
        replace_main(
            sample,
            (
                "a0: &a0 {k: 1}\n"
                + "".join(f"a{k}: &a{k} {{<<: [{','.join([f'*a{k - 1}'] * 9)}]}}\n" for k in range(1, 9))
                + text
            ).encode(),
        ),
    )
    yield "two documents", replace_main(sample, f"---\n{text}---\n{text}".encode())
    yield "key that is a list", replace_main(sample, b"? [image]\n: 1\n? {a: 1}\n: 2\n" + text.encode())
    yield "timestamp", replace_main(sample, b"x: 2024-99-99\n" + text.encode())
    for name, picture in _picture_headers():
        yield f"picture {name}", Sample(sample.files | {"lab/map.pgm": picture}, sample.main)


def _png(width: int, height: int, body: bytes, *, depth: int = 8, colour: int = 0, extra: bytes = b"") -> bytes:
    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + extra + chunk(b"IDAT", zlib.compress(body)) + chunk(b"IEND", b"")
    )


def _picture_headers() -> Bombs:
    tall = picture_bytes(np.zeros((6000, 6000), np.uint8))
    text = struct.pack(">I", 10) + b"zTXta\x00\x00abcdefg" + b"\x00" * 4
    bomb = b"a\x00\x00" + zlib.compress(b"x" * 50_000_000)
    ztxt = struct.pack(">I", len(bomb)) + b"zTXt" + bomb + struct.pack(">I", zlib.crc32(b"zTXt" + bomb))
    grey16 = picture_bytes(np.zeros((5999, 6000), np.uint16))
    colours = picture_bytes(np.zeros((5999, 6000, 4), np.uint8))
    yield from (
        ("100 megapixels", _png(10_000, 10_000, b"\x00" * 1000)),
        ("a gigapixel", _png(40_000, 40_000, b"\x00" * 1000)),
        ("all there is", _png(0x7FFFFFFF, 0x7FFFFFFF, b"")),
        ("no pixels", _png(0, 5, b"")),
        ("one wide", _png(36_000_000, 1, b"\x00" * 1000)),
        ("36 million pixels", tall),
        ("36 million of 16 bits", grey16),
        ("36 million of 4 channels", colours),
        ("cut text", _png(5, 5, b"\x00" * 30, extra=text)),
        ("a text of 50 MB", _png(5, 5, b"\x00" * 30, extra=ztxt)),
        ("a body too long", _png(5, 5, b"\x00" * 50_000_000)),
        ("16 bits", _png(5, 5, b"\x00" * 60, depth=16, colour=0)),
        ("palette without one", _png(5, 5, b"\x00" * 30, colour=3)),
        ("pgm of a gigapixel", b"P5\n40000 40000\n255\n\x00"),
        ("pgm of -1", b"P5\n-1 -1\n255\n\x00"),
        ("pgm of many digits", b"P5\n" + b"9" * 5000 + b" 1\n255\n\x00"),
        ("pgm without depth", b"P5\n5 5\n0\n" + b"\x00" * 25),
        ("pgm of depth 65536", b"P5\n5 5\n65536\n" + b"\x00" * 50),
        ("plain pgm without end", b"P2\n6000 6000\n255\n" + b"1 " * 100_000),
        ("plain pgm of long numbers", b"P2\n2 2\n255\n" + b"1" * 1_000_000),
        ("pgm of comments", b"P5\n" + b"#" + b"c" * 5_000_000 + b"\n5 5\n255\n" + b"\x00" * 25),
        ("tiff", b"II*\x00\x08\x00\x00\x00\x01\x00\x00\x01\x04\x00\x01\x00\x00\x00\xff\xff\xff\x7f" + b"\x00" * 8),
        ("jpeg of a gigapixel", b"\xff\xd8\xff\xc0\x00\x0b\x08\xff\xff\xff\xff\x01\x01\x11\x00\xff\xd9"),
        ("jpeg and no more", b"\xff\xd8\xff\xe0\x00\x10JFIF\x00" + b"\xff" * 1000),
        (
            "bmp of a gigapixel",
            b"BM" + struct.pack("<IHHIIiiHHIIiiII", 54, 0, 0, 54, 40, 40_000, 40_000, 1, 24, 0, 0, 0, 0, 0, 0),
        ),
        (
            "bmp turned over",
            b"BM" + struct.pack("<IHHIIiiHHIIiiII", 54, 0, 0, 54, 40, 5, -(2**31), 1, 24, 0, 0, 0, 0, 0, 0),
        ),
        ("gif of a gigapixel", b"GIF89a\xff\xff\xff\xff\x00\x00\x00,\x00\x00\x00\x00\xff\xff\xff\xff\x00\x08\x00;"),
        ("postscript", b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n"),
    )


def pictures_bombs(sample: Sample) -> Bombs:
    for name, picture in _picture_headers():
        yield name, replace_main(sample, picture)
    chess = (np.indices((2000, 2000)).sum(0) % 2 * 255).astype(np.uint8)
    yield "a chessboard", replace_main(sample, picture_bytes(chess))
    noise = picture_bytes(np.random.default_rng(0).integers(0, 256, (2000, 2000), dtype=np.uint8))
    yield "noise of 4 million pixels", replace_main(sample, noise)
    blank = picture_bytes(np.full((3500, 3500), 255, np.uint8))
    yield "12 million blank pixels", replace_main(sample, blank)
    frame = np.full((3500, 3500), 255, np.uint8)
    frame[900:2600, [900, 2600]] = frame[[900, 2600], 900:2600] = 0
    for name, picture in (("blank", blank), ("framed", picture_bytes(frame)), ("chess", picture_bytes(chess))):
        for scale in (0.01, 0.05, 0.5):
            bomb = replace_main(sample, picture, metres_per_unit=scale, paper=True)
            yield f"paper, {name}, of {scale} m", bomb
    yield "noise on paper", replace_main(sample, noise, paper=True)
    for scale in (None, 0.0, -1.0, float("nan"), float("inf"), 1e-300, 1e300):
        yield f"scale {scale}", replace_main(sample, sample.files[sample.main], metres_per_unit=scale)


def valetudo_bombs(sample: Sample) -> Bombs:
    content = json.loads(sample.files[sample.main])

    def layers(*found: dict[str, object], **more: object) -> bytes:
        return json.dumps(content | {"layers": list(found)} | more).encode()

    yield "far corners", replace_main(sample, layers({"type": "floor", "pixels": [0, 0, 100_000, 100_000]}))
    yield "one long run", replace_main(sample, layers({"type": "floor", "compressedPixels": [0, 0, 100_000] * 300}))
    yield (
        "36 million cells",
        replace_main(
            sample, layers({"type": "floor", "compressedPixels": [n for y in range(600) for n in (0, y, 60_000)]})
        ),
    )
    yield (
        "36 million cells, 20 times",
        replace_main(
            sample,
            layers(*[{"type": "segment", "compressedPixels": [n for y in range(400) for n in (0, y, 60_000)]}] * 20),
        ),
    )
    yield (
        "a thousand layers of a million cells",
        replace_main(
            sample,
            layers(*[{"type": "segment", "compressedPixels": [n for y in range(400) for n in (0, y, 2500)]}] * 1000),
        ),
    )
    yield "two million numbers", replace_main(sample, layers({"type": "floor", "pixels": [5, 6] * 1_000_000}))
    for size in (0, -5, 1e-300, 1e9, "5", None):
        yield f"pixels of {size}", replace_main(sample, json.dumps(content | {"pixelSize": size}).encode())
    yield "type that is a list", replace_main(sample, layers({"type": [], "pixels": [1, 1]}))


def moving_ai_bombs(sample: Sample) -> Bombs:
    def grid(height: int, width: int, body: bytes) -> Sample:
        return replace_main(sample, b"type octile\nheight %d\nwidth %d\nmap\n%s" % (height, width, body))

    yield "a gigacell", grid(40_000, 40_000, b".\n")
    yield "no cells", grid(0, 5, b"\n")
    yield "36 million cells", grid(6000, 6000, (b"." * 6000 + b"\n") * 6000)
    yield "36 million rows", grid(999_999, 36, b"\n" * 1_000_000)
    yield "a chessboard", grid(1500, 1500, (b".@" * 750 + b"\n" + b"@." * 750 + b"\n") * 750)
    yield "a blank head", replace_main(sample, b" " * 1_000_000)
    yield "odd line ends", grid(2, 3, b"...\x0b...\x0c")
    yield "a long word", replace_main(sample, b"type " + b"a" * 5_000_000)
    yield "scale of 0", replace_main(sample, sample.files[sample.main], metres_per_unit=0.0)
