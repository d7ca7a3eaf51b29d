"""Learning curves in a long table: one row per step, split and name. Written anew, whole, with every look."""

from pathlib import Path
from typing import Final, NamedTuple

import pyarrow as pa
import pyarrow.parquet as pq

from pipeline.errors import TableError
from pipeline.files import check_sum, write_table

CURVE_SCHEMA: Final[pa.Schema] = pa.schema(
    [
        pa.field("step", pa.int64(), nullable=False),
        pa.field("split", pa.string(), nullable=False),
        pa.field("name", pa.string(), nullable=False),
        pa.field("value", pa.float64(), nullable=False),
    ],
    metadata={b"hinterland": b'{"table": "curves", "version": 1}'},
)


class CurvePoint(NamedTuple):
    """The value of ``name`` on ``split`` after ``step`` training steps."""

    step: int
    split: str
    name: str
    value: float


def write_curves(path: Path, points: list[CurvePoint]) -> None:
    """Write ``points``, atomically."""
    write_table(path, pa.Table.from_pylist([point._asdict() for point in points], schema=CURVE_SCHEMA))


def read_curves(path: Path, *, until: int) -> list[CurvePoint]:
    """Return the points of steps up to ``until``; none when there is no file.

    Raises TableError naming the file when it cannot be read.
    """
    if not path.is_file():
        return []
    check_sum(path, "Delete it and run train again.")
    try:
        rows = pq.read_table(path, schema=CURVE_SCHEMA).to_pylist()
    except (OSError, pa.ArrowException) as error:
        raise TableError(
            f"{path} is not a readable table of curves ({error}): delete it and run train again."
        ) from error
    return [CurvePoint(**row) for row in rows if row["step"] <= until]
