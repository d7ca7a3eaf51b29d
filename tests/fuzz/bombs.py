"""Inputs made to hurt: too deep, too large, too many, or leading out of where they lie. Every one is tried."""

import gzip
import io
import json
import pickle
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tests.fuzz.seeds import (
    ARCHIVE,
    MANIFEST,
    Sample,
    box,
    collection,
    feature,
    npz_bytes,
    picture_bytes,
    samples_of,
    wkt,
    zip_bytes,
)

Bombs = Iterator[tuple[str, Sample]]
DEEP = 100_000
_CHUNK = b"\x00" * 1_000_000


def bombs_of(reader: str) -> Bombs:
    sample = samples_of(reader)[0]

    def with_main(content: bytes) -> Sample:
        return replace_main(sample, content)

    yield "empty", with_main(b"")
    yield "zeros", with_main(_CHUNK)
    yield "noise", with_main(np.random.default_rng(0).bytes(100_000))
    yield "pickle", with_main(pickle.dumps({"occ_grid": 1}))
    yield "one long line", with_main(b"a" * 5_000_000)
    yield (
        "another format",
        with_main(
            samples_of("svg" if reader != "svg" else "dxf")[0].files["flat.svg" if reader != "svg" else "plan.dxf"]
        ),
    )
    yield "utf-16", with_main(sample.files[sample.main].decode("latin-1").encode("utf-16"))
    if sample.main.endswith(("json", "jsonl")):
        yield from _json_bombs(sample)
    if sample.main.endswith(("xml", "svg")):
        yield from _xml_bombs(sample)
    if sample.main.endswith("npz"):
        yield from _npz_bombs(sample)
    yield from _OWN.get(reader, lambda _: iter(()))(sample)


def replace_main(sample: Sample, content: bytes, **options: object) -> Sample:
    return Sample(sample.files | {sample.main: content}, sample.main, replace(sample.options, **options))  # type: ignore[arg-type]


def _json_bombs(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()
    yield "deep lists", replace_main(sample, b"[" * DEEP + b"]" * DEEP)
    yield "deep mappings", replace_main(sample, b'{"a":' * DEEP + b"1" + b"}" * DEEP)
    for number in ("0", "8", "1.5"):
        for deep in ("[" * DEEP + "]" * DEEP, "[" * 900 + "]" * 900, "1" * 4301, "9" * 400, "1e999", "NaN"):
            place = text.rfind(number)
            if place >= 0:
                bomb = text[:place] + deep + text[place + len(number) :]
                yield f"{number} becomes {deep[:8]} x {len(deep)}", replace_main(sample, bomb.encode())
    yield "100,000 commas", replace_main(sample, b"[" + b"0," * 100_000 + b"0]")
    yield "a key ten thousand times", replace_main(sample, b"{" + b'"features":[],' * 10_000 + b'"a":1}')


def _xml_bombs(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()
    head, _, rest = text.partition("?>\n")
    root = rest[1:].split(">", 1)[0].split(" ", 1)[0]
    laughs = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 10))
    for name, inner in (
        ("billion laughs", f'<!ENTITY l0 "ha">{laughs}'),
        ("quadratic", f'<!ENTITY l9 "{"a" * 100_000}">'),
        ("external entity", '<!ENTITY l9 SYSTEM "file:///etc/passwd">'),
        ("external parameter entity", '<!ENTITY % p SYSTEM "http://127.0.0.1:1/x.dtd"> %p; <!ENTITY l9 "a">'),
    ):
        bomb = f"{head}?>\n<!DOCTYPE {root} [{inner}]>{rest.replace('</', '&l9;</', 1)}"
        yield name, replace_main(sample, bomb.encode())
    yield "external dtd", replace_main(sample, f'{head}?>\n<!DOCTYPE {root} SYSTEM "file:///dev/zero">{rest}'.encode())
    for inner in ("g", "space", "building"):
        deep = f"<{inner}>" * DEEP + f"</{inner}>" * DEEP
        yield f"deep {inner}", replace_main(sample, rest.replace("</", f"{deep}</", 1).encode())
    yield (
        "many attributes",
        replace_main(sample, rest.replace(">", " " + " ".join(f'a{k}="1"' for k in range(100_000)) + ">", 1).encode()),
    )
    yield "many elements", replace_main(sample, rest.replace("</", "<a/>" * 310_000 + "</", 1).encode())
    yield "unknown encoding", replace_main(sample, text.replace("UTF-8", "nonsense-8").encode())
    yield "other encoding", replace_main(sample, text.replace("UTF-8", "utf-7").encode())
    yield "wide encoding", replace_main(sample, text.replace("UTF-8", "utf-32").encode())


def _npy(header: str, body: bytes, version: tuple[int, int] = (1, 0)) -> bytes:
    size = struct.pack("<H" if version == (1, 0) else "<I", len(header))
    return b"\x93NUMPY" + bytes(version) + size + header.encode("latin-1") + body


def _npz_bombs(sample: Sample) -> Bombs:
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
        "deep header": "(" * 5000 + ")" * 5000,
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


