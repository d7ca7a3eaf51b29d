import bz2
import gzip
import io
import lzma
import tarfile
import zipfile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.floorplans.sources import is_archive, open_source
from tests.floorplans.archive_samples import contents, pack, refusal

LIMITED = {"deadline": None, "max_examples": 40}


def _tar() -> bytes:
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w") as archive:
        archive.addfile(tarfile.TarInfo("one.map"))
    return stream.getvalue()


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (_tar(), "tar"),
        (bz2.compress(b"1" * 100), "bzip2"),
        (lzma.compress(b"1"), "xz"),
        (b"7z\xbc\xaf\x27\x1c" + bytes(20), "7z"),
        (b"Rar!\x1a\x07\x00" + bytes(20), "rar"),
        (b"\x28\xb5\x2f\xfd" + bytes(20), "zstd"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_other_archives_are_named_and_refused(tmp_path, content, kind):
    path = tmp_path / "a.dat"
    path.write_bytes(content)
    assert f"a {kind} archive, which is not read. Unpack it and give the folder." in refusal(path)


def _whole_zip() -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("one.map", np.random.default_rng(0).bytes(300))
        archive.writestr("two.map", b"2" * 300)
    return stream.getvalue()


WHOLE = _whole_zip()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.zip", b""),
        ("a.zip", b"PK"),
        ("a.zip", b"no zip file"),
        ("a.zip", WHOLE[:-30]),
        ("a.zip", WHOLE[:100] + WHOLE[130:]),
        ("a.gz", b""),
        ("a.gz", b"no gzip file"),
        ("a.gz", gzip.compress(b"1" * 1000)[:-9]),
        ("a.gz", gzip.compress(b"1" * 1000)[:-8] + bytes(8)),
        ("a.gz", b"\x1f\x8b\x08"),
    ],
    ids=lambda value: str(len(value)) if isinstance(value, bytes) else value,  # contents hold times
)
def test_a_damaged_archive_gives_one_clear_error(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    assert "not a readable archive (" in refusal(tmp_path / name)


@settings(**LIMITED)
@given(st.integers(0, len(WHOLE) - 1), st.binary(min_size=1, max_size=6))
def test_any_damage_gives_an_error_or_files_within_the_limit(tmp_path_factory, at, noise):
    path = tmp_path_factory.mktemp("damaged") / "a.zip"
    path.write_bytes(WHOLE[:at] + noise + WHOLE[at + len(noise) :])
    with open_source(path.parent, most_bytes=700) as files:
        assert sum(file.path.stat().st_size for file in files if file.path != path) <= 700


def test_an_npz_stays_as_it_is_under_any_name(tmp_path):
    np.savez(tmp_path / "a.npz", one=np.zeros(2))
    content = (tmp_path / "a.npz").read_bytes()
    for name in ("b.zip", "c.dat"):
        (tmp_path / name).write_bytes(content)
    assert set(contents(tmp_path)) == {"a.npz", "b.zip", "c.dat"}
    assert not is_archive(tmp_path / "b.zip")


def test_what_is_no_archive_is_not_taken_for_one(tmp_path):
    for name, content in {"a.map": b"type octile", "b.txt": b"PK and more text", "c.txt": b"BZh is a word"}.items():
        (tmp_path / name).write_bytes(content)
        assert not is_archive(tmp_path / name)
    assert is_archive(pack(tmp_path / "d.dat", ("one.map", b"1")))
    assert not is_archive(tmp_path / "missing.dat")
