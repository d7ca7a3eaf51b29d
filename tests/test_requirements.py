"""What may be installed: releases known to be malicious are excluded, and the pinned set meets what is asked for."""

import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
ASKED = {found.name.lower(): found for found in map(Requirement, PROJECT["dependencies"])}
PINNED = dict(
    line.strip().lower().split("==")
    for line in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    if "==" in line and not line.startswith("#")
)


@pytest.mark.parametrize("version", ["2.6.2", "2.6.3"])  # GHSA-w37p-236h-pfx3
def test_malicious_uploads_of_lightning_are_excluded(version: str) -> None:
    assert version not in ASKED["lightning"].specifier
    assert version not in {PINNED["lightning"], PINNED["pytorch-lightning"]}


@pytest.mark.parametrize("name", sorted(ASKED))
def test_every_dependency_is_pinned_to_a_version_that_is_asked_for(name: str) -> None:
    assert PINNED[name] in ASKED[name].specifier
