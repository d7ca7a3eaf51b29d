import pickle
import struct
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import PlanError
from pipeline.floorplans.readers import npz
from pipeline.floorplans.readers.npz import holds_layer, load_layers


def npy(header: str, body: bytes = b"", version: tuple[int, int] = (1, 0)) -> bytes:
    return (
        b"\x93NUMPY"
        + bytes(version)
        + struct.pack("<H" if version[0] == 1 else "<I", len(header))
        + header.encode()
        + body
    )


def write(path: Path, **members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return path


def announcing(shape: str, kind: str = "|u1") -> str:
    return f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}"


def test_layers_come_back_as_they_were(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", one=np.arange(6).reshape(2, 3), two=np.array(["door"]), three=np.float32(2))
    layers = load_layers(tmp_path / "a.npz", ["one", "two"])
    assert layers["one"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert layers["two"].tolist() == ["door"]
    assert set(layers) == {"one", "two"}


def test_missing_layers_are_named_with_what_is_there(tmp_path):
    np.savez(tmp_path / "a.npz", one=np.zeros(2))
    with pytest.raises(PlanError, match=r"a.npz: layers two, three are missing, found one"):
        load_layers(tmp_path / "a.npz", ["one", "two", "three"])
    with pytest.raises(PlanError, match="found nothing"):
        load_layers(write(tmp_path / "b.npz"), ["one"])


class Loaded:
    """Would write a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self):
        return (Path.write_text, (self.path, "it ran"))


@pytest.mark.parametrize("form", ["array of objects", "bare pickle", "pickle as a member"])
def test_nothing_is_ever_unpickled(tmp_path, form):
    path, trace = tmp_path / "a.npz", tmp_path / "trace"
    if form == "array of objects":
        np.savez(path, one=np.array([Loaded(trace)], dtype=object))
    elif form == "bare pickle":
        path.write_bytes(pickle.dumps(Loaded(trace)))
    else:
        write(path, one=pickle.dumps(Loaded(trace)))
    with pytest.raises(PlanError, match=r"a.npz: (holds pickled objects, which can run code|damaged npz)"):
        load_layers(path, ["one"])
    assert not trace.exists()


@pytest.mark.parametrize("shape", ["(999999, 999999)", "(4294967296, 4294967297)", "(99999999999,)", "(-1, -8)"])
@pytest.mark.parametrize("version", [(1, 0), (2, 0)])
def test_a_header_that_announces_more_than_is_stored_takes_no_memory(tmp_path, shape, version):
    path = write(tmp_path / "a.npz", one=npy(announcing(shape), b"\0" * 64, version))
    tracemalloc.start()
    try:
        with pytest.raises(PlanError, match=r"a.npz: damaged npz \(one announces"):
            load_layers(path, ["one"])
        assert tracemalloc.get_traced_memory()[1] < 5_000_000
    finally:
        tracemalloc.stop()


def test_a_bomb_of_zeros_is_refused_by_its_index(tmp_path, monkeypatch):
    monkeypatch.setattr(npz, "MOST_BYTES", 100_000)
    path = write(tmp_path / "a.npz", one=npy(announcing("(200000,)"), b"\0" * 200_000))
    assert path.stat().st_size < 2000
    with pytest.raises(PlanError, match=r"a.npz: unpacks to 200,\d+ bytes, at most 100,000 are read"):
        load_layers(path, ["one"])


def test_an_index_that_lies_about_sizes_is_refused(tmp_path):
    path = write(tmp_path / "a.npz", one=npy(announcing("(200000,)"), b"\0" * 200_000))
    whole = bytearray(path.read_bytes())
    entry = whole.index(b"PK\1\2")
    whole[entry + 24 : entry + 28] = struct.pack("<I", 300)
    path.write_bytes(bytes(whole))
    with pytest.raises(PlanError, match=r"a.npz: not a readable npz \(Bad CRC-32"):
        load_layers(path, ["one"])


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"PK",
        b"not a zip file",
        npy("(" * 5000 + ")" * 5000),
        npy("__import__('os').system('false')"),
        npy(announcing("(2,)", "|O")),
        npy(announcing("(2,)"), version=(9, 9)),
    ],
    ids=lambda content: repr(content[:24]),
)
def test_damaged_files_give_one_error(tmp_path, content):
    bare = tmp_path / "bare.npz"
    bare.write_bytes(content)
    for path in (bare, write(tmp_path / "member.npz", one=content), tmp_path / "missing.npz", tmp_path):
        with pytest.raises(PlanError) as refusal:
            load_layers(path, ["one"])
        assert str(refusal.value).startswith(f"{path}: ")


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99])
def test_a_cut_file_gives_one_error(tmp_path, share):
    path = tmp_path / "a.npz"
    np.savez_compressed(path, one=np.random.default_rng(0).integers(0, 9, (40, 40)))
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * share)])
    assert not holds_layer(path, "one")
    with pytest.raises(PlanError, match=r"a.npz: not a readable npz"):
        load_layers(path, ["one"])


def test_looking_for_a_layer_never_raises(tmp_path):
    np.savez(tmp_path / "a.npz", one=np.zeros(2))
    assert holds_layer(tmp_path / "a.npz", "one")
    assert not holds_layer(tmp_path / "a.npz", "two")
    assert not holds_layer(tmp_path / "missing", "one")
    assert not holds_layer(tmp_path, "one")
    assert not holds_layer(Path("a\0b"), "one")
