"""The page on the library: its blocks run one after another, and print what it shows."""

import contextlib
import io
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.docs.pages import DOCS, blocks
from tests.hinterland.networks import write_network


def test_the_blocks_run_in_order_and_print_what_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    subprocess.run([sys.executable, str(DOCS / "make_byo_pictures.py"), "--samples", "incoming"], check=True)
    write_network(tmp_path / "artifacts" / "train" / "network.safetensors")
    shown = blocks("python.md")
    names: dict[str, Any] = {}
    compared, printed = 0, ""
    for block in shown:
        if block.language == "python":
            with contextlib.redirect_stdout(io.StringIO()) as out:
                exec(block.text, names)
            printed = out.getvalue()
        else:
            assert block.language == "text"
            assert printed == block.text
            compared += 1
    assert compared >= 5


def test_the_first_block_says_it_in_ten_lines() -> None:
    first = next(block for block in blocks("python.md") if block.language == "python")
    assert len([line for line in first.text.splitlines() if line]) <= 10
