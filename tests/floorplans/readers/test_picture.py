import struct
import tracemalloc
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.errors import PlanError
from pipeline.floorplans.readers.picture import FORMATS, looks_like_a_picture, read_picture, write_picture

L = np.array([[255, 0, 0], [255, 255, 128]], dtype=np.uint8)  # row 0 is the top


def png(width: int, height: int, body: bytes = b"") -> bytes:
    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(body)) + chunk(b"IEND", b"")


@pytest.mark.parametrize("name", ["a.png", "a.pgm", "a.bmp", "a.gif", "a.tif"])
def test_grey_pictures_come_back_as_they_were(tmp_path, name):
    Image.fromarray(L).save(tmp_path / name)
    grey = read_picture(tmp_path / name)
    assert grey.values.tolist() == L.tolist()
    assert not grey.transparent.any()


def test_the_content_counts_not_the_ending(tmp_path):
    Image.fromarray(L).save(tmp_path / "a.txt", format="PNG")
    assert read_picture(tmp_path / "a.txt").values.tolist() == L.tolist()


@pytest.mark.parametrize("mode", ["1", "P", "RGB", "RGBA", "LA", "CMYK"])
def test_every_mode_gives_black_and_white(tmp_path, mode):
    name = "a.jpg" if mode == "CMYK" else "a.png"
    Image.fromarray(np.kron(L[:, :2], np.ones((16, 16), np.uint8))).convert(mode).save(tmp_path / name)
    grey = read_picture(tmp_path / name)
    assert grey.values[::16, ::16] == pytest.approx(L[:, :2].astype(float), abs=2)
    assert not grey.transparent.any()


def test_colours_are_averaged_and_transparent_pixels_told(tmp_path):
    pixels = np.array([[[255, 0, 0, 255], [255, 255, 255, 0], [0, 0, 0, 254]]], dtype=np.uint8)
    Image.fromarray(pixels).save(tmp_path / "a.png")
    grey = read_picture(tmp_path / "a.png")
    assert grey.values.tolist() == [[85, 255, 0]]
    assert grey.transparent.tolist() == [[False, True, True]]


def test_a_palette_may_have_a_transparent_colour(tmp_path):
    picture = Image.fromarray(np.array([[0, 1]], dtype=np.uint8), mode="P")
    picture.putpalette([255, 255, 255, 0, 0, 0])
    picture.save(tmp_path / "a.gif", transparency=0)
    assert read_picture(tmp_path / "a.gif").transparent.tolist() == [[True, False]]


@pytest.mark.parametrize("name", ["a.png", "a.pgm", "a.tif"])
@pytest.mark.parametrize("values", [[0, 32768, 65535], [0, 1, 200]])
def test_sixteen_bits_are_scaled_however_dark_the_picture(tmp_path, name, values):
    Image.fromarray(np.array([values], dtype=np.uint16)).save(tmp_path / name)
    assert read_picture(tmp_path / name).values[0] == pytest.approx(np.array(values) / 257)


def test_a_portable_map_may_have_any_depth_and_comments(tmp_path):
    (tmp_path / "a.pgm").write_bytes(b"P2\n# CREATOR: map_saver\n3 1\n100\n0 50 100\n")
    assert read_picture(tmp_path / "a.pgm").values[0] == pytest.approx([0, 127.5, 255], abs=1)


def test_pixels_that_are_no_whole_numbers_are_refused(tmp_path):
    (tmp_path / "a.pfm").write_bytes(b"Pf\n2 1\n-1.0\n" + struct.pack("<2f", 0.0, 1.0))
    with pytest.raises(PlanError, match=r"a.pfm: not a readable picture \(its pixels are not whole numbers\)"):
        read_picture(tmp_path / "a.pfm")


@pytest.mark.parametrize(
    ("orientation", "turned"),
    [(1, lambda a: a), (2, np.fliplr), (3, lambda a: a[::-1, ::-1]), (6, lambda a: np.rot90(a, -1))],
)
def test_a_photograph_is_read_as_it_is_shown(tmp_path, orientation, turned):
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(np.kron(L, np.ones((16, 16), np.uint8))).save(tmp_path / "a.jpg", exif=exif, quality=95)
    assert read_picture(tmp_path / "a.jpg").values[8::16, 8::16] == pytest.approx(turned(L.astype(float)), abs=6)


