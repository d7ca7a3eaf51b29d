import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import shapely
from omegaconf import DictConfig, OmegaConf

from pipeline.errors import ConfigError, HinterlandError, PlanError, TableError, TrialError
from pipeline.files import write_json
from pipeline.floorplans.checks import Checked, inspect
from pipeline.floorplans.generators import GENERATORS
from pipeline.floorplans.plan import FREE, Door, Location
from pipeline.floorplans.readers import ReadOptions
from pipeline.floorplans.store import read_plans, write_plans
from pipeline.grids.store import read_pairs, read_worlds
from pipeline.stages.plans import plans
from pipeline.stages.rasterize import rasterize
from pipeline.stages.reading import ReadConfig
from tests.floorplans.samples import ELL, KNOWN, floor_plan, grid_plan, write_map, write_npz

MAZES = {"counts": {"train": 3, "validation": 1, "test": 2}, "maze": {"columns": 3, "rows": 3, "min_path_cells": 3}}
GRIDS = {"resolution_m": 0.3, "min_distance_m": 5.0, "pairs_per_plan": {"train": 3, "validation": 1, "test": 2}}
FLOORS = {"resolution_m": 0.5, "min_distance_m": 3.0, "narrow_doors": "keep"}


def config(folder: Path, *, workers: int = 1, radius: float = 0.3, **sections) -> DictConfig:
    root = {"seed": 0, "artifacts": str(folder), "execution": {"workers": workers, "progress": False}}
    return OmegaConf.create(root | {"robot": {"radius_m": radius, "step_m": 0.5}} | sections)


def files_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*") if path.is_file())


def test_mazes_go_from_the_generator_to_pairs(tmp_path):
    raw = config(tmp_path, plans=MAZES, rasterize=GRIDS)
    assert plans(raw).metrics == {"plans": 6, "buildings": 6, "warned": 0, "rejected": 0}
    metrics = rasterize(raw).metrics
    assert (metrics["pairs_train"], metrics["pairs_validation"], metrics["pairs_test"]) == (9, 1, 4)
    assert metrics["connected_share"] == 1.0
    pairs = {pair.pair_id: pair for pair in read_pairs(tmp_path / "rasterize")}
    there, back, sampled = (pairs[f"maze-train-00000/{k}"] for k in range(3))
    assert (back.start, back.goal, back.known_map_m) == (there.goal, there.start, there.known_map_m)
    assert sampled.known_map_m >= 5.0
    assert {world.split for world in read_worlds(tmp_path / "rasterize")} == {"train", "validation", "test"}


@pytest.mark.parametrize("source", GENERATORS)
def test_every_generator_draws_plans_that_make_trials(tmp_path, source):
    counts = {"train": 1, "validation": 1, "test": 2}
    raw = config(tmp_path, radius=0.15, plans={"source": source, "counts": counts}, rasterize=GRIDS)
    raw.rasterize.narrow_doors = "keep"
    assert plans(raw).metrics == {"plans": 4, "buildings": 4, "warned": 0, "rejected": 0}
    metrics = rasterize(raw).metrics
    assert (metrics["pairs_train"], metrics["pairs_test"]) == (3, 4)
    assert metrics["connected_share"] > 0.99
    section = GENERATORS[source].section
    assert {plan.plan_id for plan, _ in read_plans(tmp_path / "plans/plans.parquet")} == {
        f"{section}-{split}-{k:05d}" for split, count in counts.items() for k in range(count)
    }


def test_plans_of_one_name_get_their_folder_in_front(tmp_path):
    for part in "ab":
        write_npz(tmp_path / "in" / part / "1-1_7.npz")
    write_npz(tmp_path / "in" / "b" / "1-2_7.npz")
    plans(config(tmp_path / "out", plans={"source": "files", "root": str(tmp_path / "in")}))
    found = read_plans(tmp_path / "out" / "plans" / "plans.parquet")
    assert sorted(plan.plan_id for plan, _ in found) == ["1-2_7", "a.1-1_7", "b.1-1_7"]


