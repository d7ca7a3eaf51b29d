"""The labelled table: versioned schema, writer, reader."""

from pipeline.datums.reader import read_blocks, read_datums
from pipeline.datums.schema import DATUM_COLUMNS, DATUM_VERSION, MAP_VIEW, Datum, DatumRows, datum_schema, stack
from pipeline.datums.summary import Summary, summarise
from pipeline.datums.writer import digest, shard_path, write_shard

__all__ = [
    "DATUM_COLUMNS",
    "DATUM_VERSION",
    "MAP_VIEW",
    "Datum",
    "DatumRows",
    "Summary",
    "datum_schema",
    "digest",
    "read_blocks",
    "read_datums",
    "shard_path",
    "stack",
    "summarise",
    "write_shard",
]
