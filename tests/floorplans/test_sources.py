import gzip
import stat
import struct
import tracemalloc
import zipfile

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import PlanError
from pipeline.floorplans import sources
from pipeline.floorplans.sources import SourceFile, lone_file, open_source
from tests.floorplans.archive_samples import below, changed, contents, pack, refusal

LIMITED = {"deadline": None, "max_examples": 40}


@pytest.fixture
def scratch(tmp_path, monkeypatch):
    """The folder for temporary files, two levels below one that holds nothing else."""
    folder = tmp_path / "walled" / "scratch"
    folder.mkdir(parents=True)
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    return folder


def test_a_folder_a_file_and_an_archive_are_sources(tmp_path):
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "one.map").write_bytes(b"1")
    pack(tmp_path / "a.zip", ("sub/two.map", b"2"), ("sub/", b""), ("one.map", b"3"))
    (tmp_path / "c.map.gz").write_bytes(gzip.compress(b"4"))
    assert list(contents(tmp_path).items()) == [
        ("a.zip/one.map", b"3"),
        ("a.zip/sub/two.map", b"2"),
        ("b/one.map", b"1"),
        ("c.map.gz", b"4"),
    ]
    assert contents(tmp_path / "b" / "one.map") == {"one.map": b"1"}
    assert contents(tmp_path / "a.zip") == {"a.zip/one.map": b"3", "a.zip/sub/two.map": b"2"}


def test_what_was_unpacked_goes_when_the_block_ends(tmp_path, scratch):
    path = pack(tmp_path / "a.zip", ("one.map", b"1"))
    with open_source(path) as (file,):
        assert file.path.is_file()
        assert scratch in file.path.parents
    assert not below(scratch)
    with pytest.raises(ZeroDivisionError), open_source(path):
        raise ZeroDivisionError
    assert not below(scratch)


def test_a_member_says_where_it_lies_for_a_person(tmp_path):
    path = pack(tmp_path / "maps.zip", ("gates/map.yaml", b"1"))
    with open_source(path) as (file,):
        assert (file.name, file.original) == ("maps.zip/gates/map.yaml", path / "gates" / "map.yaml")
        assert (file.path.parent.name, file.path.parents[1].name) == ("gates", "maps")
        assert file.named_anew(f"{file.path}: bad") == f"{path}/gates/map.yaml: bad"
        assert file.source_of("gates/map.yaml") == "maps.zip/gates/map.yaml"
        assert file.source_of("gates/map.yaml#3") == "maps.zip/gates/map.yaml#3"


def test_a_gzip_file_stands_for_its_content(tmp_path):
    for name, bare in (("a.map.gz", "a.map"), ("drawing.svgz", "drawing.svg"), ("odd.dat", "odd.dat")):
        path = tmp_path / name
        path.write_bytes(gzip.compress(b"1") + gzip.compress(b"2"))
        with open_source(path) as (file,):
            assert file.path.read_bytes() == b"12"
            assert (file.name, file.path.name, file.original) == (name, bare, path.with_name(bare))
            assert file.path.parent.name == tmp_path.name
            assert file.source_of(f"{tmp_path.name}/{bare}#7") == f"{name}#7"
            assert file.named_anew(f"{file.path}: bad") == f"{path}: bad"


def test_a_file_on_disk_is_named_as_it_is(tmp_path):
    file = lone_file(tmp_path / "a.map")
    assert file == SourceFile(path=tmp_path / "a.map", name="a.map", original=tmp_path / "a.map")
    assert (file.source_of("dao/a.map"), file.named_anew("bad")) == ("dao/a.map", "bad")


def test_an_absent_source_is_refused(tmp_path):
    with (
        pytest.raises(PlanError, match=r"plans.root = .*nowhere: no such folder or file"),
        open_source(tmp_path / "nowhere"),
    ):
        pass


@pytest.mark.parametrize(
    "name",
    [
        "../escaped.map",
        "../../escaped.map",
        "a/../../../escaped.map",
        "a/..",
        "/escaped.map",
        "//escaped.map",
        "..\\escaped.map",
        "a\\..\\..\\escaped.map",
        "\\escaped.map",
        "C:\\escaped.map",
        "C:escaped.map",
        ".",
        "n" * 5000,
    ],
)
def test_a_name_that_leads_out_is_refused_before_anything_is_written(tmp_path, scratch, name):
    path = pack(tmp_path / "in" / "a.zip", ("first.map", b"1"), (name, b"2"))
    assert "a name that leads out of the archive. It is not unpacked." in refusal(path)
    assert below(tmp_path) == {"in", "in/a.zip", "walled", "walled/scratch"}


