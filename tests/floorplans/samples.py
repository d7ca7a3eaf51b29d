"""Small floor plans, and the files they come from, made in the tests."""

from pathlib import Path

import numpy as np
import shapely
from PIL import Image

from pipeline.floorplans.plan import Bounds, FloorPlan, GridPlan, Location

LETTERS = {".": 0, "#": 1, "?": 2, "c": 3}
LABELS = np.array(["background", "clutter", "door", "hallway", "room", "unknown"])
SEMANTICS = {"#": 0, "c": 1, "d": 2, ".": 3}

# An L with one door: turning or mirroring it gives another plan.
ELL = (
    "#############",
    "#...........#",
    "#...........#",
    "#####ddd#####",
    "#####...#####",
    "#####..c#####",
    "#####...#####",
    "#############",
)
KNOWN = (
    "????????",
    "?######?",
    "?#....#?",
    "?#.c..#?",
    "?#.####?",
    "?###????",
)


def cells_of(lines: tuple[str, ...]) -> np.ndarray:
    """Cells of a drawing, row 0 the lowest line."""
    return np.array([[LETTERS[letter] for letter in line] for line in reversed(lines)], dtype=np.uint8)


def grid_plan(lines: tuple[str, ...], resolution: float = 0.5, **changes) -> GridPlan:
    given = {"plan_id": "drawn", "building": "b", "floor": "f", "environment": "test", "source": "a drawing"}
    given |= {"cells": cells_of(lines), "resolution": resolution, "origin": Location(0.0, 0.0)}
    return GridPlan(**(given | changes))


def floor_plan(free: shapely.Geometry, **changes) -> FloorPlan:
    given = {"plan_id": "drawn", "building": "b", "floor": "f", "environment": "test", "source": "a drawing"}
    given |= {"free": free, "bounds": Bounds(*free.bounds)}
    return FloorPlan(**(given | changes))


def write_npz(path: Path, lines: tuple[str, ...] = ELL, **changes) -> Path:
    """Write a floor as the MIT files have it; the first line of the drawing is row 0 of the arrays."""
    semantic = np.array([[SEMANTICS[letter] for letter in line] for line in lines], dtype=np.uint8)
    layers = {
        "occ_grid": (semantic < 2).astype(np.uint8),
        "semantic_grid": semantic,
        "semantic_labels": LABELS,
        "resolution": np.float64(0.5),
    }
    layers |= changes
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, **{name: layer for name, layer in layers.items() if layer is not None})
    return path


def write_map(folder: Path, grey: np.ndarray, *, picture: str = "map.png", **changes) -> Path:
    """Write a ROS map; row 0 of ``grey`` is the top of the picture."""
    folder.mkdir(parents=True, exist_ok=True)
    Image.fromarray(grey).save(folder / picture)
    header = {"image": picture, "resolution": 0.5, "origin": "[1.0, 2.0, 0.0]", "negate": 0}
    header |= {"occupied_thresh": 0.65, "free_thresh": 0.196} | changes
    path = folder / "map.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in header.items() if value is not None))
    return path
