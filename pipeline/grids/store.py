"""The tables of the rasterize stage: grids.parquet, one row per plan, and pairs.parquet, one row per start and goal."""

import zlib
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from pipeline.errors import TableError
from pipeline.grids.occupancy import Cell, OccupancyGrid, Point
from pipeline.grids.splits import SPLITS
from pipeline.tables import Table, column

_IDENTITY = [column(name, pa.string()) for name in ("plan_id", "building", "environment", "split")]

_LAYER = pa.struct([pa.field("name", pa.string()), pa.field("dtype", pa.string()), pa.field("values", pa.binary())])


def _without_layers(table: pa.Table) -> pa.Table:
    """Return a table of version 2 as one of version 3, whose plans say nothing but their occupancy."""
    return table.append_column("layers", pa.array([[]] * table.num_rows, pa.list_(_LAYER)))


GRIDS = Table(
    "grids",
    3,
    [
        *_IDENTITY,
        column("rows", pa.int32()),
        column("cols", pa.int32()),
        column("resolution_m", pa.float64(), unit="m"),
        column("origin_x_m", pa.float64(), unit="m", frame="world"),
        column("origin_y_m", pa.float64(), unit="m", frame="world"),
        column("cells", pa.binary(), frame="row 0 = lowest y"),
        column("robot_radius_m", pa.float64(), unit="m"),
        column("reachable_m2", pa.float64(), unit="m2"),
        column("lost_m2", pa.float64(), unit="m2"),
        column("layers", pa.list_(_LAYER), frame="row 0 = lowest y"),
    ],
    stage="rasterize",
    earlier={2: _without_layers},
)

PAIRS = Table(
    "pairs",
    1,
    [
        column("pair_id", pa.string()),
        *_IDENTITY,
        *(column(name, pa.int32(), unit="cell") for name in ("start_row", "start_col", "goal_row", "goal_col")),
        column("known_map_m", pa.float64(), unit="m"),
    ],
    stage="rasterize",
)


class GridRecord(NamedTuple):
    """The true map of one plan: FREE and OCCUPIED cells in a closed ring, and the radius [m] to inflate them by.

    reachable_m2: what a robot of that radius reaches on the plan; lost_m2: what of it is lost on these cells; see
    `pipeline.grids.lost_area`.
    layers: what else the plan says of each cell, by name: [rows, cols], of any number type.
    """

    plan_id: str
    building: str
    environment: str
    split: str
    grid: OccupancyGrid
    robot_radius_m: float
    reachable_m2: float = 0.0
    lost_m2: float = 0.0
    layers: Mapping[str, NDArray[Any]] = MappingProxyType({})


class PackedWorld(NamedTuple):
    """A row of the table, cells still compressed: thousands of them fit into memory and travel to workers cheaply."""

    plan_id: str
    row: dict[str, Any]

    def unpack(self) -> GridRecord:
        """Return the map."""
        row = self.row
        cells = np.frombuffer(zlib.decompress(row["cells"]), dtype=np.uint8).reshape(row["rows"], row["cols"]).copy()
        return GridRecord(
            plan_id=row["plan_id"],
            building=row["building"],
            environment=row["environment"],
            split=row["split"],
            grid=OccupancyGrid(cells, row["resolution_m"], Point(row["origin_x_m"], row["origin_y_m"])),
            robot_radius_m=row["robot_radius_m"],
            reachable_m2=row["reachable_m2"],
            lost_m2=row["lost_m2"],
            layers={layer["name"]: _layer(layer, cells.shape) for layer in row["layers"]},
        )


class Pair(NamedTuple):
    """A start and a goal on one plan. known_map_m: shortest travel distance in the true inflated map [m]."""

    pair_id: str
    plan_id: str
    building: str
    environment: str
    split: str
    start: Cell
    goal: Cell
    known_map_m: float


def write_worlds(folder: Path, records: Iterable[GridRecord]) -> Path:
    """Write folder/grids.parquet atomically and return its path."""
    path = folder / "grids.parquet"
    GRIDS.write(path, pa.Table.from_pylist([_grid_row(record) for record in records], schema=GRIDS.schema))
    return path


