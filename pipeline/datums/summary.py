"""What a table of datums holds, in a few numbers."""

from collections import Counter
from pathlib import Path
from typing import NamedTuple

import pyarrow.compute as pc

from pipeline.datums.reader import read_tables

_KINDS = ("pair_id", "plan_id", "building")


class Summary(NamedTuple):
    """Counts over all shards. per_split: datums of each split. leading_share: of datums that lead to the goal."""

    datums: int
    pairs: int
    plans: int
    buildings: int
    leading_share: float
    per_split: dict[str, int]


def summarise(folder: Path) -> Summary:
    """Return what the shards of ``folder`` hold; only the columns that it takes are read, shard by shard.

    Raises TableError as ``read_datums`` does.
    """
    kinds: dict[str, set[str]] = {name: set() for name in _KINDS}
    splits: Counter[str] = Counter()
    leading = 0
    for table in read_tables(folder, columns=[*_KINDS, "split", "leads_to_goal"]):
        for name in _KINDS:
            kinds[name].update(pc.unique(table[name]).to_pylist())
        splits.update({each["values"]: each["counts"] for each in pc.value_counts(table["split"]).to_pylist()})
        leading += pc.sum(table["leads_to_goal"]).as_py() or 0
    datums = splits.total()
    pairs, plans, buildings = (len(kinds[name]) for name in _KINDS)
    return Summary(datums, pairs, plans, buildings, leading / max(datums, 1), dict(sorted(splits.items())))
