"""Files appear whole, with checksums that tell one flipped bit, whatever moment a run is killed at."""

import hashlib
import os
import subprocess
from pathlib import Path

import pyarrow as pa
import pytest

from pipeline import files
from pipeline.errors import TableError
from pipeline.files import check_sum, damage, replacing, sum_path, write_json, write_sum, write_table, write_text


def test_the_checksum_is_what_sha256sum_reads(tmp_path: Path) -> None:
    write_json(tmp_path / "counts.json", {"doors": 3})
    digest = hashlib.sha256(b'{\n  "doors": 3\n}\n').hexdigest()
    assert (tmp_path / "counts.json.sha256").read_text() == f"{digest}  counts.json\n"
    told = subprocess.run(["sha256sum", "-c", "counts.json.sha256"], cwd=tmp_path, capture_output=True, text=True)
    assert told.stdout == "counts.json: OK\n"


def test_texts_for_people_have_no_checksum(tmp_path: Path) -> None:
    write_text(tmp_path / "report.html", "<p>")
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]


def test_one_flipped_bit_is_named_with_the_remedy(tmp_path: Path) -> None:
    path = tmp_path / "trials.parquet"
    write_table(path, pa.table({"cost_m": [3.5, 8.25]}))
    check_sum(path, "Run it again.")
    content = bytearray(path.read_bytes())
    content[40] ^= 1
    path.write_bytes(content)
    with pytest.raises(TableError, match=r"trials.parquet is damaged: .* in trials.parquet.sha256. Run it again."):
        check_sum(path, "Run it again.")


def test_a_file_without_checksum_and_a_checksum_without_file_are_named(tmp_path: Path) -> None:
    (tmp_path / "copied.parquet").write_bytes(b"rows")
    assert "copied.parquet has no checksum copied.parquet.sha256 beside it" in str(damage(tmp_path / "copied.parquet"))
    part = tmp_path / "part"
    write_json(part / "a.json", 1)
    write_json(part / "b.json", 2)
    assert damage(part) is None
    (part / "a.json").unlink()
    assert "a.json is missing" in str(damage(part))
    (tmp_path / "empty").mkdir()
    assert damage(tmp_path / "empty") == f"{tmp_path / 'empty'} is empty"


@pytest.mark.parametrize("killed_after", range(4))
def test_a_file_replaced_by_a_killed_run_fits_its_checksum(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, killed_after: int
) -> None:
    path = tmp_path / "last.ckpt"
    with replacing(path, summed=True) as scratch:
        scratch.write_bytes(b"old")
    replace, done = os.replace, []

    def until_killed(source: Path, target: Path) -> None:
        if len(done) == killed_after:
            raise KeyboardInterrupt
        done.append(target)
        replace(source, target)

    monkeypatch.setattr(files.os, "replace", until_killed)
    try:
        with replacing(path, summed=True) as scratch:
            scratch.write_bytes(b"new")
    except KeyboardInterrupt:
        assert killed_after < 3
    assert path.read_bytes() == (b"old" if killed_after < 2 else b"new")
    assert damage(path) is None
    assert not list(tmp_path.glob("*.partial"))


def test_a_first_file_has_its_checksum_before_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names: list[str] = []
    replace = os.replace
    monkeypatch.setattr(files.os, "replace", lambda a, b: (names.append(Path(b).name), replace(a, b)))
    write_json(tmp_path / "a.json", 1)
    assert names == ["a.json.sha256", "a.json"]


def test_the_checksum_may_be_vouched_for_by_hand(tmp_path: Path) -> None:
    path = tmp_path / "x.parquet"
    path.write_bytes(b"made elsewhere")
    write_sum(path)
    assert damage(path) is None
    assert sum_path(path).name == "x.parquet.sha256"


def test_a_full_disk_names_the_file(tmp_path: Path) -> None:
    full = Path("/dev/full").open("wb", buffering=0)  # noqa: SIM115 - closed below
    with full, pytest.raises(OSError, match="No space left on device") as caught, replacing(tmp_path / "part.parquet"):
        full.write(b"rows")
    assert caught.value.filename == str(tmp_path / "part.parquet")
    assert not list(tmp_path.iterdir())
