"""Guided mazes: in a random maze, the corridors from start to goal are twice as wide as all others.

Source: Stein, Bradley, Roy, "Learning over Subgoals for Efficient Navigation of Structured, Unknown
Environments", CoRL 2018, section 5 (guided maze, generated with Kruskal's algorithm).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import shortest_path
from shapely.geometry import MultiPolygon, Polygon

from pipeline.floorplans.generators.demand import demand
from pipeline.floorplans.plan import Bounds, FloorPlan, Location

ENVIRONMENT = "guided_maze"
WIDENING = 2.0  # wide corridor over narrow corridor, from the paper

_MOST_TREES = 200  # trees drawn before giving up on a path of the asked length

Edges = NDArray[np.int64]  # [edges, 2] pairs of neighbouring maze nodes; node = row * columns + column


@dataclass(frozen=True, kw_only=True)
class MazeShape:
    """Size of a guided maze. The defaults give 144 x 188 cells at 0.3 m, closed outermost ring included.

    columns, rows: maze nodes along x and y. pitch_m: distance between neighbouring nodes [m].
    corridor_m: width of a corridor off the path [m]; those on it are ``widening`` times as wide.
    loops: share of the corridors missing from the tree that are opened as well: 0 for a maze without a loop, 1 for
    the whole lattice. wall_m: wall around the maze [m]. min_path_cells: fewest corridors between start and goal.
    jitter_m: start and goal are moved by up to this much from their node along x and y [m].
    """

    columns: int = 6
    rows: int = 8
    pitch_m: float = 6.6
    corridor_m: float = 2.4
    widening: float = WIDENING
    loops: float = 0.0
    wall_m: float = 1.5
    min_path_cells: int = 4
    jitter_m: float = 0.9

    def __post_init__(self) -> None:
        """Refuse impossible values; the ConfigError names the key."""
        wide = self.widening * self.corridor_m
        _demand("columns", self.columns, self.columns >= 2, "at least 2")
        _demand("rows", self.rows, self.rows >= 2, "at least 2")
        _demand("corridor_m", self.corridor_m, self.corridor_m > 0, "above 0 m")
        _demand("widening", self.widening, self.widening >= 1, "at least 1")
        _demand("loops", self.loops, 0 <= self.loops <= 1, "a share from 0 to 1")
        _demand("pitch_m", self.pitch_m, self.pitch_m > wide, f"above {wide:g} m, or two wide corridors touch")
        _demand("wall_m", self.wall_m, self.wall_m >= 0, "at least 0 m")
        most = self.columns * self.rows - 1
        _demand("min_path_cells", self.min_path_cells, 1 <= self.min_path_cells <= most, f"between 1 and {most}")
        fits = 0 <= self.jitter_m < wide / 2
        _demand("jitter_m", self.jitter_m, fits, f"from 0 to less than {wide / 2:g} m, half a wide corridor")


def draw_guided_maze(
    shape: MazeShape, rng: np.random.Generator, *, plan_id: str, split: str | None = None
) -> FloorPlan:
    """Draw one maze; ``rng`` is consumed. Start and goal are at least ``shape.min_path_cells`` corridors apart.

    Raises:
        ConfigError: mazes of this size hardly ever have a path that long.
    """
    for _ in range(_MOST_TREES):
        edges = open_loops(spanning_tree(shape.columns, shape.rows, rng), shape, rng)
        path = draw_path(edges, shape.min_path_cells, rng)
        if path:
            break
    _demand("min_path_cells", shape.min_path_cells, bool(path), f"less: none of {_MOST_TREES} mazes had such a path")
    on_path = {frozenset(step) for step in pairwise(path)}
    widening = [shape.widening if frozenset(edge) in on_path else 1.0 for edge in edges.tolist()]
    centers = node_centers(shape)
    start, goal = centers[[path[0], path[-1]]] + rng.uniform(-shape.jitter_m, shape.jitter_m, size=(2, 2))
    walls = 2 * shape.wall_m
    return FloorPlan(
        plan_id=plan_id,
        building=plan_id,
        floor=plan_id,
        environment=ENVIRONMENT,
        source="generator guided_maze",
        split=split,
        endpoints=(Location(*start.tolist()), Location(*goal.tolist())),
        free=corridors(centers[edges], shape.corridor_m * np.array(widening)),
        bounds=Bounds(0.0, 0.0, shape.columns * shape.pitch_m + walls, shape.rows * shape.pitch_m + walls),
    )


def spanning_tree(columns: int, rows: int, rng: np.random.Generator) -> Edges:
    """Return a random spanning tree of the maze nodes (Kruskal, edges in random order); ``rng`` is consumed."""
    parent = list(range(rows * columns))

    def root(node: int) -> int:
        while parent[node] != node:
            parent[node] = parent[parent[node]]
            node = parent[node]
        return node

    tree = []
    for a, b in rng.permutation(lattice(columns, rows)).tolist():
        if root(a) != root(b):
            parent[root(a)] = root(b)
            tree.append((a, b))
    return np.array(tree, dtype=np.int64)


def lattice(columns: int, rows: int) -> Edges:
    """Return all pairs of neighbouring nodes, the lower node first: those along x, then those along y."""
    nodes = np.arange(rows * columns).reshape(rows, columns)
    across = np.stack([nodes[:, :-1].ravel(), nodes[:, 1:].ravel()], axis=1)
    along = np.stack([nodes[:-1].ravel(), nodes[1:].ravel()], axis=1)
    return np.concatenate([across, along])


def open_loops(tree: Edges, shape: MazeShape, rng: np.random.Generator) -> Edges:
    """Return the tree with ``shape.loops`` of the edges it lacks; each of them closes a loop.

    ``rng`` is consumed only where there are any, so that mazes without loops stay what they are.
    """
    kept = {tuple(edge) for edge in tree.tolist()}
    missing = np.array([edge for edge in lattice(shape.columns, shape.rows).tolist() if tuple(edge) not in kept])
    count = round(shape.loops * len(missing))
    return np.concatenate([tree, rng.permutation(missing)[:count]]) if count else tree


def draw_path(edges: Edges, min_edges: int, rng: np.random.Generator) -> list[int]:
    """Draw two nodes at least ``min_edges`` apart and return a shortest path; empty when there are none.

    All ordered pairs that are far enough apart are equally likely; ``rng`` is consumed.
    """
    size = int(edges.max()) + 1
    links = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(size, size))
    steps, previous = shortest_path(links, directed=False, unweighted=True, return_predecessors=True)
    far = np.argwhere(steps >= min_edges)
    if not len(far):
        return []
    start, node = rng.choice(far).tolist()
    path = [node]
    while node != start:
        node = int(previous[start, node])
        path.append(node)
    return path[::-1]


def node_centers(shape: MazeShape) -> NDArray[np.float64]:
    """Return the middle of every maze node: [nodes, 2] as x, y [m]."""
    row, column = np.divmod(np.arange(shape.rows * shape.columns), shape.columns)
    return shape.wall_m + (np.stack([column, row], axis=1) + 0.5) * shape.pitch_m


def corridors(lines: NDArray[np.float64], widths: Sequence[float] | NDArray[np.float64]) -> Polygon | MultiPolygon:
    """Return the union of axis-parallel corridors with square ends.

    lines: [corridors, 2, 2] both ends of each centre-line as x, y [m]; widths: [corridors] full widths [m].
    """
    half = np.asarray(widths)[:, np.newaxis] / 2
    low, high = lines.min(axis=1) - half, lines.max(axis=1) + half
    return shapely.union_all(shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1]))


def _demand(key: str, value: float, holds: bool, allowed: str) -> None:
    demand(f"maze.{key}", value, holds, allowed)
