"""Digests of source code: edited code makes new work."""

import hashlib
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent


def digest_code(*packages: str | Path) -> str:
    """Return the sha256 over the sources of ``packages``: folders or files of ``pipeline`` by name, or any by path.

    Raises ValueError for one that holds no source: a wrong name must not pass for code that never changes.
    """
    total = hashlib.sha256()
    for package in packages:
        place = ROOT / package
        sources = [place] if place.is_file() else sorted(place.rglob("*.py"))
        if not sources:
            raise ValueError(f"{package}: no source under {ROOT}")
        for source in sources:
            total.update(_name(source, place).encode() + source.read_bytes())
    return total.hexdigest()


def folder_of(module: str) -> Path:
    """Return the folder that holds the imported ``module``: all the code it brings along."""
    file = sys.modules[module].__file__
    assert file is not None, f"{module} has no file"
    return Path(file).parent


def digest_part(make: Callable[..., Any]) -> str:
    """Return the sha256 of the folder of a factory's module where that lies in a package, else of its file alone."""
    module = make.__module__
    if "." in module or getattr(sys.modules.get(module), "__path__", None):
        return digest_code(folder_of(module))
    try:
        return hashlib.sha256(Path(inspect.getfile(make)).read_bytes()).hexdigest()
    except TypeError:  # built in: it changes with the interpreter alone
        return ""


def _name(source: Path, folder: Path) -> str:
    """Return how a digest names ``source``: not by where the checkout lies."""
    inside = source.is_relative_to(ROOT)
    return source.relative_to(ROOT if inside else folder).as_posix()