@settings(**LIMITED)
@given(st.lists(st.sampled_from(["..", ".", "a", "b.map", "\\", "/", ":", "~", "\u00e4", "%2e%2e"]), max_size=8))
def test_no_name_leads_out(tmp_path_factory, parts):
    root = tmp_path_factory.mktemp("names")
    path = pack(root / "in" / "a.zip", (f"x{''.join(parts)}", b"1"), (f"{''.join(parts)}y", b"2"))
    with open_source(path.parent) as files:
        for file in files:
            assert file.path == path or file.unpacked[0] in file.path.resolve().parents
    assert below(root) == {"in", "in/a.zip"}


def test_a_member_without_a_name_is_refused(tmp_path):
    path = changed(pack(tmp_path / "a.zip", ("Q", b"1")), b"Q", b"\0")
    assert "holds '', a name that leads out of the archive" in refusal(path)


def test_an_absolute_name_does_not_overwrite(tmp_path):
    victim = tmp_path / "victim.map"
    victim.write_bytes(b"mine")
    assert "leads out" in refusal(pack(tmp_path / "in" / "a.zip", (str(victim), b"yours")))
    assert victim.read_bytes() == b"mine"


@pytest.mark.parametrize("kind", [stat.S_IFLNK, stat.S_IFIFO, stat.S_IFCHR, stat.S_IFBLK, stat.S_IFSOCK, stat.S_IFDIR])
def test_links_and_devices_are_refused(tmp_path, scratch, kind):
    entry = zipfile.ZipInfo("link.map")
    entry.create_system, entry.external_attr = 3, (kind | 0o777) << 16
    path = pack(tmp_path / "in" / "a.zip", (entry, b"/etc/hostname"), ("link.map/under.map", b"2"))
    assert "link.map is a link or a device, not a file." in refusal(path)
    assert not below(scratch)


def test_encrypted_members_are_refused(tmp_path):
    path = pack(tmp_path / "a.zip", ("one.map", b"1"))
    with zipfile.ZipFile(path) as archive:
        at = archive.start_dir
    content = bytearray(path.read_bytes())
    content[6] |= 1
    content[at + 8] |= 1
    path.write_bytes(content)
    assert "one.map is encrypted. Unpack it with its password" in refusal(path)


def test_two_members_of_one_name_are_refused(tmp_path):
    with pytest.warns(UserWarning, match="Duplicate"):
        path = pack(tmp_path / "a.zip", ("one.map", b"1"), ("one.map", b"2"))
    assert "holds two files named one.map" in refusal(path)


@pytest.mark.parametrize(
    ("names", "why"),
    [
        (("a", "a/b.map"), "not a readable archive (File exists). Get the file again."),
        (("a/b.map", "a"), "not a readable archive (File exists). Get the file again."),
        (("a//b.map", "a/b.map"), "holds two files named a/b.map. Pack it again."),
        (("./a", "a"), "holds two files named a. Pack it again."),
        (("n" * 400,), "not a readable archive (File name too long). Get the file again."),
    ],
)
def test_names_that_clash_on_disk_give_one_error(tmp_path, names, why):
    path = pack(tmp_path / "a.zip", *((name, b"1") for name in names))
    assert refusal(path) == f"{path}: {why}"


def test_a_bomb_is_refused_by_its_index_before_a_byte_is_written(tmp_path, scratch):
    path = pack(tmp_path / "in" / "a.zip", ("one.map", b"1"), ("zeros.map", bytes(1_000_000)))
    assert path.stat().st_size < 2000
    assert "unpacks to 1,000,001 bytes; at most 1,000,000 are unpacked in all." in refusal(path, most_bytes=1_000_000)
    assert not below(scratch)
    assert len(contents(path, most_bytes=1_000_001)) == 2


def test_the_limit_is_for_all_archives_together(tmp_path):
    for name in "abc":
        pack(tmp_path / f"{name}.zip", (f"{name}.map", bytes(400)))
    (tmp_path / "d.map.gz").write_bytes(gzip.compress(bytes(200)))
    with open_source(tmp_path, most_bytes=1000) as files:
        assert {file.name: file.problem is None for file in files} == {
            "a.zip/a.map": True,
            "b.zip/b.map": True,
            "c.zip": False,
            "d.map.gz": True,
        }


