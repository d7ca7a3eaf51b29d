import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from pipeline.errors import TableError
from pipeline.evaluation.trials import (
    TRIALS,
    EpisodeRow,
    competitors_in,
    digest,
    episodes_table,
    read_episodes,
    read_trials,
    trial_rows,
    trials_table,
    write_episodes,
    write_trials,
)
from pipeline.files import write_sum, write_table
from tests.evaluation.rows import table_of, trial

ROWS = [trial("b/0", "learned", 2.5), trial("a/0", "optimistic", 4.0), trial("a/0", "learned", 3.0)]


def an_episode(**changes: object) -> EpisodeRow:
    truth = np.array([[1, 1, 1], [1, 0, 1]], dtype=np.uint8)
    row = EpisodeRow(
        "a/0", "learned", "a", 0.1, 0.0, 0.0, truth, truth * 2, [1, 1], np.array([1, 1]), [0], [1], [1], [0.5], 1.5,
        1, 1, 1, 1,
    )  # fmt: skip
    return row._replace(**changes)  # type: ignore[arg-type]


def test_trials_come_back_sorted_and_whole(tmp_path: Path) -> None:
    write_trials(tmp_path / "trials.parquet", ROWS)
    found = trial_rows(read_trials(tmp_path / "trials.parquet"))
    assert found == sorted(ROWS, key=lambda row: (row.trial_id, row.competitor))


def test_episodes_come_back_with_maps_and_paths(tmp_path: Path) -> None:
    write_episodes(tmp_path / "episodes.parquet", [an_episode()])
    (found,) = read_episodes(tmp_path / "episodes.parquet")
    assert found.truth.tolist() == [[1, 1, 1], [1, 0, 1]]
    assert found.known.tolist() == [[2, 2, 2], [2, 0, 2]]
    assert (list(found.path_row), list(found.frontier_p), found.cost_m) == ([1, 1], [0.5], 1.5)


def test_units_and_frames_are_in_the_schema() -> None:
    assert TRIALS.schema.field("cost_m").metadata == {b"unit": b"m"}
    assert TRIALS.schema.field("goal_y_m").metadata == {b"unit": b"m", b"frame": b"world"}


def test_digest_leaves_out_seconds_and_order_but_nothing_else() -> None:
    whole = digest(trials_table(ROWS))
    assert digest(trials_table([row._replace(seconds=9.0) for row in reversed(ROWS)])) == whole
    for name, value in {"cost_m": 3.1, "ending": "cut_off", "steps": 11, "building": "c"}.items():
        assert digest(trials_table([ROWS[0], ROWS[1], ROWS[2]._replace(**{name: value})])) != whole


def test_digest_does_not_depend_on_chunks(tmp_path: Path) -> None:
    table = trials_table(ROWS)
    chunked = pa.concat_tables([table.slice(0, 1), table.slice(1)])
    assert digest(chunked) == digest(table)


def test_competitors_come_by_role_and_place() -> None:
    names = ("known_map", "perfect", "zigzag", "learned", "optimistic")
    found = competitors_in(table_of({name: [1.0] for name in names}))
    assert [entry.name for entry in found] == ["optimistic", "learned", "zigzag", "perfect", "known_map"]
    assert [entry.role for entry in found] == ["baseline", "candidate", "candidate", "bound", "bound"]
    assert found[4].title == "known map"


def test_a_table_without_one_baseline_is_refused() -> None:
    with pytest.raises(TableError, match=r"the competitors in the role baseline are \[\], expected exactly one"):
        competitors_in(table_of({"learned": [1.0]}))


BAD_TRIALS = {
    "twice": ([ROWS[0], ROWS[0]], "'b/0' of competitor 'learned' comes twice"),
    "ending": ([ROWS[0]._replace(ending="lost")], "ended 'lost', expected one of"),
    "nan": ([ROWS[0]._replace(cost_m=float("nan"))], "costs nan m, expected a finite distance"),
    "negative": ([ROWS[0]._replace(cost_m=-1.0)], "costs -1.0 m"),
    "type": ([ROWS[0]._replace(steps="many")], "does not have the type of its schema"),
    "null": ([ROWS[0]._replace(building=None)], "column 'building' holds a null"),
}


@pytest.mark.parametrize("case", BAD_TRIALS)
def test_bad_trials_are_refused(case: str) -> None:
    rows, message = BAD_TRIALS[case]
    with pytest.raises(TableError, match=message):
        trials_table(rows)


def test_maps_of_an_episode_must_fit() -> None:
    with pytest.raises(TableError, match=r"truth \(2, 3\) and known \(3, 3\)"):
        episodes_table([an_episode(known=np.zeros((3, 3), np.uint8))])


def test_a_missing_file_names_the_stage(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"trials.parquet: no such file.*dvc repro evaluate"):
        read_trials(tmp_path / "trials.parquet")


def test_another_table_is_refused(tmp_path: Path) -> None:
    write_trials(tmp_path / "trials.parquet", ROWS)
    with pytest.raises(TableError, match="'trials' version 2, this code reads table 'episodes' version 2"):
        read_episodes(tmp_path / "trials.parquet")


def test_another_version_is_refused(tmp_path: Path) -> None:
    stamp = json.dumps({"table": "trials", "version": 99})
    write_table(tmp_path / "t.parquet", trials_table(ROWS).replace_schema_metadata({b"hinterland": stamp}))
    with pytest.raises(TableError, match="version 99, this code reads"):
        read_trials(tmp_path / "t.parquet")


def test_a_torn_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "trials.parquet"
    write_trials(path, ROWS)
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(TableError, match=r"trials.parquet is damaged"):
        read_trials(path)
    write_sum(path)
    with pytest.raises(TableError, match="not a readable parquet file"):
        read_trials(path)


def test_a_damaged_map_is_refused(tmp_path: Path) -> None:
    table = episodes_table([an_episode()])
    index = table.schema.get_field_index("truth")
    torn = table.set_column(index, table.schema.field(index), pa.array([b"not zlib"], pa.binary()))
    write_table(tmp_path / "episodes.parquet", torn)
    with pytest.raises(TableError, match=r"map 'truth' of trial 'a/0' is not 2 x 3"):
        read_episodes(tmp_path / "episodes.parquet")
