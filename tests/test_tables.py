"""One kind of table for all: stamped, checked when read, converted from an earlier version, digested by content."""

from pathlib import Path
from typing import NamedTuple

import pyarrow as pa
import pytest

from pipeline.errors import TableError
from pipeline.files import write_sum, write_table
from pipeline.tables import Table, column, digest_of


class Walk(NamedTuple):
    name: str
    length_m: float


WALKS = Table("walks", 2, [column("name", pa.string()), column("length_m", pa.float64(), unit="m")], stage="harvest")
# Version 1 had centimetres.
OLD = Table("walks", 1, [column("name", pa.string()), column("length_cm", pa.float64(), unit="cm")], stage="harvest")


def to_metres(table: pa.Table) -> pa.Table:
    metres = pa.array([value / 100.0 for value in table["length_cm"].to_pylist()])
    return pa.table({"name": table["name"], "length_m": metres})


CONVERTING = Table(
    "walks", 2, [column("name", pa.string()), column("length_m", pa.float64(), unit="m")], stage="harvest",
    earlier={1: to_metres},
)  # fmt: skip
ROWS = [Walk("a", 2.5), Walk("b", 0.0)]


def test_what_was_written_is_read(tmp_path: Path) -> None:
    WALKS.write(tmp_path / "walks.parquet", WALKS.stack(ROWS))
    found = WALKS.read(tmp_path / "walks.parquet")
    assert found.to_pylist() == [row._asdict() for row in ROWS]
    assert found.schema.field("length_m").metadata == {b"unit": b"m"}


def test_an_earlier_version_is_converted_or_refused_with_the_stage_to_run(tmp_path: Path) -> None:
    path = tmp_path / "walks.parquet"
    OLD.write(path, OLD.stack([("a", 250.0), ("b", 0.0)]))
    found = CONVERTING.read(path)
    assert digest_of(found) == digest_of(WALKS.stack(ROWS))
    with pytest.raises(TableError, match=r"holds table 'walks' version 1, this code reads .* version 2\. Run"):
        WALKS.read(path)
    WALKS.write(path, WALKS.stack(ROWS))
    with pytest.raises(TableError, match="version 2, this code reads table 'walks' version 1"):
        OLD.read(path)


def test_another_table_and_none_at_all_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.parquet"
    with pytest.raises(TableError, match=r"x.parquet: no such file. Run `dvc repro harvest`"):
        WALKS.read(path)
    write_table(path, pa.table({"name": ["a"], "length_m": [1.0]}))
    with pytest.raises(TableError, match="a table without a stamp"):
        CONVERTING.read(path)
    path.write_bytes(b"PAR1 no")
    with pytest.raises(TableError, match=r"x\.parquet is damaged"):
        WALKS.read(path)
    write_sum(path)
    with pytest.raises(TableError, match="not a readable parquet file"):
        WALKS.read(path)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"name": ["a"]}, r"got the columns \['name'\], expected \['length_m', 'name'\]"),
        ({"name": ["a"], "length_m": ["far"]}, "does not have the type of its schema"),
        ({"name": [None], "length_m": [1.0]}, "column 'name' holds a null"),
    ],
)
def test_columns_that_do_not_fit_are_refused(columns: dict[str, list[object]], message: str) -> None:
    with pytest.raises(TableError, match=message):
        WALKS.of(columns)


def test_shards_come_in_order_and_a_damaged_one_is_named(tmp_path: Path) -> None:
    for index, row in enumerate(ROWS):
        WALKS.write(tmp_path / f"part-{index:06d}.parquet", WALKS.stack([row, row]))
    found = [name for table in WALKS.blocks(tmp_path, columns=["name"], rows_at_once=1) for name in table["name"]]
    assert [str(name) for name in found] == ["a", "a", "b", "b"]
    (tmp_path / "part-000001.parquet").write_bytes(b"torn")
    with pytest.raises(TableError, match=r"part-000001.parquet is damaged.*dvc repro -f harvest"):
        list(WALKS.blocks(tmp_path))
    with pytest.raises(TableError, match="holds no walks"):
        next(WALKS.blocks(tmp_path / "nowhere"))


def test_the_digest_is_of_the_content_alone() -> None:
    whole = WALKS.stack(ROWS)
    chunks = pa.concat_tables([whole.slice(0, 1), whole.slice(1)])
    assert digest_of(chunks) == digest_of(whole)
    assert digest_of(whole, without=["length_m"]) == digest_of(
        WALKS.stack([Walk("a", 9.0), ROWS[1]]), without=["length_m"]
    )
    assert digest_of(whole) != digest_of(WALKS.stack(ROWS[::-1]))