def test_an_index_that_understates_a_size_gets_no_more_than_it_says(tmp_path):
    path = pack(tmp_path / "a.zip", ("zeros.map", bytes(1_000_000)))
    changed(path, struct.pack("<I", 1_000_000), struct.pack("<I", 300))
    assert refusal(path, most_bytes=1000)


def test_a_gzip_bomb_stops_at_the_limit(tmp_path, scratch, monkeypatch):
    monkeypatch.setattr(sources, "_CHUNK", 1000)
    path = tmp_path / "in" / "a.map.gz"
    path.parent.mkdir()
    path.write_bytes(gzip.compress(bytes(10_000_000)))
    tracemalloc.start()
    try:
        assert "unpacks to more bytes than it says, or than the 5,000 that are unpacked in all" in refusal(
            path, most_bytes=5000
        )
        assert tracemalloc.get_traced_memory()[1] < 2_000_000
    finally:
        tracemalloc.stop()
    assert not below(scratch)


def test_more_files_than_allowed_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(sources, "MOST_MEMBERS", 20)
    members = [(f"{number}.map", b"1") for number in range(21)]
    assert "holds 21 files, at most 20 are read." in refusal(pack(tmp_path / "a.zip", *members))
    assert len(contents(pack(tmp_path / "a.zip", *members[1:]))) == 20


def _plain(content: bytes, end: int) -> bytes:
    return content


def _offset_like_an_end(content: bytes, end: int) -> bytes:
    """The offset of the index, which may be anything where bytes stand before the archive, reads as another end."""
    return content[: end + 16] + b"PK\5\6" + content[end + 20 :]


def _long_form(content: bytes, end: int) -> bytes:
    """The size stands in the long form of the end (zip64), and the short one says 0."""
    count, size, offset = (
        struct.unpack("<H2xII", content[end + 8 : end + 20])[0],
        *struct.unpack("<II", content[end + 12 : end + 20]),
    )
    long_end = struct.pack("<4sQHHIIQQQQ", b"PK\6\6", 44, 45, 45, 0, 0, count, count, size, offset)
    locator = struct.pack("<4sIQI", b"PK\6\7", 0, end, 1)
    return content[:end] + long_end + locator + content[end : end + 12] + bytes(4) + content[end + 16 :]


@pytest.mark.parametrize("change", [_plain, _offset_like_an_end, _long_form])
def test_a_long_index_is_refused_before_it_is_read(tmp_path, monkeypatch, change):
    path = pack(tmp_path / "a.zip", *((f"{number}.map", b"1") for number in range(20)))
    content = path.read_bytes()
    path.write_bytes(change(content, content.rindex(b"PK\5\6")))
    with zipfile.ZipFile(path) as archive:
        assert len(archive.infolist()) == 20  # it would be read
    monkeypatch.setattr(sources, "_LARGEST_INDEX", 500)
    monkeypatch.setattr(zipfile, "ZipFile", None)
    assert "lists far too many files" in refusal(path)


def test_the_litter_of_systems_and_hidden_files_are_left_out(tmp_path):
    litter = ("__MACOSX/._one.map", "sub/.DS_Store", ".git/config", "sub/__MACOSX/a.map")
    pack(tmp_path / "a.zip", ("one.map", b"1"), *((name, b"x") for name in litter))
    for name in (".hidden.map", "__MACOSX/one.map", ".git/config"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"x")
    assert contents(tmp_path) == {"a.zip/one.map": b"1"}


def test_an_archive_within_an_archive_stays_closed(tmp_path):
    inner = pack(tmp_path / "inner" / "b.zip", ("deep.map", b"1")).read_bytes()
    path = pack(tmp_path / "outer" / "a.zip", ("b.zip", inner), ("c.map.gz", gzip.compress(b"2")), ("d.map", b"3"))
    with open_source(path) as files:
        problems = {file.name: file.problem and str(file.problem) for file in files}
    assert problems.pop("a.zip/d.map") is None
    for name, problem in problems.items():
        shown = path.parent / name
        expected = "holds an archive within an archive, which is not read. Unpack the outer one first."
        assert problem == f"{shown}: {expected}"
    assert len(problems) == 2


def test_a_gzipped_archive_stays_closed(tmp_path):
    path = tmp_path / "in" / "a.gz"
    inner = pack(tmp_path / "b.zip", ("deep.map", b"1")).read_bytes()
    path.parent.mkdir()
    path.write_bytes(gzip.compress(inner))
    with open_source(path) as (file,):
        assert "holds an archive within an archive" in str(file.problem)
