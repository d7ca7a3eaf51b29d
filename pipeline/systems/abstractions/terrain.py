"""Terrain worlds: water, forest, sand and pavement, the dense map behind them and a picture from above.

Source: Stadler 2020, section 5.7.1, which gives sizes, classes and "maze-like" forests. The rest are choices: smoothed
noise for the classes, straight roads from edge to edge, mazes of corridors and walls with some walls opened, pictures
with noise and shading.
"""

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, label
from scipy.sparse import coo_array
from scipy.sparse.csgraph import minimum_spanning_tree

from pipeline.settings import require

WATER, FOREST, SAND, PAVEMENT = range(4)
TERRAINS: Final = ("water", "forest", "sand", "pavement")
_COLOURS = np.array([[52, 94, 150], [46, 92, 48], [206, 186, 132], [128, 128, 130]], dtype=np.float64)

Mask = NDArray[np.bool_]
Classes = NDArray[np.uint8]


@dataclass(frozen=True, kw_only=True)
class TerrainShape:
    """Size of a terrain world and what it is made of; lengths are cells of the dense map unless said otherwise."""

    regions: int = 13
    """Regions along a side of the square."""
    region_cells: int = 64
    """Side of a region."""
    pixel_cells: int = 4
    """Side of a pixel of the picture; divides region_cells."""
    cell_m: float = 1.0
    """Side of a cell [m]."""
    blob_regions: float = 1.1
    """Standard deviation of the noise that makes lakes and woods [regions]; they come out some two to six across."""
    water_share: float = 0.16
    forest_share: float = 0.5
    """Of the ground, before roads are laid."""
    roads: int = 2
    """Most roads along each axis; at least one. A road is one or two regions wide and runs from edge to edge."""
    corridor_cells: int = 4
    wall_cells: int = 2
    """Of the mazes."""
    opened_share: float = 0.2
    """Of the walls that a perfect maze has; opening none leaves one way between any two places."""
    mud_share: float = 0.3
    """Of the patches of sand that are mazes too, under a slightly darker tint."""
    noise: float = 15.0
    """Standard deviation of a pixel, of 255."""
    shading: float = 8.0
    """Standard deviation of the slow change of brightness over the picture, of 255."""

    def __post_init__(self) -> None:
        """Refuse impossible values."""
        for name in ("regions", "region_cells", "pixel_cells", "roads", "corridor_cells", "wall_cells"):
            _demand(name, getattr(self, name), getattr(self, name) >= 1, "at least 1")
        for name in ("water_share", "forest_share", "opened_share", "mud_share"):
            _demand(name, getattr(self, name), 0.0 <= getattr(self, name) <= 1.0, "a share from 0 to 1")
        divides = self.region_cells % self.pixel_cells == 0
        _demand("pixel_cells", self.pixel_cells, divides, f"a divisor of region_cells = {self.region_cells}")
        _demand("regions", self.regions, self.regions >= 3, "at least 3")
        whole = self.water_share + self.forest_share
        _demand("forest_share", self.forest_share, whole <= 1.0, f"at most {1.0 - self.water_share:g} beside the water")
        for name in ("noise", "shading", "blob_regions"):
            _demand(name, getattr(self, name), getattr(self, name) >= 0, "at least 0")

    @property
    def cells(self) -> int:
        """Cells along a side."""
        return self.regions * self.region_cells

    @property
    def pixels(self) -> int:
        """Pixels along a side of the picture."""
        return self.cells // self.pixel_cells


class TerrainMap(NamedTuple):
    """A terrain world; row 0 is the lowest y in all of it.

    terrain: [cells, cols] uint8, an index of TERRAINS. blocked: [cells, cols], where nobody can be: water and walls.
    picture: [pixels, pixels, 3] uint8, the view from above.
    """

    terrain: Classes
    blocked: Mask
    picture: NDArray[np.uint8]


def draw_terrain(shape: TerrainShape, rng: np.random.Generator) -> TerrainMap:
    """Draw one world; ``rng`` is consumed. All cells that are not blocked are connected, diagonal steps not needed."""
    classes = _classes(shape, rng)
    mud = _muddy(classes, shape.mud_share, rng)
    picture = _photograph(shape, classes, mud, rng)
    terrain, maze = (
        np.kron(layer, np.ones((shape.pixel_cells, shape.pixel_cells), dtype=layer.dtype))
        for layer in (classes, (classes == FOREST) | mud)
    )
    blocked = (terrain == WATER) | _walls(shape, terrain, maze.astype(bool), rng)
    return TerrainMap(terrain, blocked | ~_largest(~blocked), picture)


def _classes(shape: TerrainShape, rng: np.random.Generator) -> Classes:
    """Return the class of each pixel: water and forest where slow noise is high, sand elsewhere, roads over all."""
    region = shape.region_cells // shape.pixel_cells
    wet, green = (_slow_noise(shape.pixels, shape.blob_regions * region, rng) for _ in range(2))
    classes = np.full(wet.shape, SAND, dtype=np.uint8)
    water = wet > np.quantile(wet, 1.0 - shape.water_share)
    if shape.water_share < 1.0:
        classes[green > np.quantile(green[~water], 1.0 - shape.forest_share / (1.0 - shape.water_share))] = FOREST
    classes[water] = WATER
    for axis in range(2):
        for first, last in _roads(shape, rng):
            strip = slice(first * region, last * region)
            classes[(strip, slice(None)) if axis == 0 else (slice(None), strip)] = PAVEMENT
    islands = (classes != WATER) & ~_largest(classes != WATER)
    classes[islands] = WATER
    return classes


