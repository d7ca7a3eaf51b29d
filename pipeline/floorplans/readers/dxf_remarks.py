"""What is said of a DXF drawing: which layers were taken, and what was left out and why."""

from collections import Counter
from collections.abc import Iterable, Iterator

from pipeline.floorplans.readers.dxf_entities import Found
from pipeline.floorplans.readers.dxf_layers import EXAMPLES_OF_WALLS, is_named
from pipeline.floorplans.readers.json_file import short_text
from pipeline.floorplans.readers.reader import ReadOptions

_MOST_NAMES = 12  # in one remark
_MOST_LETTERS = 60  # of one name


def remarks_on(found: Found, options: ReadOptions) -> list[str]:
    """Return which layers were taken as walls and doors, and a remark for whatever was left out."""
    doors = f"doors from {_listed(found.door_layers)}" if found.door_layers else "doors from none"
    taken = f"layers taken: walls from {_listed(found.wall_layers)}; {doors}"
    others = found.passed - found.wall_layers - found.door_layers
    if others:
        taken += f"; not from {_listed(others)}"
    return [taken, *_left_out(found), *_unused(found, options)]


def why_no_wall(found: Found, options: ReadOptions) -> str:
    """Return the sentences that refuse a drawing without walls."""
    reasons = "".join(f" {remark[0].upper()}{remark[1:]}." for remark in _left_out(found))
    wanted = _listed(options.wall_layers) if options.wall_layers else f"named for walls ({EXAMPLES_OF_WALLS})"
    advice = "Name the layers of the walls in plans.read.wall_layers."
    if found.external:
        advice = "Bind external references into the drawing, or name the layers of the walls in plans.read.wall_layers."
    return f"no wall on layers {wanted}; it has {_listed(found.layers)}.{reasons} {advice}"


def _left_out(found: Found) -> Iterator[str]:
    if found.hidden:
        count = _count(found.hidden.total(), "entity", "entities")
        yield f"{count} switched off, frozen or invisible passed over, on layers {_listed(found.hidden)}"
    if found.clipped.total():
        count = _count(found.clipped.total(), "entity", "entities")
        yield f"{count} cut off at the clip of a block, on layers {_listed(+found.clipped)}"
    yield from _by_layer(found.unread, "which is not read", "which are not read", "of kinds that are not read")
    yield from _by_layer(found.damaged, "which is damaged", "which are damaged", "that are damaged")
    if found.external:
        count = _count(found.external.total(), "external reference is", "external references are")
        them = "it" if found.external.total() == 1 else "them"
        yield f"{count} not read: {_listed(found.external)} (bind {them} into the drawing)"
    if found.absent:
        count = _count(found.absent.total(), "block is", "blocks are")
        yield f"{count} put in but not in the file: {_listed(found.absent)}"
    if found.damaged_blocks:
        count = _count(found.damaged_blocks, "block is", "blocks are")
        yield f"{count} damaged: what could not be read of them was left out"
    if found.deep_blocks:
        yield f"{_count(found.deep_blocks, 'block', 'blocks')} too deep within others left out"


def _by_layer(counts: Counter[tuple[str, str]], one: str, many: str, others: str) -> Iterator[str]:
    """Yield "layer A-WALL holds 2 TEXT, which are not read" for the most frequent kinds."""
    common = counts.most_common(_MOST_NAMES)
    for (layer, kind), count in common:
        yield f"layer {_short(layer)} holds {count} {_short(kind)}, {one if count == 1 else many}"
    if rest := counts.total() - sum(count for _, count in common):
        yield f"{_count(rest, 'more entity', 'more entities')} {others}"


def _unused(found: Found, options: ReadOptions) -> Iterator[str]:
    """Yield what a person named in vain."""
    for what, patterns, met in (
        ("walls", options.wall_layers, found.layers),
        ("doors", options.door_layers, found.layers | {name.removeprefix("block ") for name in found.door_layers}),
    ):
        vain = [pattern for pattern in patterns if not any(is_named(name, (pattern,)) for name in met)]
        if vain:
            yield f"no layer of {what} is called {_listed(vain)}; it has {_listed(found.layers)}"


def _count(count: int, one: str, many: str) -> str:
    return f"{count:,} {one if count == 1 else many}"


def _listed(names: Iterable[str]) -> str:
    listed = sorted({_short(name) for name in names})
    more = f" and {len(listed) - _MOST_NAMES} more" if len(listed) > _MOST_NAMES else ""
    return (", ".join(listed[:_MOST_NAMES]) or "none") + more


def _short(name: str) -> str:
    text = short_text(name)
    return text if len(text) <= _MOST_LETTERS else f"{text[: _MOST_LETTERS - 3]}..."
