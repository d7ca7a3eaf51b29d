"""Plans of several folders, each with its split; one split for all; splits of a manifest; no divided building."""

from pathlib import Path

import pytest
from omegaconf import OmegaConf

from pipeline.errors import ConfigError, HinterlandError, PlanError
from pipeline.floorplans.store import read_plans
from pipeline.stages.plans import plans
from pipeline.stages.rasterize import rasterize
from pipeline.stages.roots import RootsConfig
from tests.floorplans.samples import write_npz
from tests.stages.test_plans_stage import FLOORS, config


def folder(path: Path, *names: str, manifest: str = "") -> str:
    for name in names:
        write_npz(path / f"{name}.npz")
    if manifest:
        (path / "manifest.csv").write_text(manifest, encoding="utf-8")
    return str(path)


def read(tmp_path: Path, **section: object) -> dict[str, tuple[str, str | None]]:
    raw = config(tmp_path / "a", plans={"source": "files", "reader": "mit_campus_grids"} | section, rasterize=FLOORS)
    plans(raw)
    found = read_plans(tmp_path / "a/plans/plans.parquet")
    return {plan.plan_id: (plan.building, plan.split) for plan, _ in found}


def test_each_folder_gives_its_plans_a_split(tmp_path):
    roots = {
        "train": [folder(tmp_path / "one", "1-1_1", "1-2_1"), folder(tmp_path / "two", "2-1_1")],
        "validation": folder(tmp_path / "three", "3-1_1"),
        "test": folder(tmp_path / "four", "4-1_1"),
    }
    found = read(tmp_path, roots=roots)
    assert found == {
        "1-1_1": ("MIT-1", "train"),
        "1-2_1": ("MIT-1", "train"),
        "2-1_1": ("MIT-2", "train"),
        "3-1_1": ("MIT-3", "validation"),
        "4-1_1": ("MIT-4", "test"),
    }


def test_equal_names_in_two_folders_are_told_by_the_folders(tmp_path):
    train = folder(tmp_path / "kth/dev", "7-1_1", manifest="file,building\n7-1_1.npz,K\n")
    test = folder(tmp_path / "mit/dev", "7-1_1", manifest="file,building\n7-1_1.npz,M\n")
    assert read(tmp_path, roots={"train": train, "test": test}) == {
        "kth.dev.7-1_1": ("K", "train"),
        "mit.dev.7-1_1": ("M", "test"),
    }


def test_a_building_in_folders_of_two_splits_is_refused_with_both_plans(tmp_path):
    roots = {"train": folder(tmp_path / "one", "7-1_1"), "test": folder(tmp_path / "two", "7-2_1")}
    with pytest.raises(PlanError, match=r"building MIT-7 is in two splits: plan 7-1_1 \(.*\) in train, plan 7-2_1 \("):
        read(tmp_path, roots=roots)
    assert not (tmp_path / "a/plans").exists()


def test_some_training_buildings_are_set_aside_where_nothing_is_given_for_validation(tmp_path, capsys):
    names = [f"{number}-{floor}_1" for number in range(1, 6) for floor in (1, 2)]
    roots = {"train": folder(tmp_path / "one", *names), "test": folder(tmp_path / "two", "9-1_1")}
    found = read(tmp_path, roots=roots)
    of_split = {split: {b for b, s in found.values() if s == split} for split in ("train", "validation", "test")}
    assert (len(of_split["train"]), len(of_split["validation"]), of_split["test"]) == (4, 1, {"MIT-9"})
    assert not of_split["train"] & of_split["validation"]
    assert "1 of 5 buildings of plans.roots.train are set aside for validation" in capsys.readouterr().out
    assert {split for _, split in read(tmp_path, roots=roots, validation_share=0.0).values()} == {"train", "test"}