def _ros(sample: Sample) -> Bombs:
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


def _pictures(sample: Sample) -> Bombs:
    for name, picture in _picture_headers():
        yield name, replace_main(sample, picture)
    chess = (np.indices((2000, 2000)).sum(0) % 2 * 255).astype(np.uint8)
    yield "a chessboard", replace_main(sample, picture_bytes(chess))
    yield (
        "noise of 4 million pixels",
        replace_main(sample, picture_bytes(np.random.default_rng(0).integers(0, 256, (2000, 2000), dtype=np.uint8))),
    )
    for scale in (None, 0.0, -1.0, float("nan"), float("inf"), 1e-300, 1e300):
        yield f"scale {scale}", replace_main(sample, sample.files[sample.main], metres_per_unit=scale)


def _amrl(sample: Sample) -> Bombs:
    def segments(ends: np.ndarray) -> bytes:
        keys = [{"p0": {"x": a, "y": b}, "p1": {"x": c, "y": d}} for a, b, c, d in ends.reshape(-1, 4).tolist()]
        return json.dumps(keys).encode()

    rng = np.random.default_rng(0)
    yield "a scribble of 2,000 lines", replace_main(sample, segments(rng.uniform(0, 100, (2000, 4))))
    yield (
        "1,000 pieces",
        replace_main(sample, segments(np.tile(rng.uniform(0, 70, (1000, 2)), 2) + rng.uniform(0, 1, (1000, 4)))),
    )
    yield "coordinates of 1e9", replace_main(sample, segments(rng.uniform(-1e9, 1e9, (50, 4))))
    yield "one place", replace_main(sample, segments(np.zeros((1000, 4))))
    yield "1e-300", replace_main(sample, segments(rng.uniform(-1e-300, 1e-300, (50, 4))))


def _mlstruct(sample: Sample) -> Bombs:
    rng = np.random.default_rng(0)

    def rects(corners: np.ndarray, floors: int = 1) -> bytes:
        rect = {str(k): {"floorID": k % floors, "x": c[0], "y": c[1]} for k, c in enumerate(corners.tolist())}
        return json.dumps({"rect": rect, "slab": {}, "floor": {}, "image": 1, "scale": 1}).encode()

    yield "twisted walls", replace_main(sample, rects(rng.uniform(0, 50, (3000, 2, 4))))
    yield "a scribble as wall", replace_main(sample, rects(rng.uniform(0, 50, (1, 2, 9000))))
    yield "500 floors", replace_main(sample, rects(rng.uniform(0, 50, (500, 2, 4)), floors=500))


def _resplan(sample: Sample) -> Bombs:
    rng = np.random.default_rng(0)

    def home(shapes: list[str], kind: str = "living") -> bytes:
        return json.dumps([{"id": 1, "net_area": 50, "geometries": {kind: shapes}}]).encode()

    yield "a scribble as room", replace_main(sample, home([wkt([*rng.uniform(0, 100, (5000, 2)).tolist(), [0, 0]])]))
    yield "deep WKT", replace_main(sample, home(["GEOMETRYCOLLECTION(" * DEEP + ")" * DEEP]))
    yield "deep brackets", replace_main(sample, home(["POLYGON(" + "(" * DEEP]))
    yield "a number of a million digits", replace_main(sample, home([f"POLYGON(({'1' * 1_000_000} 0, 1 1, 0 1, 0 0))"]))
    for text in (
        "POLYGON EMPTY",
        "MULTIPOLYGON EMPTY",
        "POINT(0 0)",
        "POLYGON((0 0, 1 1))",
        "POLYGON((0 0,0 0,0 0,0 0))",
        "POLYGON Z((0 0 1,9 0 1,9 9 NaN,0 0 1))",
        "POLYGON((inf 0, 1 1, 0 1, inf 0))",
        "POLYGON((0 0,1 0,1 1,0 1))",
        "\x00",
        "\ud800",
        "POLYGON((1e308 0, -1e308 1, 0 1, 1e308 0))",
        "CURVEPOLYGON(CIRCULARSTRING(0 0, 4 0, 4 4, 0 4, 0 0))",
        "TRIANGLE((0 0, 1 0, 0 1, 0 0))",
        "POLYGON M((0 0 1,9 0 1,9 9 1,0 0 1))",
    ):
        yield text[:40].encode("ascii", "replace").decode(), replace_main(sample, home([text]))
    yield "20,000 rooms in one place", replace_main(sample, home([wkt(box(0, 0, 5, 5))] * 20_000))
    yield (
        "20,000 doors in one place",
        replace_main(
            sample,
            json.dumps(
                [
                    {
                        "id": 1,
                        "net_area": 50,
                        "geometries": {
                            "living": [wkt(box(0, 0, 9, 9))],
                            "wall": [wkt(box(0, 4, 9, 1))],
                            "door": [wkt(box(0, 4, 1, 1))] * 19_000,
                        },
                    }
                ]
            ).encode(),
        ),
    )
    yield "20,000 homes", replace_main(sample, json.dumps([{"geometries": {}}] * 20_000).encode())
    yield "net area of 1e-300", replace_main(sample, home([wkt(box(0, 0, 9, 9))]).replace(b"50", b"1e-300"))


