"""Distances between gates are those of one search each, asked once or again, from either side."""

import numpy as np
import pytest

from pipeline.grids.distances import DIAGONAL, NOWHERE, open_field, settle, workspace_for
from pipeline.grids.partial_map import BLOCKED, CHANGES, CLEAR, UNSEEN, PartialMap, map_of
from pipeline.planning import gate_distances
from pipeline.planning.gate_distances import GateDistances
from tests.worlds import scattered


def seen_in_part(seed: int) -> PartialMap:
    rng = np.random.default_rng(seed)
    walls = scattered(rng, 30, 34, share=0.15)
    status = np.where(walls == 1, BLOCKED, CLEAR).astype(np.uint8)
    status[1:-1, 20:-1] = np.where(status[1:-1, 20:-1] == CLEAR, UNSEEN, BLOCKED)
    return map_of(walls.copy(), status)


def see(map_: PartialMap, cells: np.ndarray, status: int) -> None:
    for cell in cells:
        map_.status.ravel()[cell] = status
        map_.changes[map_.written[CHANGES]] = cell
        map_.written[CHANGES] += 1


def field_from(map_: PartialMap, cell: int) -> np.ndarray:
    field = open_field(map_.status, CLEAR)
    settle(field, map_.status.shape[1], cell, NOWHERE, workspace_for(field.size))
    return field


@pytest.mark.parametrize("seed", range(10))
def test_pairs_equal_single_searches_as_the_map_grows(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    made = []
    field = gate_distances.MapField
    monkeypatch.setattr(gate_distances, "MapField", lambda *given: made.append(given[2]) or field(*given))
    rng = np.random.default_rng(seed)
    map_ = seen_in_part(seed)
    distances = GateDistances(map_, workspace_for(map_.status.size))
    gates = rng.choice(np.flatnonzero(map_.status.ravel() == CLEAR), 30, replace=False).astype(np.int32)
    for step in range(60):  # old gates vanish, new ones appear: in all more of them than fields are kept
        asked = rng.permutation(gates[step // 3 : step // 3 + 9])[: rng.integers(7, 10)]
        expected = np.stack([field_from(map_, gate)[asked] for gate in asked])
        assert np.array_equal(distances.between(asked), expected)
        unseen = np.flatnonzero(map_.status.ravel() == UNSEEN)
        see(map_, rng.choice(unseen, min(4, unseen.size), replace=False), CLEAR)
        others = np.setdiff1d(np.flatnonzero(map_.status.ravel() == CLEAR), gates)
        see(map_, rng.choice(others, 1), BLOCKED)
    assert 16 < len(made) <= len(gates)


@pytest.mark.parametrize("asked_before", [False, True])
def test_a_path_has_the_length_of_the_distance(asked_before: bool) -> None:
    map_ = seen_in_part(3)
    start, gate = (int(cell) for cell in np.flatnonzero(map_.status.ravel() == CLEAR)[[0, -1]])
    distances = GateDistances(map_, workspace_for(map_.status.size))
    if asked_before:
        for _ in range(2):
            distances.between(np.array([start, gate], dtype=np.int32))
    path = distances.path_between(start, gate)
    rows, cols = np.divmod(path, 34)
    moves = np.where((np.diff(rows) != 0) & (np.diff(cols) != 0), DIAGONAL, 1.0)
    assert (path[0], path[-1]) == (start, gate)
    assert moves.sum() == field_from(map_, gate)[start]
