"""The datum table: one row per subgoal that a robot met while exploring, with what it led to.

The version rises with every change of a column's name, type, unit or meaning; a reader refuses another version. How
many ranges a scan has is a property of the table, ``beams`` in its metadata: all shards of a table have as many.
"""

import json
from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

DATUM_VERSION: Final = 3
BEAMS: Final = 256  # ranges in a scan, where nothing says otherwise
MAP_VIEW: Final = 115  # numbers in a view of the map, see pipeline/systems/subgoals/map_inputs.py
METADATA_KEY: Final = b"hinterland"

Texts = NDArray[np.object_]  # of str; equal words share one object, so that 300 k rows stay small
Float32s = NDArray[np.float32]
Float64s = NDArray[np.float64]


class Datum(NamedTuple):
    """One labelled subgoal. Fields as in :class:`DatumRows`; ``None`` stands where a label does not apply."""

    pair_id: str
    plan_id: str
    building: str
    environment: str
    split: str
    seed: int
    step: int
    subgoal: int
    pose_x_m: float
    pose_y_m: float
    heading_rad: float
    ranges: NDArray[np.floating]
    goal_x_m: float
    goal_y_m: float
    subgoal_x_m: float
    subgoal_y_m: float
    leads_to_goal: bool
    delta_success_m: float | None
    exploration_m: float | None
    weight_m: float
    frontier_cells: int
    map_view: NDArray[np.floating] | None = None


class DatumRows(NamedTuple):
    """N datums as arrays, row by row aligned.

    Robot frame: origin at the robot, x ahead, y left; beam i of the scan at angle ``2 pi i / beams``,
    counter-clockwise.
    """

    pair_id: Texts  # [N]
    plan_id: Texts  # [N]
    building: Texts  # [N] what the splits are made by
    environment: Texts  # [N]
    split: Texts  # [N] train, validation, test
    seed: NDArray[np.int64]  # [N]
    step: NDArray[np.int32]  # [N] of the exploring robot
    subgoal: NDArray[np.int32]  # [N] index within the step
    pose_x_m: Float64s  # [N] world frame
    pose_y_m: Float64s  # [N] world frame
    heading_rad: Float64s  # [N] world frame, counter-clockwise from x
    ranges: Float32s  # [N, beams] m, robot frame; the sensor's maximum range where nothing was hit
    goal_x_m: Float32s  # [N] robot frame
    goal_y_m: Float32s  # [N] robot frame
    subgoal_x_m: Float32s  # [N] robot frame
    subgoal_y_m: Float32s  # [N] robot frame
    leads_to_goal: NDArray[np.bool_]  # [N]
    delta_success_m: Float32s  # [N] NaN where the subgoal does not lead to the goal
    exploration_m: Float32s  # [N] NaN where it does
    weight_m: Float32s  # [N] cost of taking this subgoal for the other class
    frontier_cells: NDArray[np.int32]  # [N]
    map_view: Float32s  # [N, MAP_VIEW] the subgoal in the robot's whole map, [N, 0] where none were harvested


def _column(name: str, kind: pa.DataType, unit: str, frame: str, *, nullable: bool = False) -> pa.Field:
    return pa.field(name, kind, nullable=nullable, metadata={"unit": unit, "frame": frame})


def datum_schema(beams: int) -> pa.Schema:
    """Return the schema of a table whose scans have ``beams`` ranges."""
    columns = [
        *(_column(name, pa.string(), "", "") for name in ("pair_id", "plan_id", "building", "environment", "split")),
        _column("seed", pa.int64(), "", ""),
        _column("step", pa.int32(), "1", ""),
        _column("subgoal", pa.int32(), "1", ""),
        _column("pose_x_m", pa.float64(), "m", "world"),
        _column("pose_y_m", pa.float64(), "m", "world"),
        _column("heading_rad", pa.float64(), "rad", "world"),
        _column("ranges", pa.list_(pa.field("item", pa.float32(), nullable=False), beams), "m", "robot"),
        *(_column(name, pa.float32(), "m", "robot") for name in ("goal_x_m", "goal_y_m", "subgoal_x_m", "subgoal_y_m")),
        _column("leads_to_goal", pa.bool_(), "", ""),
        _column("delta_success_m", pa.float32(), "m", "", nullable=True),
        _column("exploration_m", pa.float32(), "m", "", nullable=True),
        _column("weight_m", pa.float32(), "m", ""),
        _column("frontier_cells", pa.int32(), "1", ""),
        # Of variable length, since a list of fixed length cannot be left out of a parquet file: MAP_VIEW or 0 numbers.
        _column("map_view", pa.list_(pa.field("item", pa.float32(), nullable=False)), "m, 1", "subgoal to goal"),
    ]
    marks = {"table": "datums", "version": DATUM_VERSION, "beams": beams}
    return pa.schema(columns, metadata={METADATA_KEY: json.dumps(marks).encode()})


DATUM_COLUMNS: Final[tuple[str, ...]] = tuple(datum_schema(BEAMS).names)


def stack(datums: Sequence[Datum], *, beams: int = BEAMS) -> DatumRows:
    """Turn ``datums`` into columns, in order; an empty list gives zero rows, of scans with ``beams`` ranges."""
    columns: dict[str, NDArray[np.generic]] = {}
    if datums:
        beams = len(datums[0].ranges)
    for index, field in enumerate(datum_schema(beams)):
        values = [datum[index] for datum in datums]
        if field.name == "ranges":
            columns["ranges"] = np.asarray(values, dtype=np.float32).reshape(len(datums), beams)
        elif field.name == "map_view":
            width = MAP_VIEW if datums and datums[0].map_view is not None else 0
            columns["map_view"] = np.asarray(values if width else [], dtype=np.float32).reshape(len(datums), width)
        else:
            columns[field.name] = np.asarray(
                [np.nan if value is None else value for value in values], dtype=_numpy_type(field.type)
            )
    return DatumRows(**columns)  # type: ignore[arg-type]  # the schema fixes each column's type


def _numpy_type(kind: pa.DataType) -> np.dtype[np.generic]:
    return np.dtype(object) if pa.types.is_string(kind) else np.dtype(kind.to_pandas_dtype())
