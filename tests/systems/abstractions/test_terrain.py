"""Terrain worlds: what each cell is, what blocks, and that everything else is connected."""

import numpy as np
import pytest
from scipy.ndimage import label

from pipeline.errors import ConfigError
from pipeline.randomness import stream
from pipeline.systems.abstractions.terrain import FOREST, PAVEMENT, SAND, WATER, TerrainMap, TerrainShape, draw_terrain

SMALL = TerrainShape(regions=6, region_cells=32)


def world(index: int, shape: TerrainShape = SMALL) -> TerrainMap:
    return draw_terrain(shape, stream(3, "terrain", index))


def test_a_world_of_the_thesis_has_its_sizes_and_all_four_classes() -> None:
    found = world(0, TerrainShape())
    assert found.terrain.shape == found.blocked.shape == (832, 832)
    assert found.picture.shape == (208, 208, 3) and found.picture.dtype == np.uint8
    assert set(np.unique(found.terrain)) == {WATER, FOREST, SAND, PAVEMENT}


@pytest.mark.parametrize("index", range(12))
def test_water_is_blocked_roads_are_open_and_the_rest_is_one_piece(index: int) -> None:
    found = world(index)
    assert found.blocked[found.terrain == WATER].all()
    assert not found.blocked[found.terrain == PAVEMENT].any()
    assert label(~found.blocked)[1] == 1
    # Walls alone are lost: 2 of 6 cells across leave (4 / 6)^2 of the ground, and pieces that are opened more.
    woods = found.terrain == FOREST
    if woods.any():
        assert 0.05 < found.blocked[woods].mean() < 1.0 - (4 / 6) ** 2


def test_each_image_pixel_covers_cells_of_one_class() -> None:
    found = world(1)
    blocks = found.terrain.reshape(48, 4, 48, 4)
    assert (blocks == blocks[:, :1, :, :1]).all()


def test_a_perfect_maze_has_one_way_between_any_two_places() -> None:
    """All forest: corridor cells 1, walls 1, so places and open pieces are single cells and a tree has n - 1 edges."""
    shape = TerrainShape(
        regions=3, region_cells=8, pixel_cells=1, water_share=0.0, forest_share=1.0, roads=1, corridor_cells=1,
        wall_cells=1, opened_share=0.0,
    )  # fmt: skip
    found = world(5, shape)
    rows, cols = np.nonzero(found.terrain == FOREST)
    free = ~found.blocked
    steps = (free[1:] & free[:-1]).sum() + (free[:, 1:] & free[:, :-1]).sum()
    woods = np.zeros_like(free)
    woods[rows, cols] = True
    inner = free & woods
    tree = (inner[1:] & inner[:-1]).sum() + (inner[:, 1:] & inner[:, :-1]).sum()
    assert steps >= free.sum() - 1  # connected
    assert tree <= inner.sum() - 1  # no loop within the woods
    looser = world(5, TerrainShape(**{**vars(shape), "opened_share": 1.0}))
    assert (~looser.blocked).sum() > free.sum()


def test_the_picture_tells_classes_apart_and_mud_from_sand() -> None:
    muddy, dry = (world(2, TerrainShape(**{**vars(SMALL), "mud_share": share, "shading": 0.0})) for share in (1.0, 0.0))
    sand = muddy.terrain[::4, ::4] == SAND
    assert (muddy.terrain == dry.terrain).all()
    assert sand.sum() > 50
    assert muddy.picture[sand].mean() < dry.picture[sand].mean() - 10
    assert muddy.blocked[muddy.terrain == SAND].any() and not dry.blocked[dry.terrain == SAND].any()


def test_a_world_depends_on_its_stream_alone() -> None:
    again, other = world(0), world(1)
    assert all((one == two).all() for one, two in zip(world(0), again, strict=True))
    assert (again.terrain != other.terrain).any()


@pytest.mark.parametrize(
    ("change", "said"),
    [({"pixel_cells": 5}, "a divisor of region_cells = 64"), ({"water_share": 1.5}, "a share from 0 to 1"),
     ({"water_share": 0.7, "forest_share": 0.4}, "at most 0.3 beside the water"), ({"regions": 0}, "at least 1")],
)  # fmt: skip
def test_impossible_shapes_are_refused(change: dict[str, float], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        TerrainShape(**change)
