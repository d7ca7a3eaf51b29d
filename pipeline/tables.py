"""Versioned parquet tables: units and frames in the schema, one clear error when a file is of another kind."""

import json
from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.errors import TableError
from pipeline.files import check_sum

_KEY = b"hinterland"


def column(name: str, kind: pa.DataType, *, unit: str = "", frame: str = "", optional: bool = False) -> pa.Field:
    """Return a column; ``unit`` and ``frame`` go into its metadata where they are given."""
    notes = {key: value for key, value in (("unit", unit), ("frame", frame)) if value}
    return pa.field(name, kind, nullable=optional, metadata=notes or None)


def table_schema(table: str, version: int, columns: Sequence[pa.Field]) -> pa.Schema:
    """Return the schema of ``table``, stamped with its name and version."""
    return pa.schema(columns, metadata={_KEY: json.dumps({"table": table, "version": version})})


def read_table(path: Path, schema: pa.Schema, *, stage: str) -> pa.Table:
    """Read ``path`` and check that it is whole and the table that ``schema`` describes.

    Raises:
        TableError: the file is missing, damaged, another table or another version; names the stage to run.
    """
    remedy = f"Run `dvc repro {stage}` (or `python -m pipeline.stages.{stage}`)."
    if not path.is_file():
        raise TableError(f"{path}: no such file. {remedy}")
    check_sum(path, f"Run `dvc repro -f {stage}` (or `python -m pipeline.stages.{stage}`).")
    try:
        table: pa.Table = pq.read_table(path)
    except (pa.ArrowException, OSError) as problem:
        raise TableError(f"{path}: not a readable parquet file ({problem}). {remedy}") from problem
    expected = json.loads(schema.metadata[_KEY])
    found = json.loads((table.schema.metadata or {}).get(_KEY, b"null"))
    if found != expected or table.schema.names != schema.names:
        raise TableError(f"{path}: holds {_describe(found)}, this code reads {_describe(expected)}. {remedy}")
    return table


def _describe(stamp: dict[str, object] | None) -> str:
    return "a table without a stamp" if stamp is None else f"table {stamp['table']!r} version {stamp['version']}"
