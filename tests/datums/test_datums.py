import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from pipeline.datums import datum_schema, digest, read_datums, shard_path, stack, summarise, write_shard
from pipeline.datums.reader import beams_in
from pipeline.datums.schema import METADATA_KEY, Datum
from pipeline.datums.writer import to_table
from pipeline.errors import TableError
from pipeline.files import write_sum
from tests.datums.rows import make_datum, make_datums


@pytest.mark.parametrize("map_view", [False, True])
def test_what_is_written_is_read(tmp_path: Path, map_view: bool) -> None:
    datums = make_datums(7, map_view=map_view)
    write_shard(shard_path(tmp_path, 0), stack(datums[:4]))
    write_shard(shard_path(tmp_path, 1), stack(datums[4:]))
    expected, found = stack(datums), read_datums(tmp_path)
    for name in expected._fields:
        written, read = getattr(expected, name), getattr(found, name)
        assert written.dtype == read.dtype, name
        if name in ("ranges", "map_view"):
            assert written.shape == read.shape
            assert np.abs(written - read).max(initial=0.0) <= 0.00051  # rounded to 1 mm
        elif written.dtype.kind == "f":
            assert np.array_equal(written, read, equal_nan=True), name
        else:
            assert np.array_equal(written, read), name


def test_labels_are_null_exactly_where_they_do_not_apply() -> None:
    table = to_table(stack(make_datums(9)))
    leads = table["leads_to_goal"].to_numpy()
    assert np.array_equal(table["delta_success_m"].is_null().to_numpy(), ~leads)
    assert np.array_equal(table["exploration_m"].is_null().to_numpy(), leads)


def test_every_number_has_a_unit_and_every_place_a_frame() -> None:
    for field in datum_schema(256):
        assert set(field.metadata) == {b"unit", b"frame"}
        if field.name.endswith("_m"):
            assert field.metadata[b"unit"] == b"m"
    assert datum_schema(256).field("subgoal_x_m").metadata[b"frame"] == b"robot"
    assert datum_schema(256).field("pose_x_m").metadata[b"frame"] == b"world"


def test_only_the_asked_splits_come_back(tmp_path: Path) -> None:
    write_shard(shard_path(tmp_path, 0), stack(make_datums(5)))
    write_shard(shard_path(tmp_path, 1), stack(make_datums(3, split="validation")))
    assert len(read_datums(tmp_path, ["validation"]).pair_id) == 3
    assert len(read_datums(tmp_path, ["test"]).pair_id) == 0
    assert read_datums(tmp_path, ["test"]).ranges.shape == (0, 256)


def test_a_shard_may_be_empty(tmp_path: Path) -> None:
    write_shard(shard_path(tmp_path, 0), stack([]))
    write_shard(shard_path(tmp_path, 1), stack(make_datums(2)))
    assert len(read_datums(tmp_path).pair_id) == 2


def test_the_digest_sees_content_not_encoding_or_sharding(tmp_path: Path) -> None:
    rows = make_datums(6)
    one, two, other = tmp_path / "one", tmp_path / "two", tmp_path / "other"
    write_shard(shard_path(one, 0), stack(rows))
    two.mkdir()
    for index, part in enumerate((rows[:1], rows[1:])):
        pq.write_table(to_table(stack(part)), shard_path(two, index), compression="snappy", row_group_size=2)
        write_sum(shard_path(two, index))
    assert digest(one) == digest(two)
    write_shard(shard_path(other, 0), stack([*rows[:-1], rows[-1]._replace(weight_m=0.5)]))
    assert digest(other) != digest(one)
    write_shard(shard_path(other, 0), stack(rows[::-1]))
    assert digest(other) != digest(one)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"weight_m": float("nan")}, "weight_m holds values that are not finite"),
        ({"exploration_m": None}, "exploration_m must be a number exactly where"),
        ({"delta_success_m": 1.0}, "delta_success_m must be a number exactly where"),
        ({"exploration_m": float("inf")}, "exploration_m must be a number exactly where"),
        ({"pose_x_m": float("inf")}, "pose_x_m holds values that are not finite"),
    ],
)
def test_rows_that_contradict_themselves_are_not_written(
    tmp_path: Path, change: dict[str, float | None], message: str
) -> None:
    path = shard_path(tmp_path, 0)
    with pytest.raises(ValueError, match=message):
        write_shard(path, stack([make_datum(1, leads=False)._replace(**change)]))
    assert not list(tmp_path.iterdir())


def test_a_wrong_shape_is_named(tmp_path: Path) -> None:
    rows = stack(make_datums(3))
    with pytest.raises(ValueError, match=r"ranges has shape \(2, 256\), expected \(3, 256\)"):
        write_shard(shard_path(tmp_path, 0), rows._replace(ranges=rows.ranges[:2]))