def _roads(shape: TerrainShape, rng: np.random.Generator) -> list[tuple[int, int]]:
    """Return first and last (excluded) region of each road along one axis, at least two regions from one another."""
    found: list[tuple[int, int]] = []
    for _ in range(int(rng.integers(1, shape.roads + 1))):
        width = int(rng.integers(1, 3))
        first = int(rng.integers(0, shape.regions - width + 1))
        if all(first >= stop + 2 or first + width + 2 <= begin for begin, stop in found):
            found.append((first, first + width))
    return found


def _slow_noise(side: int, deviation: float, rng: np.random.Generator) -> NDArray[np.float64]:
    smooth: NDArray[np.float64] = gaussian_filter(rng.normal(size=(side, side)), deviation, mode="reflect")
    scaled: NDArray[np.float64] = (smooth - smooth.mean()) / max(float(smooth.std()), 1e-12)
    return scaled


def _muddy(classes: Classes, share: float, rng: np.random.Generator) -> Mask:
    """Return the sand that is mud: whole patches, each with probability ``share``."""
    patches, count = label(classes == SAND)
    chosen = np.concatenate([[False], rng.random(count) < share])
    found: Mask = chosen[patches]
    return found


def _photograph(shape: TerrainShape, classes: Classes, mud: Mask, rng: np.random.Generator) -> NDArray[np.uint8]:
    seen = _COLOURS[classes]
    seen[mud] *= 0.9
    region = shape.region_cells // shape.pixel_cells
    light = shape.shading * _slow_noise(shape.pixels, 3.0 * region, rng)
    noisy = seen + light[..., np.newaxis] + rng.normal(scale=shape.noise, size=seen.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def _walls(shape: TerrainShape, terrain: Classes, maze: Mask, rng: np.random.Generator) -> Mask:
    """Return the walls of the mazes: [cells, cols].

    A lattice of square places with walls between them covers the world. A piece of wall between two places stands if
    all of it is maze; of those that stand a random spanning tree over the connected ground is opened, so that every
    place is reached, and ``opened_share`` of the others.
    """
    pitch, free = shape.corridor_cells + shape.wall_cells, shape.corridor_cells
    count = -(-shape.cells // pitch)
    margin = (0, count * pitch - shape.cells)
    inside = np.pad(maze, (margin, margin))
    on_line = np.arange(count * pitch) % pitch >= free
    walls = inside & (on_line[:, np.newaxis] | on_line)
    in_pieces = (count, pitch, count, pitch)
    # Pieces that part neighbours along x, and along y: [2, count, count]; views of the same walls.
    views = [walls.reshape(in_pieces)[:, :free, :, free:], walls.reshape(in_pieces)[:, free:, :, :free]]
    standing = np.stack([view.all(axis=(1, 3)) for view in views])
    for view, stands in zip(views, standing, strict=True):
        view &= stands[:, np.newaxis, :, np.newaxis]
    parts, most = label(np.pad(terrain != WATER, (margin, margin)) & ~walls)
    here = parts.reshape(in_pieces)
    middle = free // 2
    sides = np.zeros((2, count, count, 2), dtype=np.int64)
    sides[0, ..., 0], sides[1, ..., 0] = here[:, middle, :, free - 1], here[:, free - 1, :, middle]
    sides[0, :, :-1, 1], sides[1, :-1, :, 1] = here[:, middle, 1:, 0], here[1:, 0, :, middle]
    closed = standing.copy()
    closed[standing] = ~_opened(sides[standing], most, shape.opened_share, rng)
    for view, stands in zip(views, closed, strict=True):
        view &= stands[:, np.newaxis, :, np.newaxis]
    return walls[: shape.cells, : shape.cells]


def _opened(sides: NDArray[np.int64], parts: int, share: float, rng: np.random.Generator) -> Mask:
    """Return which pieces are opened: [pieces]. sides: [pieces, 2] the parts on both sides, 0 for none."""
    opened = rng.random(len(sides)) < share
    order = rng.permutation(len(sides))
    useful = order[(sides[order].min(axis=1) > 0) & (sides[order, 0] != sides[order, 1])]
    pairs = np.sort(sides[useful], axis=1)
    _, first = np.unique(pairs, axis=0, return_index=True)  # of several pieces between two parts, one
    chosen = useful[first]
    rank = np.empty(len(sides))
    rank[order] = np.arange(1.0, len(sides) + 1.0)
    graph = coo_array((rank[chosen], (sides[chosen, 0], sides[chosen, 1])), shape=(parts + 1, parts + 1))
    tree = minimum_spanning_tree(graph.tocsr())
    in_tree = np.isin(rank, tree.tocoo().data.astype(np.float64)) if tree.nnz else np.zeros(len(sides), dtype=bool)
    result: Mask = (opened | in_tree) & (sides.min(axis=1, initial=1) > 0) if len(sides) else opened
    return result


def _largest(ground: Mask) -> Mask:
    """Return the largest 4-connected part of ``ground``."""
    parts, count = label(ground)
    if not count:
        return ground
    found: Mask = parts == 1 + int(np.argmax(np.bincount(parts.ravel())[1:]))
    return found


def _demand(key: str, value: object, holds: bool, expected: str) -> None:
    require(holds, f"plans.source_settings.{key}", value, expected)
