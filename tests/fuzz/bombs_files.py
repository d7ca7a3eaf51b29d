"""Bombs for archives and manifests."""

import gzip
import io
import stat
import zipfile

from tests.fuzz.bombs_common import Bombs, replace_main
from tests.fuzz.sample import (
    Sample,
)

_CHUNK = b"\x00" * 1_000_000


def archive_bombs(sample: Sample) -> Bombs:
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
    plan = b'{"id": "a", "verts": [[0, 0], [8, 0], [8, 5], [0, 5]]}'
    for name, table in (
        ("noise", bytes(range(256)) * 100),
        ("a field of 11 MB", b"id,building\n" + b"a" * 11_000_000 + b",b\n"),
        ("120 MB", b"id,building\n" + b"a,b\n" * 30_000_000),
        ("a building of two lines", b'id,building\na,"b\nc"\n'),
    ):
        yield f"a manifest of {name}", packed(("a.json", plan, 0), ("manifest.csv", table, 0))
    yield "a manifest that is a folder", packed(("a.json", plan, 0), ("manifest.csv/b.json", plan, 0))
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


def manifest_bombs(sample: Sample) -> Bombs:
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