def test_the_number_of_workers_changes_no_byte(tmp_path):
    for workers in (1, 2):
        raw = config(tmp_path / str(workers), workers=workers, plans=MAZES, rasterize=GRIDS)
        plans(raw)
        rasterize(raw)
    for name in ("plans/plans.parquet", "rasterize/grids.parquet", "rasterize/pairs.parquet"):
        assert (tmp_path / "1" / name).read_bytes() == (tmp_path / "2" / name).read_bytes()


def test_more_mazes_keep_the_first_ones(tmp_path):
    for name, count in (("few", 2), ("many", 4)):
        plans(config(tmp_path / name, plans=MAZES | {"counts": {"train": count}}))
    few, many = (read_plans(tmp_path / name / "plans/plans.parquet") for name in ("few", "many"))
    assert all(a.free.equals_exact(b.free, 0) for (a, _), (b, _) in zip(few, many, strict=False))


@pytest.fixture
def campus(tmp_path):
    """Five buildings with two floors and three furniture variants each."""
    for building in ("1", "2", "W3", "E4", "N5"):
        for floor in "12":
            for variant in "789":
                write_npz(tmp_path / "campus" / f"{building}-{floor}_{variant}.npz")
    return tmp_path / "campus"


def test_buildings_are_never_on_two_sides(tmp_path, campus):
    raw = config(tmp_path / "out", radius=0.0, plans={"source": "files", "root": str(campus)}, rasterize=FLOORS)
    assert plans(raw).metrics["plans"] == 30
    rasterize(raw)
    splits = {}
    for world in read_worlds(tmp_path / "out" / "rasterize"):
        splits.setdefault(world.building, set()).add(world.split)
    assert len(splits) == 5
    assert all(len(found) == 1 for found in splits.values())
    assert {split for found in splits.values() for split in found} == {"train", "validation", "test"}


def test_variants_are_limited_and_furniture_can_be_dropped(tmp_path, campus):
    changes = {"variants_per_floor": 1, "drop_clutter": True}
    raw = config(
        tmp_path / "out", radius=0.0, plans={"source": "files", "root": str(campus)}, rasterize=FLOORS | changes
    )
    plans(raw)
    rasterize(raw)
    worlds = read_worlds(tmp_path / "out" / "rasterize")
    assert len(worlds) == 10
    assert all(world.plan_id.endswith("_7") for world in worlds)
    free = sum(letter in ".dc" for line in ELL for letter in line)
    assert (worlds[0].grid.cells == 0).sum() == free


@pytest.mark.parametrize(("keep", "lost"), [(True, False), (False, True)])
def test_floor_lost_to_the_cells_is_told_and_marked_doors_are_kept_open(tmp_path, capsys, keep, lost):
    door = (Door(6.05, 1.8, 0.5),)
    rooms = [shapely.box(0, 0, 6, 4), shapely.box(6.1, 0, 9.1, 4), shapely.box(5.9, 1.55, 6.2, 2.05)]
    drawn = floor_plan(shapely.union_all(rooms), plan_id="hall", doors=door, split="train")
    write_plans(tmp_path / "plans" / "plans.parquet", [Checked(drawn, inspect(drawn))])
    changes = {"resolution_m": 0.3, "narrow_doors": "keep", "min_distance_m": 2.0, "keep_doors_open": keep}
    metrics = rasterize(config(tmp_path, radius=0.15, rasterize=FLOORS | changes)).metrics
    (world,) = read_worlds(tmp_path / "rasterize")
    told = capsys.readouterr().out
    assert world.reachable_m2 == pytest.approx(31, rel=0.03)
    assert (world.lost_m2 > 9) == lost
    assert metrics["plans_with_floor_lost"] == lost
    assert metrics["lost_share_most"] == pytest.approx(world.lost_m2 / world.reachable_m2)
    assert ("warning: plan hall loses 9." in told and "most of it around (" in told) == lost
    assert ("most 0.0% of what is reachable" in told) == (not lost)