def write_pairs(folder: Path, pairs: Iterable[Pair]) -> Path:
    """Write folder/pairs.parquet atomically and return its path."""
    path = folder / "pairs.parquet"
    PAIRS.write(path, pa.Table.from_pylist([_pair_row(pair) for pair in pairs], schema=PAIRS.schema))
    return path


def read_packed_worlds(
    folder: Path, split: str | None = None, *, robot_radius_m: float | None = None
) -> list[PackedWorld]:
    """Return the maps of ``split``, or all, in the order of the table, to be unpacked where they are needed.

    robot_radius_m: the robot that is going to drive there [m]. Starts, goals and their distances hold for one radius.

    Raises:
        TableError: the table is missing, unreadable, of another version or made for another robot.
    """
    path = folder / "grids.parquet"
    rows = _rows_of(GRIDS.read(path), split)
    for row in rows:
        if robot_radius_m is not None and row["robot_radius_m"] != robot_radius_m:
            raise TableError(
                f"{path}: plan {row['plan_id']!r} was made for robot.radius_m = {row['robot_radius_m']}, this run has "
                f"{robot_radius_m}, and starts, goals and distances hold for one radius only. Run "
                f"`dvc repro rasterize` with this radius, or set robot.radius_m={row['robot_radius_m']}."
            )
    return [PackedWorld(row["plan_id"], row) for row in rows]


def grid_resolution(folder: Path) -> float | list[float]:
    """Return the side of a cell [m] of the maps in the table, all sides where they differ. Raises as the readers do."""
    table = GRIDS.read(folder / "grids.parquet")
    found = sorted(pc.unique(table["resolution_m"]).to_pylist())
    return float(found[0]) if len(found) == 1 else [float(side) for side in found]


def read_worlds(folder: Path, split: str | None = None) -> list[GridRecord]:
    """Return the same unpacked."""
    return [packed.unpack() for packed in read_packed_worlds(folder, split)]


def read_pairs(folder: Path, split: str | None = None) -> list[Pair]:
    """Return the pairs of ``split``, or all, in the order of the table.

    Raises:
        TableError: the table is missing, unreadable or of another version.
    """
    table = PAIRS.read(folder / "pairs.parquet")
    return [_pair(row) for row in _rows_of(table, split)]


def _rows_of(table: pa.Table, split: str | None) -> list[dict[str, Any]]:
    if split is not None and split not in SPLITS:
        raise ValueError(f"split = {split}: expected one of {', '.join(SPLITS)}")
    if split is not None:
        table = table.filter(pc.equal(table["split"], split))
    rows: list[dict[str, Any]] = table.to_pylist()
    return rows


def _grid_row(record: GridRecord) -> dict[str, Any]:
    rows, cols = record.grid.cells.shape
    same = ("plan_id", "building", "environment", "split", "robot_radius_m", "reachable_m2", "lost_m2")
    return {
        **{name: getattr(record, name) for name in same},
        "rows": rows,
        "cols": cols,
        "resolution_m": record.grid.resolution,
        "origin_x_m": record.grid.origin.x,
        "origin_y_m": record.grid.origin.y,
        "cells": zlib.compress(record.grid.cells.tobytes()),
        "layers": [
            {"name": name, "dtype": values.dtype.str, "values": zlib.compress(np.ascontiguousarray(values).tobytes())}
            for name, values in sorted(record.layers.items())
        ],
    }


def _layer(packed: dict[str, Any], shape: tuple[int, ...]) -> NDArray[Any]:
    values: NDArray[Any] = np.frombuffer(zlib.decompress(packed["values"]), dtype=packed["dtype"]).reshape(shape)
    return values


def _pair_row(pair: Pair) -> dict[str, Any]:
    ends = {
        "start_row": pair.start.row,
        "start_col": pair.start.col,
        "goal_row": pair.goal.row,
        "goal_col": pair.goal.col,
    }
    rest = pair._asdict()
    return {key: rest[key] for key in rest if key not in ("start", "goal")} | ends


def _pair(row: dict[str, Any]) -> Pair:
    start, goal = (Cell(row.pop(f"{end}_row"), row.pop(f"{end}_col")) for end in ("start", "goal"))
    return Pair(**row, start=start, goal=goal)