def test_a_lone_training_building_is_not_divided(tmp_path, capsys):
    roots = {"train": folder(tmp_path / "one", "1-1_1", "1-2_1")}
    assert {split for _, split in read(tmp_path, roots=roots).values()} == {"train"}
    assert "holds 1 buildings, none can be set aside: give plans.roots.validation" in capsys.readouterr().out


def test_one_key_sends_all_plans_to_a_split_and_counts_what_it_overrules(tmp_path, capsys):
    manifest = "file,building,split\n1-1_1.npz,A,train\n2-1_1.npz,B,train\n3-1_1.npz,C,test\n4-1_1.npz,D,\n"
    root = folder(tmp_path / "one", "1-1_1", "2-1_1", "3-1_1", "4-1_1", manifest=manifest)
    assert {split for _, split in read(tmp_path, root=root, split="test").values()} == {"test"}
    assert "2 plans go to test, as plans.split says; their manifest or file said: train 2" in capsys.readouterr().out


def test_the_splits_of_a_manifest_reach_the_grids_and_the_rest_is_divided(tmp_path, capsys):
    manifest = "file,building,split\n1-1_1.npz,A,test\n2-1_1.npz,B,test\n1-2_1.npz,A,\n"
    root = folder(tmp_path / "one", "1-1_1", "1-2_1", "2-1_1", "3-1_1", "4-1_1", manifest=manifest)
    assert read(tmp_path, root=root)["1-2_1"] == ("A", "test")
    shares = {"shares": {"train": 0.5, "validation": 0.5, "test": 0.0}}
    metrics = rasterize(config(tmp_path / "a", plans={}, rasterize=FLOORS | shares)).metrics
    assert [metrics[f"plans_{split}"] for split in ("train", "validation", "test")] == [1, 1, 3]
    assert "2 buildings have their split, 2 are divided by rasterize.shares" in capsys.readouterr().out


def test_generated_plans_too_go_where_one_key_sends_them(tmp_path):
    mazes = {"counts": {"train": 1, "test": 1}, "maze": {"columns": 3, "rows": 3, "min_path_cells": 3}}
    plans(config(tmp_path, plans=mazes | {"split": "validation"}))
    assert {plan.split for plan, _ in read_plans(tmp_path / "plans/plans.parquet")} == {"validation"}


@pytest.mark.parametrize(
    ("section", "said"),
    [
        ({"roots": {"train": 3}}, "plans.roots.train = 3: expected a folder, file or archive"),
        ({"roots": {"train": []}}, "plans.roots.train = .*: expected a folder"),
        ({"roots": {"dev": "x"}}, r"unknown key plans\.roots\.dev"),
        (
            {"roots": {"train": "x", "test": "x/y"}},
            r"plans\.roots\.test = x/y: expected a place apart from x \(train\)",
        ),
        ({"roots": {"train": ["x", "x"]}}, "expected a place apart"),
        ({"roots": {"train": "x"}, "root": "y"}, "null for each split where plans.root=y"),
        ({"roots": {"train": "x"}, "split": "test"}, "plans.split = test: expected null where plans.roots give"),
        ({"roots": {"test": "gone"}}, r"plans\.roots\.test = gone: no such folder or file"),
        ({"split": "dev"}, "plans.split = dev: expected null or one of train, validation, test"),
        ({"source": "forest", "roots": {"train": "x"}}, "null for each split where plans.source=forest"),
        ({"validation_share": 1.0}, "plans.validation_share = 1.0: expected from 0 to below 1"),
    ],
)
def test_what_cannot_be_meant_is_refused(tmp_path, section, said):
    with pytest.raises(HinterlandError, match=said):
        read(tmp_path, **section)


def test_folders_beside_each_other_are_apart():
    assert len(RootsConfig(train=["data/a", "data/ab"], test="data/b").listed()) == 3
    with pytest.raises(ConfigError):
        RootsConfig(train="data/a", test=str(Path("data/a/b").absolute()))
    assert OmegaConf.structured(RootsConfig).test is None
