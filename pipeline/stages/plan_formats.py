"""``hinterland plan formats``: what is read and written."""

import sys
from argparse import Namespace
from collections.abc import Sequence
from importlib.util import find_spec

from pipeline.floorplans.readers import READERS
from pipeline.floorplans.writers import WRITERS

# What --scale means to a reader; the others find the scale in the file.
NEEDED, IF_UNSTATED = "needed", "if unstated"
SCALE = {
    "raster_picture": IF_UNSTATED,
    "moving_ai": NEEDED,
    "svg": NEEDED,
    "dxf": IF_UNSTATED,
    "luperto": IF_UNSTATED,
    "resplan": IF_UNSTATED,
}
# Packages beyond the required ones: the extra that brings each.
EXTRAS = {"ifc": ("ifcopenshell", "hinterland[ifc]")}


def formats(given: Namespace) -> int:
    """Print two tables."""
    print("Read, in the order in which a file is tried:\n")
    read = [(name, " ".join(reader.patterns), SCALE.get(name, "in the file"), _extra(name), describe(reader))
            for name, reader in READERS.items()]  # fmt: skip
    print(_table(("name", "files", "scale", "needs", "what it is"), read))
    print("\nWritten by `hinterland plan convert --to NAME`:\n")
    write = [(name, f"*{writer.ending}", "cells" if writer.needs_cells else "cells or geometry", describe(writer))
             for name, writer in WRITERS.items()]  # fmt: skip
    print(_table(("name", "files", "holds", "what it is"), write))
    return 0


def describe(entry: object) -> str:
    """Return the first sentence of the module of a reader or writer."""
    text = sys.modules[type(entry).__module__].__doc__ or ""
    return text.strip().partition("\n")[0].replace("`", "")


def _extra(name: str) -> str:
    if name not in EXTRAS:
        return "-"
    package, extra = EXTRAS[name]
    return extra if find_spec(package) is None else f"{extra}, installed"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    widths = [max(len(row[k]) for row in [head, *rows]) for k in range(len(head))]
    lines = [head, ["-" * width for width in widths[:-1]] + ["-" * len(head[-1])], *rows]
    padded = [[cell.ljust(width) for cell, width in zip(line, widths, strict=True)] for line in lines]
    return "\n".join("  ".join(line).rstrip() for line in padded)
