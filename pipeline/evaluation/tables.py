"""Rows into a checked table, and the digest of a table's content."""

import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa

from pipeline.errors import TableError

_KEY = b"hinterland"


def build_table(columns: Mapping[str, Sequence[Any]], schema: pa.Schema) -> pa.Table:
    """Return ``columns`` as a table of ``schema``.

    Raises TableError where a column is missing, too many, of another type, or null where it may not be.
    """
    name = json.loads(schema.metadata[_KEY])["table"]
    if set(columns) != set(schema.names):
        raise TableError(
            f"table {name!r}: got the columns {sorted(columns)}, expected {sorted(schema.names)}. Fill exactly these."
        )
    try:
        table = pa.table({key: columns[key] for key in schema.names}, schema=schema)
    except (pa.ArrowInvalid, pa.ArrowTypeError, TypeError) as error:
        raise TableError(f"table {name!r}: a column does not have the type of its schema: {error}") from error
    for field in schema:
        if not field.nullable and table.column(field.name).null_count:
            raise TableError(f"table {name!r}: column {field.name!r} holds a null but every row needs a value there.")
    return table


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
