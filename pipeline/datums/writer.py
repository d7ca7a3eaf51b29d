"""Datums to parquet shards, and the digest that tells whether two tables hold the same."""

import hashlib
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from pipeline.datums.reader import REMEDY
from pipeline.datums.schema import DATUM_COLUMNS, MAP_VIEW, DatumRows, datum_schema
from pipeline.errors import TableError
from pipeline.files import check_sum, write_table


def shard_path(folder: Path, index: int) -> Path:
    """Return where shard ``index`` lives; the names sort in the order of the indices."""
    return folder / f"part-{index:06d}.parquet"


def write_shard(path: Path, rows: DatumRows) -> None:
    """Write ``rows`` as one shard, atomically. Ranges and views are rounded to 1 mm, which halves the file twice over.

    Raises ValueError when the rows contradict themselves: lengths that differ, values that are not finite, or a
    label that is missing where it applies or present where it does not.
    """
    write_table(path, to_table(rows))


def to_table(rows: DatumRows) -> pa.Table:
    """Return ``rows`` as a table of the current schema, checked as :func:`write_shard` says."""
    _check(rows)
    schema = datum_schema(rows.ranges.shape[1])
    return pa.Table.from_arrays([_array(getattr(rows, field.name), field) for field in schema], schema=schema)


def digest(folder: Path) -> str:
    """Return the sha256 of the content of all shards of ``folder``, in order of their names.

    Only values count: neither compression nor row groups nor where one shard ends and the next begins.
    Raises TableError naming the file when one cannot be read.
    """
    columns = {name: hashlib.sha256() for name in DATUM_COLUMNS}
    kinds: dict[str, pa.DataType] = {}
    for path in sorted(folder.glob("part-*.parquet")):
        check_sum(path, REMEDY)
        try:
            table = pq.read_table(path).select(list(DATUM_COLUMNS))
        except (OSError, KeyError, pa.ArrowException) as error:
            raise TableError(
                f"{path} is not a readable datum shard: {error}. Delete it and run harvest again."
            ) from error
        for name, total in columns.items():
            total.update(_content(table[name].combine_chunks()))
            kinds.setdefault(name, table[name].type)
    whole = hashlib.sha256()
    for name, column in columns.items():
        whole.update(f"{name}:{kinds.get(name, '')}:{column.hexdigest()}\n".encode())
    return whole.hexdigest()


def _content(array: pa.Array) -> bytes:
    """Return bytes that depend on the values of ``array`` alone, row after row."""
    if pa.types.is_string(array.type):
        return "".join(f"{len(text)}:{text}" for text in array.to_pylist()).encode()
    if pa.types.is_fixed_size_list(array.type) or pa.types.is_list(array.type):
        return np.ascontiguousarray(array.flatten().to_numpy(zero_copy_only=False)).tobytes()
    # A null reads back as NaN; one bit pattern for all of them keeps the digest a function of the content.
    values = np.array(array.to_numpy(zero_copy_only=False))
    if values.dtype.kind == "f":
        values[np.isnan(values)] = np.nan
    return values.tobytes()


def _array(values: NDArray[np.generic], field: pa.Field) -> pa.Array:
    if pa.types.is_fixed_size_list(field.type):
        return pa.FixedSizeListArray.from_arrays(pa.array(_to_millimetres(values)), type=field.type)
    if pa.types.is_list(field.type):
        starts = pa.array(np.arange(len(values) + 1, dtype=np.int32) * values.shape[1])
        return pa.ListArray.from_arrays(starts, pa.array(_to_millimetres(values)), type=field.type)
    if field.nullable:
        return pa.array(values, type=field.type, mask=np.isnan(values.astype(np.float64)))
    return pa.array(values, type=field.type)


def _to_millimetres(values: NDArray[np.generic]) -> NDArray[np.float32]:
    rounded: NDArray[np.float32] = (np.round(values.astype(np.float64) * 1000.0) / 1000.0).astype(np.float32)
    return rounded.reshape(-1)


def _check(rows: DatumRows) -> None:
    count = len(rows.pair_id)
    for name, values in rows._asdict().items():
        expected: tuple[int, ...] = (count,)
        if name == "ranges":
            expected = (count, *values.shape[1:2])
        if name == "map_view":
            expected = (count, MAP_VIEW if values.size else 0)
        if values.shape != expected:
            raise ValueError(f"datum column {name} has shape {values.shape}, expected {expected}")
        optional = name in ("delta_success_m", "exploration_m")
        if values.dtype.kind == "f" and not optional and not np.isfinite(values).all():
            raise ValueError(f"datum column {name} holds values that are not finite")
    for name, applies in (("delta_success_m", rows.leads_to_goal), ("exploration_m", ~rows.leads_to_goal)):
        labels = getattr(rows, name)
        if not np.array_equal(np.isfinite(labels), applies) or np.isinf(labels).any():
            raise ValueError(f"datum column {name} must be a number exactly where leads_to_goal says that it applies")
