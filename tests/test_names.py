"""No stage, no shared package and no report names a system, or who drives: those are chosen by configuration."""

import ast
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

from pipeline.systems.system import known_systems

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("stages", "evaluation", "reports", "learning", "tracking", "simulation", "grids", "floorplans", "datums")
"""Shared by all systems. planning is not among them: it holds planners, among them the optimist."""
SOURCES = sorted(
    [
        *(ROOT / "pipeline").glob("*.py"),
        *(file for name in PACKAGES for file in (ROOT / "pipeline" / name).rglob("*.py")),
    ]
)

DRIVERS = ("learned", "optimistic", "perfect", "known_map")

# Names of systems that are words of the field too. They count where they name a system: as a whole text, as a place.
ORDINARY = {"exploration"}

# Where a name may stand, with the reason; a test fails for a line that is no longer needed.
ALLOWED = {
    (
        "pipeline/stages/compose.py",
        "subgoals",
        "pipeline/systems/subgoals",
    ): "the default of Request.system, the demo's",
    ("pipeline/evaluation/driving.py", "known_map", "KnownMap"): "the bound that every system may use by this place",
    **{
        (f"pipeline/{file}.py", "known_map", name): "a distance in the true map: a column of pairs, not who drives"
        for file, names in {
            "evaluation/driving": ("known_map_m",),
            "grids/sampling": ("known_map_m",),
            "grids/store": ("known_map_m",),
            "simulation/practice": ("known_map_distance",),
            "simulation/trial": ("known_map_m",),
            "simulation/world": ("known_map_distance",),
            "stages/rasterize": ("known_map_m",),
        }.items()
        for name in names
    },
}
UNMOVED = {"pipeline/datums": "rows of one system: they move into its folder"}


class Found(NamedTuple):
    """A name in a file: the word, and the identifier or the text that holds it."""

    file: str
    word: str
    within: str


def words_of(text: str) -> list[str]:
    """Return the words of an identifier or a text, in lower case and in the singular."""
    return [word.lower().removesuffix("s") for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", text)]


def holds(text: str, name: str) -> bool:
    """Return whether ``text`` names ``name``."""
    if name in ORDINARY:
        return text == name or bool(re.search(rf"systems[./]{name}\b", text))
    wanted, words = words_of(name), words_of(text)
    return any(words[at : at + len(wanted)] == wanted for at in range(len(words)))


def texts_in(tree: ast.AST) -> Iterator[str]:
    """Yield the identifiers, the modules and the texts of ``tree``; docstrings and comments tell and decide nothing."""
    told = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            told.add(node.value)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in told:
            yield node.value
        for field in ("id", "attr", "arg", "name", "asname", "module"):
            if isinstance(found := getattr(node, field, None), str):
                yield found


def names_in(file: Path, names: Sequence[str]) -> set[Found]:
    place = file.relative_to(ROOT).as_posix()
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return {Found(place, name, text) for text in texts_in(tree) for name in names if holds(text, name)}


@pytest.fixture(scope="module")
def found() -> set[Found]:
    return set().union(*(names_in(file, (*known_systems(), *DRIVERS)) for file in SOURCES))


def test_no_shared_code_names_a_system_or_who_drives(found: set[Found]) -> None:
    left = {entry for entry in found if not entry.file.startswith(tuple(UNMOVED))} - {
        Found(*entry) for entry in ALLOWED
    }
    assert not left, "\n".join(f"{entry.file}: {entry.word!r} in {entry.within!r}" for entry in sorted(left))


def test_what_is_allowed_is_still_there(found: set[Found]) -> None:
    assert {Found(*entry) for entry in ALLOWED} <= found
    assert all(any(entry.file.startswith(folder) for entry in found) for folder in UNMOVED)


@pytest.mark.parametrize("file", ["dvc.yaml", "conf/config.yaml"])
def test_the_pipeline_is_the_same_for_all_systems(file: str) -> None:
    text = re.sub(r"#.*", "", (ROOT / file).read_text(encoding="utf-8"))
    chosen = "- system: subgoals"  # the default of conf/config.yaml, which an experiment overrides
    lines = [line for line in text.splitlines() if line.strip() != chosen]
    assert not [line for line in lines if any(holds(line, name) for name in (*known_systems(), *DRIVERS))]


SEEN = [
    ("from pipeline.systems.subgoals import planner", "pipeline.systems.subgoals"),
    ("import pipeline.systems.subgoals.planner as p", "pipeline.systems.subgoals.planner"),
    ("class SubgoalNet: pass", "SubgoalNet"),
    ("def plan_subgoals(): pass", "plan_subgoals"),
    ("def plan(subgoal): pass", "subgoal"),
    ("x.subgoals_seen = 3", "subgoals_seen"),
    ("f(subgoals=3)", "subgoals"),
    ("if name == 'subgoals': pass", "subgoals"),
    ("f'{x} of subgoal {y}'", " of subgoal "),
]


@pytest.mark.parametrize(("source", "within"), SEEN)
def test_a_name_is_seen_in_whatever_decides(source: str, within: str) -> None:
    assert within in {text for text in texts_in(ast.parse(source)) if holds(text, "subgoals")}


def test_a_name_is_not_seen_in_what_only_tells() -> None:
    telling = '"""Of subgoals."""\n# subgoals\ndef f():\n    """Of subgoals."""\n'
    assert not [text for text in texts_in(ast.parse(telling)) if holds(text, "subgoals")]
    assert not holds("learnt, unlearned", "known_map")
    assert not holds("map_known", "known_map")
    assert holds("KnownMap", "known_map")


def test_a_word_of_the_field_counts_where_it_names_a_system() -> None:
    assert not holds("exploration_m", "exploration")
    assert holds("exploration", "exploration")
    assert holds("pipeline.systems.exploration.contest", "exploration")
