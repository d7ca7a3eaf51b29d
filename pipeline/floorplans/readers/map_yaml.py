r"""The YAML of ROS maps as text: plain, without references, and in the dialects that tools write.

Other programs read what the standard forbids, so that maps with it are about: tabs between key and value, and the
header ``%YAML:1.0`` of OpenCV. Such a text is mended, and what was mended is said. In a path in double quotes, as in
``image: "C:\maps\map.pgm"``, backslashes are Windows' and no escapes.
"""

import re

import yaml

_MOST_BRACKETS = 200  # yaml takes seconds for thousands
_KEYS = (re.compile(r"^[\s{]*[\"']?image[\"']?\s*:", re.MULTILINE), re.compile(r"\bresolution[\"']?\s*:"))
_OPENCV = re.compile(r"\A\s*%YAML:[0-9.]+[ \t\r]*$", re.MULTILINE)
_QUOTED_IMAGE = re.compile(r"""(\bimage["']?\s*:\s*)"([^"\n\r]*\\[^"\n\r]*)\"""")

NOT_YAML = (
    *(yaml.YAMLError, OSError, ValueError, LookupError, TypeError),
    *(AttributeError, ArithmeticError, RecursionError),
)
"""What yaml raises on bad text: its own errors, and those of Python on impossible dates, numbers and depths."""


class _PlainLoader(yaml.SafeLoader):
    """YAML without references to what stands elsewhere in it: a few lines of them unfold to gigabytes."""

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("it refers to other parts of itself (*), which is not read")
        return super().compose_node(parent, index)


def load_map_yaml(text: str) -> tuple[object, tuple[str, ...]]:
    """Return what ``text`` holds, with remarks on what had to be mended.

    Raises:
        Exception: one of `NOT_YAML`; that of the text as it came, where mending does not help.
    """
    if text.count("[") + text.count("{") > _MOST_BRACKETS:
        raise yaml.YAMLError("it has far more brackets than the header of a map")
    text = _QUOTED_IMAGE.sub(lambda found: f"{found[1]}'{_windows(found[2])}'", text)
    try:
        return _plain(text), ()
    except NOT_YAML:
        mended, remarks = _mended(text)
        if not remarks:
            raise
        try:
            return _plain(mended), remarks
        except NOT_YAML:
            pass
        raise


def is_meant_as_map(text: str) -> bool:
    """Return whether ``text`` has the keys of a map, whatever else is wrong with it."""
    return all(key.search(text) for key in _KEYS)


def _plain(text: str) -> object:
    loader = _PlainLoader(text)
    try:
        return loader.get_single_data()
    finally:
        loader.dispose()


def _mended(text: str) -> tuple[str, tuple[str, ...]]:
    remarks = []
    if _OPENCV.search(text):
        text = _OPENCV.sub("", text, count=1)
        remarks.append("its first line %YAML:1.0, which OpenCV writes, is not YAML and was passed over")
    lines = [number for number, line in enumerate(text.splitlines(), start=1) if "\t" in line]
    if lines:
        text = text.replace("\t", " ")
        remarks.append(f"{len(lines)} lines have tabs, which YAML forbids (line {lines[0]} first): read as spaces")
    return text, tuple(remarks)


def _windows(path: str) -> str:
    return path.replace("\\\\", "\\").replace("'", "''")
