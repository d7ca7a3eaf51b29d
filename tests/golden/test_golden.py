"""Drives through drawn worlds stay what they were."""

import json

import pytest

from tests.golden.write import FOLDER, WORLDS, episodes


@pytest.mark.parametrize("name", sorted(WORLDS))
def test_the_drive_is_the_golden_one(name: str) -> None:
    assert episodes(name) == json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
