"""What pages of docs/ show: files to write, commands to run, and outputs."""

import re
from pathlib import Path
from typing import NamedTuple

DOCS = Path(__file__).resolve().parents[2] / "docs"
_FENCE = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    """A fenced block: its language, the word behind it (the file it is to be written to), its text."""

    language: str
    target: str
    text: str


def blocks(page: str) -> list[Block]:
    return [Block(*groups) for groups in _FENCE.findall((DOCS / page).read_text(encoding="utf-8"))]


def write_files(page: str, folder: Path) -> None:
    """Write the files that ``page`` shows below ``folder``."""
    shown = [block for block in blocks(page) if "/" in block.target]
    assert shown
    for block in shown:
        target = folder / block.target
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(block.text, encoding="utf-8")


def commands(page: str, beginning: str) -> list[list[str]]:
    """Return the commands of ``page`` that begin so, split into words."""
    lines = [line for block in blocks(page) if block.language == "sh" for line in block.text.splitlines()]
    return [line.split() for line in lines if line.startswith(beginning)]


def refusals(page: str) -> list[tuple[str, str]]:
    """Return the pairs of what ``page`` gives a competitor and the sentence that refuses it."""
    (text,) = (block.text for block in blocks(page) if block.target == "refused")
    given, said = zip(*(pair.split("\n", 1) for pair in text.strip().split("\n\n")), strict=True)
    return list(zip(given, said, strict=True))