def with_beams(beams: int, count: int) -> list[Datum]:
    return [datum._replace(ranges=datum.ranges[:beams]) for datum in make_datums(count)]


@pytest.mark.parametrize("beams", [64, 72, 128])
def test_a_table_has_scans_of_any_one_length(tmp_path: Path, beams: int) -> None:
    write_shard(shard_path(tmp_path, 0), stack([], beams=beams))
    write_shard(shard_path(tmp_path, 1), stack(with_beams(beams, 3)))
    found = read_datums(tmp_path)
    assert beams_in(tmp_path) == beams and found.ranges.shape == (3, beams)
    assert np.abs(found.ranges - stack(with_beams(beams, 3)).ranges).max() <= 0.00051
    assert read_datums(tmp_path, ["test"]).ranges.shape == (0, beams)
    assert json.loads(pq.read_schema(shard_path(tmp_path, 0)).metadata[METADATA_KEY])["beams"] == beams


def test_scans_of_two_lengths_are_named(tmp_path: Path) -> None:
    write_shard(shard_path(tmp_path, 0), stack(make_datums(2)))
    write_shard(shard_path(tmp_path, 1), stack(with_beams(128, 2)))
    with pytest.raises(TableError, match=r"part-000001.parquet holds scans of 128 ranges, the shards before it of 256"):
        read_datums(tmp_path)


def _other_length(path: Path) -> None:
    marks = {METADATA_KEY: json.dumps({"table": "datums", "version": 3, "beams": 64}).encode()}
    pq.write_table(pq.read_table(path).replace_schema_metadata(marks), path)


def _no_length(path: Path) -> None:
    marks = {METADATA_KEY: json.dumps({"table": "datums", "version": 3}).encode()}
    pq.write_table(pq.read_table(path).replace_schema_metadata(marks), path)


def _cut_short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:500])


def _older_version(path: Path) -> None:
    marks = {METADATA_KEY: json.dumps({"table": "datums", "version": 0}).encode()}
    pq.write_table(pq.read_table(path).replace_schema_metadata(marks), path)


def _foreign(path: Path) -> None:
    pq.write_table(pa.table({"x": [1]}), path)


def _garbled_mark(path: Path) -> None:
    pq.write_table(pq.read_table(path).replace_schema_metadata({METADATA_KEY: b"{"}), path)


def _missing_column(path: Path) -> None:
    pq.write_table(pq.read_table(path).drop_columns(["weight_m"]), path)


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (_cut_short, "part-000000.parquet is not a readable parquet file .* run the harvest stage again"),
        (_older_version, "holds datums v0, this code reads datums v3: run `dvc repro harvest`"),
        (_foreign, "holds no hinterland datums"),
        (_garbled_mark, "holds no hinterland datums"),
        (_missing_column, "its columns are .* expected"),
        (_other_length, "of 64 ranges a scan but its columns are"),
        (_no_length, "of None ranges a scan but its columns are"),
    ],
)
def test_a_bad_shard_is_named(tmp_path: Path, damage: object, message: str) -> None:
    path = shard_path(tmp_path, 0)
    write_shard(path, stack(make_datums(3)))
    damage(path)  # type: ignore[operator]
    with pytest.raises(TableError, match=r"part-000000.parquet is damaged: .* Run `dvc repro -f harvest`"):
        read_datums(tmp_path)
    write_sum(path)  # as a program that vouches for it would have left it
    with pytest.raises(TableError, match=message):
        read_datums(tmp_path)


def test_no_shards_say_what_to_run(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"nowhere holds no datums .* run the harvest stage"):
        read_datums(tmp_path / "nowhere")


def test_a_summary_counts_what_the_shards_hold(tmp_path: Path) -> None:
    datums = [
        *make_datums(5, split="train"),
        *(datum._replace(plan_id="other", building="annex", pair_id="other/0") for datum in make_datums(3)),
        *make_datums(2, split="validation"),
    ]
    write_shard(shard_path(tmp_path, 0), stack(datums[:4]))
    write_shard(shard_path(tmp_path, 1), stack(datums[4:]))
    found, rows = summarise(tmp_path), read_datums(tmp_path)
    assert found.datums == 10
    assert (found.pairs, found.plans, found.buildings) == tuple(
        len(set(column.tolist())) for column in (rows.pair_id, rows.plan_id, rows.building)
    )
    assert found.leading_share == rows.leads_to_goal.mean()
    assert found.per_split == {"train": 8, "validation": 2}