@pytest.mark.parametrize(
    "content", [png(10_000, 10_000), png(40_000, 40_000), b"P5 99999 99999 255\n", b"P4 9999999 999 "]
)
def test_a_header_of_many_megapixels_is_refused_without_decoding(tmp_path, content):
    (tmp_path / "a.png").write_bytes(content + b"\0" * 1000)
    tracemalloc.start()
    try:
        with pytest.raises(PlanError, match=r"a.png: (\d+ x \d+|far too many) pixels, at most 36,000,000 are read"):
            read_picture(tmp_path / "a.png")
        assert tracemalloc.get_traced_memory()[1] < 2_000_000
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("name", ["a.png", "a.pgm", "a.jpg", "a.bmp", "a.gif", "a.tif"])
@pytest.mark.parametrize("share", [0.02, 0.5, 0.9])
def test_a_cut_picture_is_refused(tmp_path, name, share):
    path = tmp_path / name
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (80, 80)).astype(np.uint8)).save(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * share)])
    with pytest.raises(PlanError, match=f"{name}: not a readable picture"):
        read_picture(path)


@pytest.mark.parametrize(
    "content", [b"", b"hello", b"II*\0" + b"\0" * 100, b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n"]
)
def test_what_is_no_picture_of_these_formats_is_refused(tmp_path, content):
    (tmp_path / "a.png").write_bytes(content)
    assert not looks_like_a_picture(tmp_path / "a.png")
    expected = r"a.png: not a readable picture .*expected a whole PNG, PGM, JPEG, BMP, GIF or TIFF"
    with pytest.raises(PlanError, match=expected):
        read_picture(tmp_path / "a.png")


@pytest.mark.parametrize("compression", ["raw", "tiff_lzw", "tiff_adobe_deflate", "packbits"])
def test_a_scan_as_tiff_is_read_as_it_is(tmp_path, compression):
    grey = np.random.default_rng(0).integers(0, 255, (60, 80)).astype(np.uint8)
    Image.fromarray(grey).save(tmp_path / "a.tif", compression=compression)
    assert looks_like_a_picture(tmp_path / "a.tif")
    assert np.array_equal(read_picture(tmp_path / "a.tif").values, grey)


def test_missing_files_and_folders_are_refused(tmp_path):
    for path in (tmp_path / "missing.png", tmp_path):
        assert not looks_like_a_picture(path)
        with pytest.raises(PlanError, match="not a readable picture"):
            read_picture(path)


def test_a_look_does_not_mind_the_size(tmp_path):
    (tmp_path / "a.png").write_bytes(png(40_000, 40_000))
    assert looks_like_a_picture(tmp_path / "a.png")
    assert "EPS" not in FORMATS  # Pillow would start another program for it


@pytest.mark.parametrize("notes", [None, {"hinterland": '{"a": 1}', "Title": "\u00fc"}])
def test_writing_and_reading_keeps_pixels_and_notes(tmp_path, notes):
    path = tmp_path / "a"
    write_picture(path, L, notes)
    grey = read_picture(path)
    assert grey.values.tolist() == L.tolist()
    assert dict(grey.notes) == (notes or {})
    assert path.read_bytes()[:2] == (b"P5" if notes is None else b"\x89P")


def test_notes_behind_the_pixels_are_found(tmp_path):
    text = b"tEXt" + b"hinterland\0{}"
    chunk = struct.pack(">I", len(text) - 4) + text + struct.pack(">I", zlib.crc32(text))
    end = b"\0\0\0\0IEND"
    Image.fromarray(L).save(tmp_path / "a.png")
    whole = (tmp_path / "a.png").read_bytes()
    Path(tmp_path / "b.png").write_bytes(whole.replace(end, chunk + end))
    assert read_picture(tmp_path / "b.png").notes == {"hinterland": "{}"}
