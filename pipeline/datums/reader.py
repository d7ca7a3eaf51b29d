"""Parquet shards to datums."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from numpy.typing import NDArray

from pipeline.datums.schema import DATUM_COLUMNS, DATUM_VERSION, METADATA_KEY, DatumRows, datum_schema, stack
from pipeline.errors import TableError
from pipeline.files import check_sum

_ROWS_AT_ONCE: Final = 2048
_MOST_BEAMS: Final = 2**20  # a number beyond is damage
_EMPTY: Final = "{} holds no datums (part-*.parquet expected): run the harvest stage first."
_UNREADABLE: Final = "{} is not a readable parquet file ({}): delete it and run the harvest stage again."
REMEDY: Final = "Run `dvc repro -f harvest`: it makes damaged shards anew and keeps the others."


def read_datums(folder: Path, splits: Sequence[str] | None = None) -> DatumRows:
    """Return the datums of ``folder`` in shard order, of all splits or of ``splits``.

    Raises TableError naming the file when the folder or its shards are missing, a shard is damaged or of another
    version; the message says what to run.
    """
    parts = list(read_blocks(folder, splits))
    if not parts:
        return stack([], beams=beams_in(folder))
    return DatumRows(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def read_blocks(
    folder: Path, splits: Sequence[str] | None = None, *, rows_at_once: int = _ROWS_AT_ONCE
) -> Iterator[DatumRows]:
    """Yield what :func:`read_datums` returns, up to ``rows_at_once`` rows at a time, none of them empty.

    Raises TableError as it does, at the latest when the shard in question is reached.
    """
    for table in read_tables(folder, rows_at_once=rows_at_once):
        if splits is not None:
            table = table.filter(pc.is_in(table["split"], pa.array(list(splits), type=pa.string())))
        if len(table):
            yield DatumRows(*(_values(table[name].combine_chunks()) for name in DATUM_COLUMNS))  # type: ignore[arg-type]


def read_tables(
    folder: Path, *, columns: Sequence[str] | None = None, rows_at_once: int = _ROWS_AT_ONCE
) -> Iterator[pa.Table]:
    """Yield the shards as tables of up to ``rows_at_once`` rows, with all ``columns`` or those named.

    Raises TableError as :func:`read_datums` does.
    """
    shards = sorted(folder.glob("part-*.parquet"))
    if not shards:
        raise TableError(_EMPTY.format(folder))
    beams = None
    for path in shards:
        check_sum(path, REMEDY)
        try:
            with pq.ParquetFile(path) as file:
                found = _beams_of(path, file.schema_arrow)
                if found != (beams or found):
                    raise TableError(
                        f"{path} holds scans of {found} ranges, the shards before it of {beams}, expected one number "
                        f"in all of {folder}: delete the folder and run the harvest stage again."
                    )
                beams = found
                for batch in file.iter_batches(rows_at_once, columns=columns):
                    yield pa.Table.from_batches([batch])
        except (OSError, pa.ArrowException) as error:
            raise TableError(_UNREADABLE.format(path, error)) from error


def beams_in(folder: Path) -> int:
    """Return how many ranges the scans of the table in ``folder`` have.

    Raises TableError as :func:`read_datums` does.
    """
    shards = sorted(folder.glob("part-*.parquet"))
    if not shards:
        raise TableError(_EMPTY.format(folder))
    try:
        return _beams_of(shards[0], pq.read_schema(shards[0]))
    except (OSError, pa.ArrowException) as error:
        raise TableError(_UNREADABLE.format(shards[0], error)) from error


def _beams_of(path: Path, found: pa.Schema) -> int:
    """Return how many ranges a scan has in the shard of schema ``found``, which must be of this version."""
    try:
        marks = dict(json.loads((found.metadata or {}).get(METADATA_KEY, b"{}")))
    except (TypeError, ValueError):
        marks = {}
    version = marks.get("version")
    if marks.get("table") != "datums" or version != DATUM_VERSION:
        described = f"datums v{version}" if marks.get("table") == "datums" else "no hinterland datums"
        raise TableError(f"{path} holds {described}, this code reads datums v{DATUM_VERSION}: run `dvc repro harvest`.")
    beams = marks.get("beams")
    if not isinstance(beams, int) or not 0 < beams < _MOST_BEAMS or not found.equals(datum_schema(beams)):
        raise TableError(
            f"{path} says datums v{version} of {beams} ranges a scan but its columns are {found.names}, expected "
            f"{list(DATUM_COLUMNS)} with the types of pipeline/datums/schema.py: delete it and run the harvest stage "
            "again."
        )
    return beams


def _values(array: pa.Array) -> NDArray[np.generic]:
    if pa.types.is_string(array.type):
        words = array.dictionary_encode()
        shared = np.asarray(words.dictionary.to_pylist() or [""], dtype=object)
        return np.asarray(shared[words.indices.to_numpy()])
    if pa.types.is_fixed_size_list(array.type):
        return np.asarray(array.flatten().to_numpy()).reshape(-1, array.type.list_size)
    if pa.types.is_list(array.type):
        return np.asarray(array.flatten().to_numpy()).reshape(len(array), len(array.flatten()) // max(1, len(array)))
    return np.asarray(array.to_numpy(zero_copy_only=False))
