"""Damage done to files: to their bytes and numbers, and to what their format makes of them.

`mutated` draws one damaged input from a seed and a number; the same two give the same input on every machine.
"""

from tests.fuzz.changes import BYTES, LINES, TEXT, TOKENS, Change, Random
from tests.fuzz.changes_to_packed import HEADER, NPZ, ZIP
from tests.fuzz.changes_to_trees import JSON, XML
from tests.fuzz.sample import ARCHIVE, MANIFEST, Sample
from tests.fuzz.seeds import samples_of


def mutated(reader: str, seed: int, number: int) -> tuple[str, Sample]:
    """Return the name of what was done, and the damaged sample."""
    rng = Random(f"{seed}/{reader}/{number}")
    sample = rng.choice(samples_of(reader))
    name = sample.main if rng.random() < 0.75 else rng.choice(sorted(sample.files))
    content, done = sample.files[name], []
    for _ in range(rng.choice((1, 1, 1, 2, 3, 8))):
        kinds = _changes_for(name, reader)
        change = rng.choice(rng.choice(kinds))
        content = change(content, rng)
        done.append(change.__name__.strip("_"))
    files = sample.files | {name: content}
    options = sample.options
    if rng.random() < 0.05:
        options = type(options)(
            metres_per_unit=rng.choice((None, 1e-9, 0.05, 1e9)), wall_m=rng.choice((0.0, 0.1, 50.0))
        )
    if rng.random() < 0.02:
        done.append("taken away")
        del files[rng.choice(sorted(files))]
        files = files or {"other.txt": b"hello"}
    return f"{name}: {', '.join(done)}", Sample(files, sample.main, options)


def _changes_for(name: str, reader: str) -> list[tuple[Change, ...]]:
    """Return groups of changes that make sense for a file; a group is chosen first, then one of it."""
    ending = name.rpartition(".")[2].lower()
    kinds: list[tuple[Change, ...]] = [BYTES]
    if ending in ("json", "jsonl", "geojson"):
        kinds += [TEXT, JSON, JSON]
    elif ending in ("xml", "svg"):
        kinds += [TEXT, XML, XML]
    elif ending in ("dxf", "ifc", "yaml", "map", "csv"):
        kinds += [TEXT, LINES, TOKENS]
    elif ending in ("npz", "zip") or reader == ARCHIVE:
        kinds += [ZIP, NPZ] if ending == "npz" else [ZIP]
    elif reader != MANIFEST:
        kinds += [HEADER]
    return kinds