def test_bad_files_are_skipped_by_name_or_stop_the_run(tmp_path, campus):
    (campus / "1-1_7.npz").write_bytes(b"PK\x03\x04 cut short")
    given = {"source": "files", "root": str(campus), "reader": "mit_campus_grids"}
    with pytest.raises(PlanError, match=r"1-1_7.npz: not a readable npz"):
        plans(config(tmp_path / "stop", plans=given))
    assert files_in(tmp_path / "stop") == []
    result = plans(config(tmp_path / "skip", plans=given | {"on_error": "skip"}))
    assert (result.metrics["plans"], result.metrics["rejected"]) == (29, 1)
    (bad,) = json.loads((tmp_path / "skip" / "plans" / "rejected.json").read_text())
    assert bad["file"].endswith("1-1_7.npz")
    assert "not a readable npz" in bad["reason"]


def _nothing(folder: Path) -> None:
    pass


def _walls_only(folder: Path) -> None:
    write_npz(folder / "1-1_7.npz", lines=("#####",) * 5)


BAD_PLANS = {
    "missing folder": (_nothing, {}, PlanError, "no such folder or file"),
    "empty folder": (lambda folder: folder.mkdir(), {}, PlanError, "in this folder. Is it the right one?"),
    "empty plan": (_walls_only, {}, PlanError, "the plan is empty, it has no free space"),
    "nothing usable": (
        _walls_only,
        {"on_error": "skip"},
        PlanError,
        "none of 1 files is usable; the first: plan 1-1_7",
    ),
    "nothing matches": (_walls_only, {"glob": "9*"}, PlanError, "plans.glob = 9*: no file below"),
    "pickled npz": (
        lambda folder: write_npz(folder / "1-1_7.npz", occ_grid=np.array([{}], dtype=object)),
        {},
        PlanError,
        "1-1_7.npz: holds pickled objects",
    ),
    "YAML without image": (
        lambda folder: write_map(folder, np.zeros((9, 9), np.uint8), image=None),
        {"reader": "ros_map_server"},
        PlanError,
        "map.yaml: image missing",
    ),
    "unknown reader": (_nothing, {"reader": "dwg"}, ConfigError, "plans.reader = dwg: expected null, one of mit"),
    "no root": (_nothing, {"root": None}, ConfigError, "plans.root is not given: expected the folder or file"),
    "unknown source": (
        _nothing,
        {"source": "sky"},
        ConfigError,
        "plans.source = sky: expected one of guided_maze, forest, office",
    ),
    "unknown key": (_nothing, {"rot": "x"}, ConfigError, "unknown key plans.rot"),
    "no mazes": (_nothing, {"source": "guided_maze"}, ConfigError, "plans.counts"),
}


@pytest.mark.parametrize("case", BAD_PLANS)
def test_bad_plans_give_one_error_and_leave_nothing(tmp_path, case):
    make, changes, error, message = BAD_PLANS[case]
    make(tmp_path / "in")
    raw = config(tmp_path / "out", plans={"source": "files", "root": str(tmp_path / "in")} | changes)
    with pytest.raises(error) as refusal:
        plans(raw)
    assert message in str(refusal.value)
    assert isinstance(refusal.value, HinterlandError)
    assert files_in(tmp_path / "out") == []


