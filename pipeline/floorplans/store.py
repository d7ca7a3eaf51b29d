"""The table of plans: artifacts/plans/plans.parquet, one row per plan."""

import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import shapely

from pipeline.floorplans.checks import Checked, PlanReport
from pipeline.floorplans.plan import Bounds, Door, FloorPlan, GridPlan, Layer, Location, Room
from pipeline.tables import Table, column

_DOOR = pa.struct([("x", pa.float64()), ("y", pa.float64()), ("width", pa.float64()), ("leaf", pa.bool_())])
_ROOM = pa.struct([("outline_wkb", pa.binary()), ("label", pa.string())])
_LABEL = pa.struct([("value", pa.uint16()), ("label", pa.string())])
_LAYER = pa.struct([("name", pa.string()), ("values", pa.binary()), ("labels", pa.list_(_LABEL))])

PLANS = Table(
    "plans",
    2,
    [
        column("plan_id", pa.string()),
        column("building", pa.string()),
        column("floor", pa.string()),
        column("environment", pa.string()),
        column("split", pa.string(), optional=True),
        column("kind", pa.string()),
        column("free_wkb", pa.binary(), unit="m", frame="world", optional=True),
        column("cells", pa.binary(), frame="row 0 = lowest y", optional=True),
        column("rows", pa.int32(), optional=True),
        column("cols", pa.int32(), optional=True),
        column("resolution_m", pa.float64(), unit="m", optional=True),
        column("origin_x_m", pa.float64(), unit="m", frame="world"),
        column("origin_y_m", pa.float64(), unit="m", frame="world"),
        column("width_m", pa.float64(), unit="m"),
        column("height_m", pa.float64(), unit="m"),
        column("start_x_m", pa.float64(), unit="m", frame="world", optional=True),
        column("start_y_m", pa.float64(), unit="m", frame="world", optional=True),
        column("goal_x_m", pa.float64(), unit="m", frame="world", optional=True),
        column("goal_y_m", pa.float64(), unit="m", frame="world", optional=True),
        column("doors", pa.list_(_DOOR), unit="m", frame="world"),
        column("rooms", pa.list_(_ROOM), unit="m", frame="world"),
        column("layers", pa.list_(_LAYER), frame="row 0 = lowest y"),
        column("free_components", pa.int32()),
        column("largest_free_share", pa.float64()),
        column("narrowest_door_m", pa.float64(), unit="m", optional=True),
        column("remarks", pa.list_(pa.string())),
        column("warnings", pa.list_(pa.string())),
        column("source", pa.string()),
    ],
    stage="plans",
)


def write_plans(path: Path, plans: Iterable[Checked]) -> None:
    """Write checked plans as one parquet table, atomically."""
    rows = [_row(plan, report) for plan, report in plans]
    PLANS.write(path, pa.Table.from_pylist(rows, schema=PLANS.schema))


def read_plans(path: Path) -> list[Checked]:
    """Read the table of plans.

    Raises:
        TableError: missing, unreadable, or written by another version.
    """
    return [Checked(_plan(row), _report(row)) for row in PLANS.read(path).to_pylist()]


def _row(plan: FloorPlan | GridPlan, report: PlanReport) -> dict[str, Any]:
    start, goal = plan.endpoints or (None, None)
    shared = {
        "plan_id": plan.plan_id,
        "building": plan.building,
        "floor": plan.floor,
        "environment": plan.environment,
        "split": plan.split,
        "source": plan.source,
        "start_x_m": start.x if start else None,
        "start_y_m": start.y if start else None,
        "goal_x_m": goal.x if goal else None,
        "goal_y_m": goal.y if goal else None,
        "doors": [door._asdict() for door in plan.doors],
        "remarks": list(plan.remarks),
        "rooms": [],
        "layers": [],
        **vars(report),
        "warnings": list(report.warnings),
    }
    if isinstance(plan, FloorPlan):
        extent = {"origin_x_m": plan.bounds.min_x, "origin_y_m": plan.bounds.min_y}
        rooms = [{"outline_wkb": shapely.to_wkb(room.outline), "label": room.label} for room in plan.rooms]
        return shared | extent | {"kind": "geometry", "free_wkb": shapely.to_wkb(plan.free), "rooms": rooms}
    rows, cols = plan.cells.shape
    return shared | {
        "kind": "grid",
        "cells": zlib.compress(plan.cells.astype(np.uint8).tobytes()),
        "layers": [_layer_row(name, layer) for name, layer in plan.layers.items()],
        "rows": rows,
        "cols": cols,
        "resolution_m": plan.resolution,
        "origin_x_m": plan.origin.x,
        "origin_y_m": plan.origin.y,
    }


def _layer_row(name: str, layer: Layer) -> dict[str, Any]:
    labels = [{"value": value, "label": label} for value, label in layer.labels.items()]
    return {"name": name, "values": zlib.compress(layer.values.astype(np.uint16).tobytes()), "labels": labels}


def _plan(row: dict[str, Any]) -> FloorPlan | GridPlan:
    shared: dict[str, Any] = {
        key: row[key] for key in ("plan_id", "building", "floor", "environment", "split", "source")
    }
    shared["doors"] = tuple(Door(**door) for door in row["doors"])
    shared["remarks"] = tuple(row["remarks"])
    if row["start_x_m"] is not None:
        start, goal = (Location(row[f"{end}_x_m"], row[f"{end}_y_m"]) for end in ("start", "goal"))
        shared["endpoints"] = (start, goal)
    x, y = row["origin_x_m"], row["origin_y_m"]
    if row["kind"] == "geometry":
        bounds = Bounds(x, y, x + row["width_m"], y + row["height_m"])
        rooms = tuple(Room(shapely.from_wkb(room["outline_wkb"]), room["label"]) for room in row["rooms"])
        return FloorPlan(**shared, free=shapely.from_wkb(row["free_wkb"]), bounds=bounds, rooms=rooms)
    shape = (row["rows"], row["cols"])
    cells = np.frombuffer(zlib.decompress(row["cells"]), dtype=np.uint8).reshape(shape)
    layers = {layer["name"]: _layer(layer, shape) for layer in row["layers"]}
    return GridPlan(**shared, cells=cells, resolution=row["resolution_m"], origin=Location(x, y), layers=layers)


def _layer(row: dict[str, Any], shape: tuple[int, int]) -> Layer:
    values = np.frombuffer(zlib.decompress(row["values"]), dtype=np.uint16).reshape(shape)
    return Layer(values, {label["value"]: label["label"] for label in row["labels"]})


def _report(row: dict[str, Any]) -> PlanReport:
    return PlanReport(
        width_m=row["width_m"],
        height_m=row["height_m"],
        free_components=row["free_components"],
        largest_free_share=row["largest_free_share"],
        narrowest_door_m=row["narrowest_door_m"],
        warnings=tuple(row["warnings"]),
    )