def _valetudo(sample: Sample) -> Bombs:
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


def _features(sample: Sample) -> Bombs:
    name = sample.main
    tags: dict[str, object] = {
        "indoor": "room",
        "level": "0",
        "two_class": "floor",
        "type": "building_outline",
        "level_id": "level1",
        "category": "room",
    }
    door: dict[str, object] = {"door": "yes", "level": "0", "type": "door", "indoor": "door", "two_class": "shop"}
    rng = np.random.default_rng(0)
    big = feature("Polygon", box(0, 0, 200, 200), **tags)
    scribble = rng.uniform(0, 100, (3000, 2)).tolist()
    yield "a scribble", replace_main(sample, collection([feature("Polygon", [*scribble, scribble[0]], **tags)]))
    circle = [[50 + 50 * np.cos(a), 50 + 50 * np.sin(a)] for a in np.linspace(0, 2 * np.pi, 100_000)]
    yield (
        "a circle of 100,000 corners",
        replace_main(sample, collection([feature("Polygon", [*circle, circle[0]], **tags)])),
    )
    cells = [feature("Polygon", box(k % 100 * 2, k // 100 * 2, 2, 2), **tags) for k in range(300)]
    doors = [feature("Point", [[k % 100 * 2, k // 100 * 2 + 1.0]], **door) for k in range(300)]
    yield "300 rooms", replace_main(sample, collection(cells))
    yield "300 rooms and doors", replace_main(sample, collection(cells + doors))
    yield "200 rooms in one place", replace_main(sample, collection([big] * 200))
    many = [feature("Point", rng.uniform(0, 200, (1, 2)).tolist(), **door) for _ in range(1000)]
    yield "1,000 doors", replace_main(sample, collection([big, *cells[:50], *many]))
    yield "100,001 features", replace_main(sample, collection([{"type": "Feature"}] * 100_001))
    yield (
        "levels",
        replace_main(
            sample,
            collection([big | {"properties": tags | {"level": ";".join(f"{k}-{k + 199}" for k in range(50))}}] * 5),
        ),
    )
    yield (
        "a long list of levels",
        replace_main(sample, collection([big | {"properties": tags | {"level": "0;" * 1_000_000}}])),
    )
    for place in (90, 180, 181, 1e10, -85, 84.9999):
        moved = json.loads(json.dumps(big).replace("8.0, 48.0", f"{place}, {place}"))
        yield f"a corner at {place}", replace_main(sample, collection([moved]))
    if "geojson_map" in name:
        for info in (
            b"",
            b"[]",
            b'{"map_info": {"width": "x"}}',
            b"[" * DEEP,
            b'{"map_info": {"width": 1e999, "height": 1}}',
        ):
            files = sample.files | {name.replace("geojson_map", "floor_info"): info}
            yield f"size {info[:20]!r}", Sample(files, name)


def _imdf(sample: Sample) -> Bombs:
    yield from _features(sample)
    levels = sample.files["mall/level.geojson"].decode()
    for ordinal in ("NaN", "1e308", '"0"', "null", "9" * 400):
        other = {"mall/level.geojson": levels.replace('"ordinal": 0', f'"ordinal": {ordinal}').encode()}
        yield f"ordinal {ordinal[:9]}", Sample(sample.files | other, sample.main)
    for kind in ("level", "opening", "fixture"):
        for content in (b"", b"{}", b"[" * DEEP, collection([])):
            yield (
                f"{kind} {content[:20]!r} x {len(content)}",
                Sample(sample.files | {f"mall/{kind}.geojson": content}, sample.main),
            )
    line = feature("LineString", [[8, 2], [8, 3.2]], level_id="level1")
    many = {"mall/opening.geojson": collection([line] * 5000)}
    yield "5,000 openings in one place", Sample(sample.files | many, sample.main)


def _plan_geojson(sample: Sample) -> Bombs:
    text = samples_of("plan_geojson")[1].files["grid.geojson"].decode()
    for shape in (
        "[40000, 40000]",
        "[1e9, 1e9]",
        "[0, 5]",
        "[-3, -4]",
        "[1.5, 2.5]",
        "[6000, 6000]",
        '["a", 1]',
        "[1e-300, 1]",
    ):
        yield f"a grid of {shape}", replace_main(sample, text.replace("[10, 16]", shape).encode())
    for size in ("0", "-1", "1e-300", "1e300", "NaN"):
        yield (
            f"cells of {size} m",
            replace_main(sample, text.replace('"resolution": 0.5', f'"resolution": {size}').encode()),
        )
    yield "far away", replace_main(sample, text.replace('"origin": [0, 0]', '"origin": [1e10, -1e10]').encode())
    yield (
        "1,000 layers of 4 million cells",
        replace_main(
            sample,
            text.replace("[10, 16]", "[2000, 2000]")
            .replace('{"rooms"', "{" + "".join(f'"l{k}": {{}}, ' for k in range(1000)) + '"rooms"')
            .encode(),
        ),
    )
    rng = np.random.default_rng(0)
    scribble = [*rng.integers(0, 40, (3000, 2)).tolist(), [0, 0]]
    text = sample.files[sample.main].decode()
    yield (
        "a scribble",
        replace_main(sample, text.replace(json.dumps([box(0, 0, 4, 5)]), json.dumps([[[0, 0], *scribble]])).encode()),
    )
    circle = [[4 + np.cos(a), 2 + np.sin(a)] for a in np.linspace(0, 2 * np.pi, 100_000)]
    yield (
        "a room of 100,000 corners",
        replace_main(sample, text.replace(json.dumps([box(0, 0, 4, 5)]), json.dumps([[*circle, circle[0]]])).encode()),
    )


def _houseexpo(sample: Sample) -> Bombs:
    rng = np.random.default_rng(0)

    def house(verts: list[list[float]], **more: object) -> bytes:
        return json.dumps({"id": "h", "verts": verts, **more}).encode()

    yield "a scribble", replace_main(sample, house(rng.uniform(0, 50, (40_000, 2)).tolist()))
    yield "a scribble of 500", replace_main(sample, house(rng.uniform(0, 50, (500, 2)).tolist()))
    comb = [[x / 100, y] for k in range(10_000) for x, y in ((2 * k, 0), (2 * k, 50), (2 * k + 1, 50), (2 * k + 1, 0))]
    yield "a comb", replace_main(sample, house([*comb, [200, -5], [0, -5]]))
    spiral = [[a * np.cos(a) / 10, a * np.sin(a) / 10] for a in np.linspace(0, 300, 20_000)]
    yield "a spiral", replace_main(sample, house([*spiral, *([x * 1.001, y * 1.001] for x, y in spiral[::-1])]))
    yield "boxes", replace_main(sample, house(box(0, 0, 9, 9), room_category={"a": [[0, 0, 1, 1]] * 9999}))
    line = house(box(0, 0, 9, 9)) + b"\n"
    lines = Sample({"many.jsonl": line * 500}, "many.jsonl")
    yield "500 houses", lines
    yield "100,000 bad lines", Sample({"many.jsonl": b"{]\n" * 100_000}, "many.jsonl")
    yield "a line of 9 MB", Sample({"many.jsonl": b'{"verts": [[' + b"0," * 4_500_000 + b"\n" + line}, "many.jsonl")


def _luperto(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()
    start, end = text.index("<space "), text.index("</space>") + len("</space>")
    space = text[start:end]
    yield (
        "500 spaces",
        replace_main(sample, text.replace(space, "".join(space.replace("s1", f"s{k}") for k in range(500))).encode()),
    )
    portal = space[space.index("<portal>") : space.index("</portals>")]
    yield "50,000 portals", replace_main(sample, text.replace(portal, portal * 50_000).encode())
    yield (
        "scattered portals",
        replace_main(
            sample,
            text.replace(portal, "".join(portal.replace("l1", f"l{k}x") for k in range(10_000)))
            .replace(
                "<linesegment id",
                "".join(
                    f'<linesegment id="l{k}x"><point x="60" y="{20 + k / 500}"/></linesegment>' for k in range(10_000)
                )
                + "<linesegment id",
                1,
            )
            .encode(),
        ),
    )
    for pixels in ("1e-300", "1e300", "0", "-1", "nan"):
        yield f"scale {pixels}", replace_main(sample, text.replace("<value>10<", f"<value>{pixels}<").encode())


def _svg(sample: Sample) -> Bombs:
    def body(inner: str) -> Sample:
        return replace_main(sample, f'<svg xmlns="http://www.w3.org/2000/svg">{inner}</svg>'.encode())

    rng = np.random.default_rng(0)
    scribble = " ".join(f"{x},{y}" for x, y in rng.uniform(0, 5000, (3000, 2)).tolist())
    yield "a scribble", body(f'<polygon class="Wall" points="{scribble}"/>')
    yield "a scribbled line", body(f'<polyline class="Wall" fill="none" points="{scribble}"/>')
    yield "a long path", body(f'<path class="Wall" d="M0 0{" l 1 1" * 50_000}"/>')
    yield "a path of a million letters", body(f'<path class="Wall" d="{"M" * 1_000_000}"/>')
    yield "a path of digits", body(f'<path class="Wall" d="M{"1" * 1_000_000}"/>')
    yield "path in path", body(f'<path class="Wall" d="{"M0 0h9v9h-9z" * 5000}"/>')
    yield "spread path in path", body(f'<path class="Wall" d="{"".join(f"M{k} 0h9v9h-9z" for k in range(3000))}"/>')
    yield (
        "1,000 walls",
        body(
            "".join(
                f'<rect class="Wall" x="{k % 300 * 20}" y="{k // 300 * 20}" width="9" height="9"/>' for k in range(1000)
            )
        ),
    )
    yield "arcs", body('<path class="Wall" d="M0 0' + "a 1e300 1e-300 1e300 1 1 1e308 -1e308" * 100 + '"/>')
    yield (
        "many transforms",
        body(f'<g transform="{"rotate(1)" * 50_000}"><rect class="Wall" width="900" height="900"/></g>'),
    )
    yield (
        "unclosed transforms",
        body(f'<g transform="{"(" * 100_000}"><rect class="Wall" width="900" height="900"/></g>'),
    )
    yield (
        "blank transforms",
        body(f'<g transform="rotate({" " * 100_000}x"><rect class="Wall" width="900" height="900"/></g>'),
    )
    yield "long style", body(f'<rect class="Wall" style="{"fill:" * 100_000}" width="900" height="900"/>')
    yield "long classes", body(f'<rect class="{"wall " * 100_000}" width="900" height="900"/>')
    yield "star class", body(f'<rect class="{"a-" * 50_000}" width="900" height="900"/>')
    yield "long space", body(f'<g class="Space {"a" * 1_000_000}"><rect width="900" height="900"/></g>')
    for number in ("1e308", "nan", "inf", "1" * 400, "5%", "1e", "", "5in", "-9"):
        yield (
            f"rect of {number[:9]}",
            body(
                f'<rect class="Wall" x="{number}" y="0" width="{number}" height="{number}" rx="{number}"/>'
                f'<circle class="Wall" r="{number}"/>'
            ),
        )
    deep = '<g class="Wall">' * 99 + '<rect width="900" height="900"/>' + "</g>" * 99
    yield "99 groups", body(deep)


def _dxf(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()
    newline = "\r\n" if "\r\n" in text else "\n"

    def tags(*pairs: object) -> str:
        return newline.join(str(part) for part in pairs) + newline

    def model(entities: str, blocks: str = "") -> bytes:
        head = tags(0, "SECTION", 2, "HEADER", 9, "$ACADVER", 1, "AC1009", 9, "$INSUNITS", 70, 6, 0, "ENDSEC")
        inner = tags(0, "SECTION", 2, "BLOCKS") + blocks + tags(0, "ENDSEC")
        return (head + inner + tags(0, "SECTION", 2, "ENTITIES") + entities + tags(0, "ENDSEC", 0, "EOF")).encode()

    def block(name: str, *inserts: tuple[object, ...]) -> str:
        content = "".join(tags(0, "INSERT", 8, "WALL", 2, to, 10, x, 20, 0.0, *more) for to, x, *more in inserts)
        line = tags(0, "LINE", 8, "WALL", 10, 0.0, 20, 0.0, 11, 5.0, 21, 5.0)
        return tags(0, "BLOCK", 8, 0, 2, name, 70, 0, 10, 0.0, 20, 0.0) + line + content + tags(0, "ENDBLK", 8, 0)

    def insert(name: str, *more: object) -> str:
        return tags(0, "INSERT", 8, "WALL", 2, name, 10, 0.0, 20, 0.0, *more)

    yield "a block in itself", replace_main(sample, model(insert("A"), block("A", ("A", 1.0))))
    yield (
        "blocks in a circle",
        replace_main(sample, model(insert("A"), block("A", ("B", 1.0)) + block("B", ("A", 1.0), ("A", 2.0)))),
    )
    tower = "".join(block(f"B{k}", *[(f"B{k + 1}", float(x)) for x in range(20)]) for k in range(8)) + block("B8")
    yield "a tower of blocks", replace_main(sample, model(insert("B0"), tower))
    yield (
        "an array of inserts",
        replace_main(sample, model(insert("A", 70, 30_000, 71, 30_000, 44, 1.0, 45, 1.0), block("A"))),
    )
    yield (
        "an array of nothing",
        replace_main(
            sample,
            model(
                insert("A", 70, 30_000, 71, 30_000, 44, 1.0, 45, 1.0),
                tags(0, "BLOCK", 8, 0, 2, "A", 70, 0, 10, 0.0, 20, 0.0, 0, "ENDBLK", 8, 0),
            ),
        ),
    )
    rng = np.random.default_rng(0)
    lines = "".join(
        tags(0, "LINE", 8, "WALL", 10, a, 20, b, 11, c, 21, d) for a, b, c, d in rng.uniform(0, 90, (1500, 4)).tolist()
    )
    yield "a scribble", replace_main(sample, model(lines))
    doors = "".join(
        tags(0, "ARC", 8, "DOOR", 10, x, 20, y, 40, 0.9, 50, 0, 51, 90)
        for x, y in rng.uniform(0, 90, (3000, 2)).tolist()
    )
    yield "3,000 doors", replace_main(sample, model(doors + tags(0, "LINE", 8, "WALL", 10, 0, 20, 0, 11, 90, 21, 90)))
    curves = "".join(
        tags(
            0,
            "SPLINE",
            8,
            "WALL",
            70,
            8,
            71,
            3,
            72,
            8,
            73,
            4,
            *[p for k in (0, 0, 0, 0, 1, 1, 1, 1) for p in (40, k)],
            *[p for k in range(4) for p in (10, k * 1e300, 20, 1e308, 30, 0)],
        )
        for _ in range(20)
    )
    yield "splines to infinity", replace_main(sample, model(curves).replace(b"AC1009", b"AC1015"))
    knots = tags(
        0, "SPLINE", 8, "WALL", 70, 8, 71, 30_000, 72, 2_000_000_000, 73, 4, 40, 0, 40, 1, 10, 0, 20, 0, 10, 5, 20, 5
    )
    yield "a spline of degree 30,000", replace_main(sample, model(knots).replace(b"AC1009", b"AC1015"))
    fit = tags(
        0,
        "SPLINE",
        8,
        "WALL",
        70,
        8,
        71,
        3,
        74,
        2000,
        *[p for k in range(2000) for p in (11, k % 7, 21, k % 11, 31, 0)],
    )
    yield "a spline through 2,000 points", replace_main(sample, model(fit).replace(b"AC1009", b"AC1015"))
    turn = tags(0, "ARC", 8, "WALL", 10, 0, 20, 0, 40, 1e300, 50, -1e300, 51, 1e300) + tags(
        0, "CIRCLE", 8, "WALL", 10, 0, 20, 0, 40, 1e9
    )
    yield "huge arcs", replace_main(sample, model(turn))
    ellipse = tags(0, "ELLIPSE", 8, "WALL", 10, 0, 20, 0, 11, 1e-300, 21, 0, 40, 1e300, 41, 0, 42, 1e9)
    yield "a thin ellipse", replace_main(sample, model(ellipse).replace(b"AC1009", b"AC1015"))
    yield (
        "1,000 lines",
        replace_main(
            sample,
            model(
                "".join(
                    tags(0, "LINE", 8, "WALL", 10, k % 40, 20, k // 40, 11, k % 40 + 0.5, 21, k // 40)
                    for k in range(1000)
                )
            ),
        ),
    )
    yield "long layer", replace_main(sample, model(tags(0, "LINE", 8, "x" * 100_000, 10, 0, 20, 0, 11, 9, 21, 9)))
    yield (
        "odd layers",
        replace_main(
            sample, model("".join(tags(0, "LINE", 8, f"\x1b\u202e{k}", 10, 0, 20, 0, 11, 9, 21, 9) for k in range(30)))
        ),
    )
    yield "a comment without end", replace_main(sample, (tags(999, "x") * 100_000).encode())
    yield "blank lines", replace_main(sample, b"\n" * 1_000_000)
    yield "binary, cut", replace_main(sample, b"AutoCAD Binary DXF\r\n\x1a\x00" + b"\xff" * 1000)


def _ifc(sample: Sample) -> Bombs:
    text = sample.files[sample.main].decode()

    def edited(old: str, new: str) -> Sample:
        assert old in text
        return replace_main(sample, text.replace(old, new, 1).encode())

    yield "placement in itself", edited("#9=IFCLOCALPLACEMENT($,#6)", "#9=IFCLOCALPLACEMENT(#9,#6)")
    yield (
        "placements in a circle",
        edited("#9=IFCLOCALPLACEMENT($,#6);", "#9=IFCLOCALPLACEMENT(#99,#6);\n#99=IFCLOCALPLACEMENT(#9,#6);"),
    )
    chain = (
        "".join(f"#{k}=IFCLOCALPLACEMENT(#{k + 1},#6);\n" for k in range(10_000, 30_000))
        + "#30000=IFCLOCALPLACEMENT($,#6);"
    )
    yield "a chain of placements", edited("#9=IFCLOCALPLACEMENT($,#6);", f"#9=IFCLOCALPLACEMENT(#10000,#6);\n{chain}")
    yield (
        "a whole in itself",
        edited(
            "#13=IFCRELAGGREGATES('0000000000000000000005',$,$,$,#11,(#10))",
            "#13=IFCRELAGGREGATES('0000000000000000000005',$,$,$,#10,(#10))",
        ),
    )
    yield "deep brackets", edited("(#10)", "(" * DEEP + ")" * DEEP)
    yield "open brackets", edited("(#10)", "(" * DEEP)
    yield (
        "solid in itself",
        edited("#104=IFCEXTRUDEDAREASOLID(#103,#6,#4,3.000)", "#104=IFCBOOLEANRESULT(.DIFFERENCE.,#104,#104)"),
    )
    yield (
        "a mapped item in itself",
        edited(
            "#104=IFCEXTRUDEDAREASOLID(#103,#6,#4,3.000)",
            "#104=IFCMAPPEDITEM(#500,#501);\n#500=IFCREPRESENTATIONMAP(#6,#105);\n#501=IFCCARTESIANTRANSFORMATIONOPERATOR3D($,$,#3,1.,$)",
        ),
    )
    yield (
        "units in a circle",
        edited(
            "#1=IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.)",
            "#1=IFCCONVERSIONBASEDUNIT(#98,.LENGTHUNIT.,'x',#97);\n#98=IFCDIMENSIONALEXPONENTS(1,0,0,0,0,0,0);\n#97=IFCMEASUREWITHUNIT(IFCLENGTHMEASURE(1.),#1)",
        ),
    )
    for schema in ("IFC9", "", "IFC2X3", "IFC4X3_ADD2", "x" * 100_000):
        yield f"schema {schema[:9]}", edited("'IFC4'", f"'{schema}'")
    for number in ("1.E308", "-1.E308", "1.E400", "NAN", "1.E-300", "9" * 400, "'a'", "$", "*", ".T.", "()", "#3"):
        yield f"depth {number[:9]}", edited("#6,#4,3.000)", f"#6,#4,{number})")
        yield f"elevation {number[:9]}", edited(".ELEMENT.,0.)", f".ELEMENT.,{number})")
        yield (
            f"point {number[:9]}",
            edited("#3=IFCCARTESIANPOINT((0.,0.,0.))", f"#3=IFCCARTESIANPOINT((0.,0.,{number}))"),
        )
        yield f"width {number[:9]}", edited(",8.000,0.200)", f",{number},0.200)")
    for name in (
        "'\\X2\\D800\\X0\\'",
        "'\\X\\0A'",
        "'\\S\\'",
        "'" + "a" * 1_000_000 + "'",
        "'\\X4\\FFFFFFFF\\X0\\'",
        "'\\X2\\000A\\X0\\'",
        "'" + "''" * 5000 + "'",
        "'a\x00b'",
    ):
        yield f"name {name[:12]!r}", edited("'Ground'", name)
    storeys = "".join(
        f"#{k}=IFCBUILDINGSTOREY('{k:022}',$,'S{k}',$,$,#9,$,$,.ELEMENT.,{k / 1e6});\n" for k in range(20_000, 25_000)
    )
    yield "5,000 storeys", edited("#11=", f"{storeys}#11=")
    walls = "".join(f"#{k}=IFCWALL('{k:022}',$,'w',$,$,#9,#106,$,$);\n" for k in range(20_000, 20_300))
    yield "300 walls in one place", edited("#11=", f"{walls}#11=")
    holes = ",".join(f"#{k}" for k in range(20_000, 40_000))
    yield "a solid of nothing", edited("(#104)", f"({holes})")
    circle = "#103=IFCCIRCLEPROFILEDEF(.AREA.,$,#102,1.E9)"
    yield "a huge circle", edited("#103=IFCRECTANGLEPROFILEDEF(.AREA.,$,#102,8.000,0.200)", circle)
    for keyword in ("IFCWALL", "IFCSPACE", "IFCLOCALPLACEMENT", "IFCBUILDINGSTOREY", "IFCPROJECT", "IFCUNITASSIGNMENT"):
        for other in ("IFCBOOLEAN", "IFCREAL", "IFCROOT", "IFCNONSENSE", "IFCDOOR", "IFCCARTESIANPOINT"):
            yield f"{keyword} becomes {other}", edited(f"={keyword}(", f"={other}(")
    yield "the same number twice", edited("#12=", "#11=")
    yield "numbers beyond 64 bits", edited("#12=", f"#{'9' * 30}=")
    yield "a number of 0", edited("#12=", "#0=")
    yield "no end", replace_main(sample, text.replace("ENDSEC;", "").encode())
    yield "head alone", replace_main(sample, text[: text.index("DATA;")].encode())


def _moving_ai(sample: Sample) -> Bombs:
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


def _archive(sample: Sample) -> Bombs:
    def packed(*members: tuple[str, bytes, int], ending: str = "zip") -> Sample:
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content, mode in members:
                entry = zipfile.ZipInfo(name)
                entry.external_attr, entry.compress_type = mode << 16, zipfile.ZIP_DEFLATED
                archive.writestr(entry, content)
        return Sample({f"b.{ending}": stream.getvalue()}, f"b.{ending}")

    for name in (
        "../x.json",
        "/x.json",
        "a/../../x",
        "C:\\x",
        "..\\x",
        "\\\\host\\x",
        "a" * 999,
        "a/" * 400 + "x",
        "a/" * 499 + "x",
        "\x1b[31m.json",
        "a\nb.json",
        "é.json",
        "./a.json",
        "a//b.json",
        "...",
        "a/./b",
        " ",
        "a" * 255,
        "a" * 256,
    ):
        yield f"member {name[:20]!r} x {len(name)}", packed((name, b"{}", 0))
    for kind in (stat.S_IFLNK, stat.S_IFCHR, stat.S_IFIFO, stat.S_IFSOCK, stat.S_IFDIR, stat.S_IFBLK):
        yield f"member of kind {kind:o}", packed(("a.json", b"/etc/passwd", kind | 0o777))
    yield "a file that is a folder too", packed(("a", b"x", 0), ("a/b.json", b"{}", 0))
    yield "a folder that is a file too", packed(("a/b.json", b"{}", 0), ("a", b"x", 0))
    yield "one name twice", packed(("a.json", b"{}", 0), ("a.json", b"[]", 0))
    yield "one name in two cases", packed(("a.json", b"{}", 0), ("A.JSON", b"[]", 0))
    yield "150 MB of zeros", packed(*[(f"{k}.bin", b"\x00" * 50_000_000, 0) for k in range(3)])
    yield "250 MB of zeros", packed(*[(f"{k}.bin", b"\x00" * 50_000_000, 0) for k in range(5)])
    inner = packed(("a.json", b"{}", 0)).files["b.zip"]
    yield "an archive within", packed(("a.zip", inner, 0))
    yield "an archive within, by content", packed(("a.json", inner, 0))
    yield "100,001 members", packed(*[(f"{k}", b"", 0) for k in range(100_001)])
    yield "2,000 members", packed(*[(f"{k}.json", b"{}", 0) for k in range(2000)])
    maps = [(f"{k}.yaml", b"image: a.png", 0) for k in range(300)] + [
        (f"{k}.png", b"\x89PNG\r\n\x1a\n", 0) for k in range(300)
    ]
    yield "300 maps in one folder", packed(*maps, ("doors.yaml", b"a: 1", 0))
    yield "nothing within", packed()
    whole = sample.files[sample.main]
    place = whole.index(b"PK\x01\x02")
    for name, at, value in (
        ("says 4 GB", 24, b"\xff\xff\xff\x7f"),
        ("says 1 byte", 24, b"\x01\x00\x00\x00"),
        ("encrypted", 8, b"\x01\x00"),
        ("method 99", 10, b"\x63\x00"),
        ("offset beyond", 42, b"\xff\xff\xff\x7f"),
        ("extra beyond", 30, b"\xff\xff"),
        ("utf-8 name", 8, b"\x00\x08"),
        ("zip64", 20, b"\xff" * 8),
    ):
        yield f"an entry {name}", replace_main(sample, whole[: place + at] + value + whole[place + at + len(value) :])
    overlap = whole[:place] + whole[place:].replace(b"PK\x01\x02", b"PK\x01\x02", 1)
    yield "entries one over another", replace_main(sample, overlap + whole)
    yield "before it, other things", replace_main(sample, b"#!/bin/sh\n" * 100 + whole)
    yield "gzip of 300 MB", Sample({"a.json.gz": gzip.compress(_CHUNK * 100, 1) * 3}, "a.json.gz")
    yield "gzip within gzip", Sample({"a.gz": gzip.compress(gzip.compress(b"x"))}, "a.gz")
    yield "gzip without a name", Sample({".gz": gzip.compress(b"x")}, ".gz")
    yield "gzip by ending alone", Sample({"a.json.gz": b"hello"}, "a.json.gz")
    yield "tar", Sample({"a.tar": b"x" * 257 + b"ustar\x0000" + b"\x00" * 250}, "a.tar")
    for name, magic in (
        ("7z", b"7z\xbc\xaf'\x1c"),
        ("rar", b"Rar!\x1a\x07"),
        ("xz", b"\xfd7zXZ\x00"),
        ("zst", b"\x28\xb5\x2f\xfd"),
        ("bz2", b"BZh91AY&SY"),
    ):
        yield name, Sample({f"a.{name}": magic + b"\x00" * 100}, f"a.{name}")


def _manifest(sample: Sample) -> Bombs:
    yield "a field of 11 MB", replace_main(sample, b"id,building\n" + b"a" * 11_000_000 + b",b\n")
    yield "an open quote", replace_main(sample, b'id,building\n"' + b"a\n" * 1_000_000)
    yield "NUL", replace_main(sample, b"id,building\nc0ffee,\x00\n")
    yield "more fields than columns", replace_main(sample, b"id,building\nc0ffee,b,c,d\n")
    yield "fewer fields", replace_main(sample, b"id,building,file\nc0ffee\n")
    yield (
        "100,000 columns",
        replace_main(sample, b"id,building," + b",".join(b"c%d" % k for k in range(100_000)) + b"\nc0ffee,b\n"),
    )
    yield "50,000 lines", replace_main(sample, b"file,building\n" + b"a/b/c.json,b\n" * 50_000)
    yield "a building of two lines", replace_main(sample, b'id,building\nc0ffee,"a\nb"\n')
    yield "a long building", replace_main(sample, b"id,building\nc0ffee," + b"b" * 100_000 + b"\n")
    for place in (b"..", b".", b"/", b"a/", b"//", b"\\", b"a\x00b", b"." * 5000, b"/" * 5000):
        yield f"file {place[:9]!r}", replace_main(sample, b"file,building\n" + place + b",b\n")


_OWN = {
    "ros_map_server": _ros,
    "raster_picture": _pictures,
    "amrl_vector_maps": _amrl,
    "mlstruct": _mlstruct,
    "resplan": _resplan,
    "valetudo": _valetudo,
    "malls_geojson": _features,
    "wrld": _features,
    "indoor_geojson": _features,
    "houseexpo": _houseexpo,
    "luperto": _luperto,
    "svg": _svg,
    "dxf": _dxf,
    "ifc": _ifc,
    "moving_ai": _moving_ai,
    "imdf": _imdf,
    "plan_geojson": _plan_geojson,
    ARCHIVE: _archive,
    MANIFEST: _manifest,
}