BAD_GRIDS = {
    "no plans": (None, {}, TableError, "plans.parquet: no such file. Run `dvc repro plans`"),
    "wrong resolution": (
        {},
        {"resolution_m": 0.3},
        ConfigError,
        "rasterize.resolution_m = 0.3: plan drawn has cells of 0.5",
    ),
    "resolution 0": (
        {},
        {"resolution_m": 0.0},
        ConfigError,
        "rasterize.resolution_m = 0.0: expected 0.01 to 1 m per cell",
    ),
    "resolution NaN": ({}, {"resolution_m": float("nan")}, ConfigError, "rasterize.resolution_m = nan"),
    "resolution -1": ({}, {"resolution_m": -1.0}, ConfigError, "rasterize.resolution_m = -1.0"),
    "closed doors": ({}, {"narrow_doors": "stop"}, ConfigError, "surely keeps it open"),
    "start in a wall": (
        {"endpoints": (Location(0.75, 1.25), Location(1.25, 1.75))},
        {},
        TrialError,
        "plan drawn: the start in cell (row 2, col 0) is in a wall",
    ),
    "goal on furniture": (
        {"endpoints": (Location(1.25, 1.75), Location(1.75, 1.25))},
        {},
        TrialError,
        "plan drawn: the goal in cell (row 2, col 2) is in a wall",
    ),
    "too small": ({}, {"min_distance_m": 99.0}, TrialError, "plan drawn: no start and goal 99 m apart"),
    "nothing usable": (
        {},
        {"min_distance_m": 99.0, "on_error": "skip"},
        PlanError,
        "none of 1 plans can be used; the first: plan drawn",
    ),
    "too few buildings": (
        {"split": None},
        {},
        ConfigError,
        "ask for 3 splits (train, validation, test), but there are only 1 buildings (b)",
    ),
}


@pytest.mark.parametrize("case", BAD_GRIDS)
def test_bad_grids_give_one_error_and_leave_nothing(tmp_path, case):
    given, changes, error, message = BAD_GRIDS[case]
    if given is not None:
        plan = grid_plan(KNOWN, **({"split": "train"} | given))
        write_plans(tmp_path / "plans" / "plans.parquet", [Checked(plan, inspect(plan))])
    raw = config(tmp_path, radius=0.0, rasterize=FLOORS | {"min_distance_m": 0.6} | changes)
    with pytest.raises(error) as refusal:
        rasterize(raw)
    assert message in str(refusal.value)
    assert files_in(tmp_path / "rasterize") == []


def test_a_building_drawn_for_two_splits_is_refused(tmp_path):
    two = [grid_plan(KNOWN, plan_id=split, split=split) for split in ("train", "test")]
    write_plans(tmp_path / "plans" / "plans.parquet", [Checked(plan, inspect(plan)) for plan in two])
    with pytest.raises(PlanError, match="plans of building b were drawn for"):
        rasterize(config(tmp_path, rasterize=FLOORS))


def test_a_failed_run_keeps_what_was_there(tmp_path):
    raw = config(tmp_path, plans=MAZES)
    plans(raw)
    before = (tmp_path / "plans" / "plans.parquet").read_bytes()
    write_json(tmp_path / "plans" / "rejected.json", ["as it was"])
    with pytest.raises(PlanError):
        plans(config(tmp_path, plans={"source": "files", "root": str(tmp_path / "nowhere")}))
    assert (tmp_path / "plans" / "plans.parquet").read_bytes() == before
    assert json.loads((tmp_path / "plans" / "rejected.json").read_text()) == ["as it was"]


def test_configuration_conf_and_readers_have_the_same_options_and_defaults():
    assert ReadConfig().options() == ReadOptions()
    names = [field.name for field in fields(ReadOptions)]
    assert [field.name for field in fields(ReadConfig)] == names
    written = OmegaConf.load(Path(__file__).parents[2] / "conf" / "plans" / "default.yaml")["read"]
    assert dict(written) == {name: getattr(ReadConfig(), name) for name in names}


def test_what_the_configuration_says_reaches_the_reader(tmp_path):
    grey = np.full((40, 60), 254, dtype=np.uint8)
    grey[10:30, 15:45], grey[12:28, 17:43] = 0, 254
    write_map(tmp_path / "maps" / "lab", grey)
    for paper in (False, True):
        given = {"source": "files", "root": str(tmp_path / "maps"), "read": {"paper": paper}}
        artifacts = tmp_path / str(paper)
        assert plans(config(artifacts, plans=given)).metrics["warned"] == int(not paper)
        ((plan, _),) = read_plans(artifacts / "plans/plans.parquet")
        assert (plan.cells == FREE).sum() == 16 * 26 + (0 if paper else 40 * 60 - 20 * 30)
