"""Parts by name: ours and anybody's; whatever is wrong with one is a sentence that names it."""

from pathlib import Path
from typing import Protocol, runtime_checkable

import pytest

from pipeline.errors import ConfigError, PartError
from pipeline.parts import add_to_path, find_part, make_part, named
from pipeline.source_code import digest_part

KNOWN = {"counter": "collections:Counter", "path": "pathlib:PurePosixPath"}


@runtime_checkable
class Walker(Protocol):
    stride_m: float

    def walk(self) -> str: ...


OWN = """
from dataclasses import dataclass

@dataclass(frozen=True)
class Settings:
    stride_m: float = 0.7

class Tall:
    def __init__(self, settings: Settings, seed: int):
        self.stride_m, self.seed = settings.stride_m, seed
    def walk(self):
        return "far"

class Lame:
    stride_m = 0.0

class Untyped:
    def __init__(self, settings: dict):
        pass

def broken(settings: Settings):
    return 1 / 0
"""


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    name = f"own_{tmp_path.name.replace('-', '_')}"
    (tmp_path / f"{name}.py").write_text(OWN, encoding="utf-8")
    (tmp_path / "failing.py").write_text("import no_such_library_at_all\n", encoding="utf-8")
    (tmp_path / "crooked.py").write_text("value = [][3]\n", encoding="utf-8")
    monkeypatch.setattr("sys.path", ["keep", *__import__("sys").path])
    add_to_path(tmp_path)
    return name


def test_a_name_of_ours_and_a_place_take_the_same_way() -> None:
    ours, place = find_part("a.use", "counter", KNOWN), find_part("a.use", "collections:Counter", KNOWN)
    assert ours.make is place.make
    assert ours.settings is None


def test_an_own_part_takes_its_settings_and_what_it_asks_for(own: str) -> None:
    part = find_part("a.use", f"{own}:Tall", KNOWN)
    assert part.settings is not None
    made = make_part(part, part.settings(stride_m=0.9), expected=Walker, seed=4, world="not asked for")
    assert (made.stride_m, made.seed, made.walk()) == (0.9, 4, "far")


@pytest.mark.parametrize(
    ("use", "expected"),
    [
        (
            "countr",
            "a.use = countr: no part of that name. Did you mean counter? Expected one of counter, path, or your",
        ),
        ("no_module_here:Thing", "no module 'no_module_here'. Expected package.module:attribute, its folder named by"),
        ("{own}:Tal", "has no 'Tal'. Did you mean Tall?"),
        ("{own}:Untyped", "its parameter `settings` is annotated <class 'dict'>, expected a frozen dataclass"),
        ("{own}:Lame.stride_m", "a float, expected a class or a function that makes the part"),
    ],
)
def test_a_wrong_name_is_refused(own: str, use: str, expected: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        find_part("a.use", use.format(own=own), KNOWN)
    assert expected in str(refusal.value)


@pytest.mark.parametrize(
    ("use", "expected"),
    [
        ("failing:Thing", "cannot be imported: ModuleNotFoundError: No module named 'no_such_library_at_all'"),
        ("crooked:Thing", "cannot be imported: IndexError: list index out of range (crooked.py, line 1)"),
    ],
)
def test_a_module_that_fails_is_named_with_its_line(own: str, use: str, expected: str) -> None:
    with pytest.raises(PartError) as refusal:
        find_part("a.use", use, KNOWN)
    assert expected in str(refusal.value)


def test_a_factory_that_fails_or_makes_something_else_is_named(own: str) -> None:
    broken = find_part("a.use", f"{own}:broken", KNOWN)
    assert broken.settings is not None
    with pytest.raises(PartError, match=rf"a.use = {own}:broken failed: ZeroDivisionError: .*{own}.py, line 22"):
        make_part(broken, broken.settings(), expected=Walker)
    with pytest.raises(PartError, match="made a Lame without walk: expected a Walker"):
        make_part(find_part("a.use", f"{own}:Lame", KNOWN), expected=Walker)


def test_what_fails_inside_a_part_names_it_and_what_we_refuse_stays_as_it_is() -> None:
    with pytest.raises(PartError, match=r"mine failed: KeyError: 'x' \(test_parts.py, line \d+\)"), named("mine"):
        raise KeyError("x")
    with pytest.raises(ConfigError, match="as it is"), named("mine"):
        raise ConfigError("as it is")


def test_the_digest_follows_the_source(own: str, tmp_path: Path) -> None:
    part = find_part("a.use", f"{own}:Tall", KNOWN)
    before = digest_part(part.make)
    assert before == digest_part(find_part("a.use", f"{own}:Lame", KNOWN).make)
    (tmp_path / f"{own}.py").write_text(OWN + "# edited\n", encoding="utf-8")
    assert digest_part(part.make) != before
