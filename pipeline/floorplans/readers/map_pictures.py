r"""Where the pictures of ROS maps lie: a YAML file names one as it was where the map was saved.

That may be another folder (``../img/map.pgm``), another machine (``/home/robot/maps/map.pgm``), or Windows
(``C:\maps\map.pgm``). A picture that a map names, in whichever folder, is a part of that map and no plan of its own.
"""

import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path, PureWindowsPath

from pipeline.floorplans.readers.json_file import sniff_text

YAML_ENDINGS = (".yaml", ".yml")
_NAMED = re.compile(r"""\bimage["']?\s*:\s*(?:"([^"\n\r]*)"|'([^'\n\r]*)'|([^"'\n\r,}#]+))""")
_MOST_NAMED = 10  # pictures in one file; a map has one
_MOST_PARTS = 6  # of a path, from its end, that may stand below the folder of the map
_LONGEST = 4096  # letters of a path that any system allows
_MOST_FILES = 10_000  # in a folder that is searched for a name in other capitals


def find_picture(path: Path, named: str) -> Path | None:
    """Return the picture that the YAML file ``path`` calls ``named``, or None.

    In this order: where it says; the longest end of its path that exists below the folder of the map, or beside that
    folder; a file beside the map whose name differs in capitals alone.
    """
    if not named or len(named) > _LONGEST or "\0" in named:
        return None
    found = next((place for place in _places(path.parent, named) if _is_file(place)), None)
    return found or _in_other_capitals(path.parent, PureWindowsPath(named).name)


def pictures_named_by(maps: Iterable[Path]) -> frozenset[Path]:
    """Return the resolved paths of the pictures that YAML files name as their image, also where the YAML is damaged."""
    found = set()
    for path in maps:
        for texts in _NAMED.findall(sniff_text(path))[:_MOST_NAMED]:
            picture = find_picture(path, "".join(texts).strip())
            if picture is not None:
                with suppress(OSError, RuntimeError):  # RuntimeError: links in a circle
                    found.add(picture.resolve())
    return frozenset(found)


def _places(folder: Path, named: str) -> Iterator[Path]:
    """Yield where a picture may lie, the likeliest first. Windows' rules split both kinds of paths."""
    yield folder / named
    yield folder / named.replace("\\", "/")
    windows = PureWindowsPath(named)
    parts = windows.parts[bool(windows.anchor) :]
    ends = [parts[-count:] for count in range(min(len(parts), _MOST_PARTS), 0, -1)]
    yield from (folder.joinpath(*end) for end in ends)
    yield from (folder.parent.joinpath(*end) for end in ends if len(end) > 1)


def _in_other_capitals(folder: Path, name: str) -> Path | None:
    """Return the one file in ``folder`` with such a name for Windows, which does not tell capitals apart."""
    if not name:
        return None
    found = []
    with suppress(OSError):
        for count, place in enumerate(folder.iterdir()):
            if count == _MOST_FILES:
                return None
            if place.name.casefold() == name.casefold() and _is_file(place):
                found.append(place)
    return found[0] if len(found) == 1 else None


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name longer than the disk allows
        return False
