"""Where the real data sets lie, and how tests find a few files of them."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import label

from pipeline.errors import PlanError
from pipeline.floorplans.plan import FREE, FloorPlan, GridPlan
from pipeline.floorplans.readers import PLAN, Classified, ReadOptions, classify, read_plans
from pipeline.floorplans.sources import open_source

_ROOT = Path(__file__).parents[2].parent / "shared" / "data"


def dev_folder(name: str) -> Path:
    """The files of the set ``name`` that may be looked at; the test is skipped where they are absent."""
    folder = Path(os.environ.get("HINTERLAND_DATA", _ROOT)) / name / "dev"
    if not folder.is_dir():
        pytest.skip(f"no real data in {folder}: set HINTERLAND_DATA to the folder that holds {name}")
    return folder


@contextmanager
def plan_files(name: str) -> Iterator[list[Classified]]:
    """The files of the set ``name`` that hold plans, found as a person's are."""
    with open_source(dev_folder(name)) as files:
        yield [entry for entry in classify(files) if entry.role == PLAN]


def read_entry(entry: Classified, options: ReadOptions | None = None) -> list[FloorPlan | GridPlan]:
    """The plans of a file; any error is raised."""
    found = list(read_plans(entry.file, entry.reader, options))
    for plan in found:
        if isinstance(plan, PlanError):
            raise plan
    return found


def largest_share(plan: GridPlan) -> float:
    """The share of the free cells in their largest part."""
    parts, _ = label(plan.cells == FREE)
    sizes = np.bincount(parts.ravel())[1:]
    return float(sizes.max() / sizes.sum())
