"""Archives made in the tests, and what becomes of them."""

import zipfile
from pathlib import Path

import pytest

from pipeline.errors import PlanError
from pipeline.floorplans.sources import open_source


def pack(path: Path, *members: tuple[str | zipfile.ZipInfo, bytes]) -> Path:
    """Write a zip file whose names are stored as they are given."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members:
            archive.writestr(name, content)
    return path


def changed(path: Path, old: bytes, new: bytes) -> Path:
    """Change the bytes of a file wherever they stand."""
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))
    return path


def below(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")}


def contents(root: Path, **options: int) -> dict[str, bytes]:
    with open_source(root, **options) as files:
        assert not [file.problem for file in files if file.problem]
        return {file.name: file.path.read_bytes() for file in files}


def refusal(root: Path, **options: int) -> str:
    """Why ``root`` is not unpacked; the same below a folder, where it stays in the list with its problem."""
    with pytest.raises(PlanError) as refused, open_source(root, **options):
        pytest.fail("it was unpacked")
    with open_source(root.parent, **options) as files:
        (file,) = [file for file in files if file.path == root]
    assert str(file.problem) == str(refused.value)
    assert str(refused.value).startswith(f"{root}: ")
    return str(refused.value)
