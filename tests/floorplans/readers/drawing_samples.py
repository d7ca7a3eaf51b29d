"""One small house in metres, y up, that every drawing format draws in its own way: turned over it is another house.

A hall along the south, a study north of its west end, and one door of 0.9 m between them: an L.
"""

from pathlib import Path

import pytest
import shapely

from pipeline.errors import PlanError
from pipeline.floorplans.plan import Door, FloorPlan
from pipeline.floorplans.readers.reader import Reader, ReadOptions

OUTLINE = ((0.0, 0.0), (10.0, 0.0), (10.0, 4.0), (4.0, 4.0), (4.0, 9.0), (0.0, 9.0))
PARTITION = ((0.0, 4.0), (4.0, 4.0))
DOOR = ((1.0, 4.0), (1.9, 4.0))
HALL = ((0.0, 0.0), (10.0, 0.0), (10.0, 4.0), (0.0, 4.0))
STUDY = ((0.0, 4.0), (4.0, 4.0), (4.0, 9.0), (0.0, 9.0))
INSIDE = ((8.0, 2.0), (2.0, 2.0), (2.0, 7.0), (1.45, 4.0))
SOLID = ((0.5, 4.0), (2.5, 4.0), (3.5, 4.0))  # the partition beside its door
OUTSIDE = ((8.0, 7.0), (8.0, -2.0), (-2.0, 7.0))


def read_all(reader: Reader, path: Path, **options) -> list[FloorPlan | PlanError]:
    return list(reader.read(path, ReadOptions(**options)))


def read_one(reader: Reader, path: Path, **options) -> FloorPlan:
    (plan,) = read_all(reader, path, **options)
    if isinstance(plan, PlanError):
        raise plan
    return plan


def refusal(reader: Reader, path: Path, **options) -> str:
    """The text of the error that refuses the file; it names the file and is a sentence."""
    with pytest.raises(PlanError) as problem:
        read_one(reader, path, **options)
    text = str(problem.value)
    assert text.startswith(str(path))
    assert text.endswith((".", "'"))
    return text


def contains(plan: FloorPlan, spots) -> list[bool]:
    return shapely.contains_xy(plan.free, list(spots)).tolist()


def check_house(plan: FloorPlan, *, width: float | None = 0.9) -> None:
    """Check that ``plan`` is the house at its size, neither turned nor mirrored; ``width`` None: without its door."""
    spots = INSIDE if width is not None else INSIDE[:3]
    assert contains(plan, spots) == [True] * len(spots)
    assert contains(plan, SOLID) == [False] * len(SOLID)
    assert contains(plan, OUTSIDE) == [False] * len(OUTSIDE)
    assert len(shapely.get_parts(plan.free)) == (1 if width is not None else 2)
    assert 50 < plan.free.area < 60
    assert plan.bounds == pytest.approx((0, 0, 10, 9), abs=0.2)
    if width is not None:
        (door,) = plan.doors
        assert door == Door(pytest.approx(1.45, abs=0.01), pytest.approx(4, abs=0.1), pytest.approx(width, abs=2e-3))
