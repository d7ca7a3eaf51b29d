"""Versioned parquet tables: units and frames in the schema, one clear error when a file is of another kind.

A `Table` is a name, a version and columns. It writes and reads its files, whole or in shards, checks them as they come,
and gives the digest of their content. The version rises with every change of a column's name, type, unit or meaning.
"""

import hashlib
import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.errors import TableError
from pipeline.files import check_sum, write_table

_KEY = b"hinterland"
_ROWS_AT_ONCE = 2048


def column(name: str, kind: pa.DataType, *, unit: str = "", frame: str = "", optional: bool = False) -> pa.Field:
    """Return a column; ``unit`` and ``frame`` go into its metadata where they are given."""
    notes = {key: value for key, value in (("unit", unit), ("frame", frame)) if value}
    return pa.field(name, kind, nullable=optional, metadata=notes or None)


class Table:
    """A kind of table.

    name, version: stamped into every file. stage: the one that makes it, for messages. columns: made by `column`.
    earlier: for each earlier version that can still be read, what turns its content into the next version's.
    """

    def __init__(
        self,
        name: str,
        version: int,
        columns: Sequence[pa.Field],
        *,
        stage: str,
        earlier: Mapping[int, Callable[[pa.Table], pa.Table]] | None = None,
    ) -> None:
        """Describe a table; nothing is read or written."""
        self.name, self.version, self.stage = name, version, stage
        self._columns, self._earlier = list(columns), dict(earlier or {})

    @cached_property
    def schema(self) -> pa.Schema:
        """The columns with the stamp of name and version."""
        return pa.schema(self._columns, metadata={_KEY: json.dumps({"table": self.name, "version": self.version})})

    def of(self, columns: Mapping[str, Sequence[Any]]) -> pa.Table:
        """Return ``columns``, name -> values, as a table.

        Raises:
            TableError: a column is missing, too many, of another type, or null where it may not be.
        """
        if set(columns) != set(self.schema.names):
            raise TableError(
                f"table {self.name!r}: got the columns {sorted(columns)}, expected {sorted(self.schema.names)}. Fill "
                "exactly these."
            )
        try:
            table = pa.table({key: columns[key] for key in self.schema.names}, schema=self.schema)
        except (pa.ArrowInvalid, pa.ArrowTypeError, TypeError) as error:
            raise TableError(f"table {self.name!r}: a column does not have the type of its schema: {error}") from error
        for field in self.schema:
            if not field.nullable and table.column(field.name).null_count:
                raise TableError(
                    f"table {self.name!r}: column {field.name!r} holds a null but every row needs a value there."
                )
        return table

    def stack(self, rows: Iterable[tuple[Any, ...]]) -> pa.Table:
        """Return ``rows``, records whose fields are in the order of the columns, as a table. Raises as `of`."""
        listed = list(rows)
        names = self.schema.names
        return self.of({name: [row[index] for row in listed] for index, name in enumerate(names)})

    def write(self, path: Path, table: pa.Table) -> pa.Table:
        """Write ``table`` to ``path``, atomically and with a checksum, and return it."""
        write_table(path, table)
        return table

    def read(self, path: Path) -> pa.Table:
        """Return the table at ``path``; one of an earlier version is converted where that can be done.

        Raises:
            TableError: the file is missing, damaged, another table or of a version that cannot be read; names the
                stage to run.
        """
        if not path.is_file():
            raise TableError(f"{path}: no such file. {self._remedy()}")
        check_sum(path, self._remedy("-f "))
        try:
            table: pa.Table = pq.read_table(path)
        except (pa.ArrowException, OSError) as problem:
            raise TableError(f"{path}: not a readable parquet file ({problem}). {self._remedy()}") from problem
        return self._converted(path, table)

    def blocks(
        self, folder: Path, *, columns: Sequence[str] | None = None, rows_at_once: int = _ROWS_AT_ONCE
    ) -> Iterator[pa.Table]:
        """Yield the shards ``part-*.parquet`` of ``folder`` in the order of their names, some rows at a time.

        columns: only these; None for all. Raises TableError as `read`, at the latest when the shard is reached.
        """
        shards = sorted(folder.glob("part-*.parquet"))
        if not shards:
            raise TableError(f"{folder} holds no {self.name} (part-*.parquet expected). {self._remedy()}")
        for path in shards:
            check_sum(path, f"{self._remedy('-f ')} It makes damaged shards anew and keeps the others.")
            try:
                with pq.ParquetFile(path) as file:
                    self.check(path, file.schema_arrow)
                    for batch in file.iter_batches(rows_at_once, columns=columns):
                        yield pa.Table.from_batches([batch])
            except (OSError, pa.ArrowException) as error:
                raise TableError(f"{path}: not a readable parquet file ({error}). {self._remedy()}") from error

    def check(self, path: Path, schema: pa.Schema) -> None:
        """Check that ``schema``, found at ``path``, is this table's in this version.

        Raises:
            TableError: it is not.
        """
        found = stamp_of(schema)
        if found != stamp_of(self.schema) or schema.names != self.schema.names:
            ours = _describe(stamp_of(self.schema))
            raise TableError(f"{path}: holds {_describe(found)}, this code reads {ours}. {self._remedy()}")

    def _converted(self, path: Path, table: pa.Table) -> pa.Table:
        found = stamp_of(table.schema) or {}
        version = found.get("version")
        while found.get("table") == self.name and isinstance(version, int) and version in self._earlier:
            table, version = self._earlier[version](table), version + 1
        if version == self.version and table.schema.names == self.schema.names:
            table = table.cast(self.schema) if table.schema.types != self.schema.types else table
            table = table.replace_schema_metadata(self.schema.metadata)
        self.check(path, table.schema)
        return table

    def _remedy(self, flag: str = "") -> str:
        return f"Run `dvc repro {flag}{self.stage}` (or `python -m pipeline.stages.{self.stage}`)."


def stamp_of(schema: pa.Schema) -> dict[str, Any] | None:
    """Return the name and version stamped into ``schema``, None where there are none."""
    try:
        found = json.loads((schema.metadata or {}).get(_KEY, b"null"))
    except ValueError:
        return None
    return found if isinstance(found, dict) else None


def digest_of(table: pa.Table, *, without: Collection[str] = ()) -> str:
    """Return the SHA-256 hex digest of the content of ``table``, column by column, except ``without``.

    It depends on names, types, values and row order, not on chunking, compression or file layout.
    """
    running = hashlib.sha256()
    running.update((table.schema.metadata or {}).get(_KEY, b""))
    for field in table.schema:
        if field.name in without:
            continue
        values = table.column(field.name).combine_chunks()
        running.update(f"\x1e{field.name}\x1f{field.type}\x1f{len(values)}\x1f".encode())
        running.update(_content(values))
    return running.hexdigest()


def _content(values: pa.Array) -> bytes:
    """Return bytes that are equal exactly when the values are."""
    kind = values.type
    if not values.null_count and (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
        return np.ascontiguousarray(values.to_numpy(zero_copy_only=False)).tobytes()
    return repr(values.to_pylist()).encode()


def _describe(stamp: dict[str, Any] | None) -> str:
    if stamp is None:
        return "a table without a stamp"
    return f"table {stamp.get('table')!r} version {stamp.get('version')}"
